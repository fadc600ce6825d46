"""The exact derivatives of a system's rates and outputs by its states and inputs, at one point."""

from __future__ import annotations

import dataclasses
import weakref
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core.arrays import Array
from .program import CompiledSystem, Program

_functions: weakref.WeakKeyDictionary[Program, Any] = weakref.WeakKeyDictionary()


@dataclasses.dataclass(frozen=True, eq=False)
class Derivatives:
    """Rates f (n,) and outputs o (k,), and their slopes by state x and input u."""

    rates: Array
    outputs: Array
    rates_by_state: Array
    rates_by_input: Array
    outputs_by_state: Array
    outputs_by_input: Array


def derivatives(ready: CompiledSystem, state: Sequence[float], inputs: Sequence[float]) -> Derivatives:
    """The derivatives at a state vector (n,) under inputs (m,). At a kink they are those of one of its sides."""
    results = _function(ready.program)(np.asarray(state, float), np.asarray(inputs, float), ready.parameters)
    f, o, *slopes = (np.asarray(part, dtype=float) for part in results)
    return Derivatives(f[:, 0], o.reshape(-1), *slopes)


def _function(program: Program) -> Any:
    """(x, u, p) -> (f, o, df/dx, df/du, do/dx, do/du), differentiated once for a structure."""
    if program not in _functions:
        import casadi

        t = program.traced
        slopes = [casadi.jacobian(value, by) for value in (t.f, t.o) for by in (t.x, t.u)]
        _functions[program] = casadi.Function("derivatives", [t.x, t.u, t.p], [t.f, t.o, *slopes])
    return _functions[program]

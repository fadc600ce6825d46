"""A system near one state as a linear one: x' = A x + B u, y = C x + D u, with names, units and poles."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ..compile import System
from ..core.arrays import Array
from ..core.errors import AirmuscleError, ParameterError, suggestion
from ..plant.columns import units_of
from ..plant.plant import Plant
from ..plant.state import check_state, state_vector
from .equilibrium import given_inputs
from .static_stiffness import Stiffness, stiffness


class Pole(NamedTuple):
    """One pole [1/s], its natural frequency |s|/(2 pi) [Hz] and damping ratio -Re s/|s| (nan for an integrator)."""

    value: complex
    frequency: float
    damping_ratio: float


@dataclasses.dataclass(frozen=True, eq=False)
class LinearModel:
    """dx' = A dx + B du,  dy = C dx + D du: departures from the state and inputs that it was made at.

    A, B, C, D      (n, n), (n, m), (k, n), (k, m)
    states, inputs, outputs    names, in the order of rows and columns; the states are among the outputs
    units           unit of every name
    state, given    the values of the states and inputs that it was made at
    rates           (n,) what the states' rates were there: all zero at a rest
    stiffness       of a Plant, both of its stiffnesses there; None for another system
    """

    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    units: Mapping[str, str]
    state: Mapping[str, float]
    input_values: Mapping[str, float]
    rates: Array
    stiffness: Stiffness | None = None

    @property
    def poles(self) -> tuple[Pole, ...]:
        """The eigenvalues of A, the slowest first. Shut-in air and friction at rest are poles at zero."""
        values = sorted(np.linalg.eigvals(self.A).tolist(), key=lambda s: (abs(s), s.imag))
        return tuple(
            Pole(complex(s), abs(s) / (2 * math.pi), -complex(s).real / abs(s) if s else math.nan) for s in values
        )

    def select(self, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None) -> LinearModel:
        """The same with only these inputs and outputs, in this order. Raises ParameterError for an unknown name."""
        rows, columns = _places("output", outputs, self.outputs), _places("input", inputs, self.inputs)
        return dataclasses.replace(
            self,
            B=self.B[:, columns],
            C=self.C[rows],
            D=self.D[np.ix_(rows, columns)],
            inputs=tuple(self.inputs[i] for i in columns),
            outputs=tuple(self.outputs[i] for i in rows),
        )

    def frequency_response(self, frequencies: npt.ArrayLike) -> npt.NDArray[np.complex128]:
        """H(j 2 pi f) = C (j 2 pi f I - A)^-1 B + D at frequencies (F,) [Hz], of shape (F, k, m)."""
        found = []
        for f in np.atleast_1d(np.asarray(frequencies, dtype=float)):
            if not (np.isfinite(f) and f >= 0):
                raise ParameterError(f"response: a frequency is {f!r} Hz; it must be finite and not negative.")
            shifted = 2j * math.pi * f * np.eye(len(self.states)) - self.A
            try:
                found.append(self.C @ np.linalg.solve(shifted, self.B) + self.D)
            except np.linalg.LinAlgError:
                raise ParameterError(
                    f"response: there is a pole at {f:g} Hz, as shut-in air is at 0 Hz, and the response is "
                    "infinite. Choose another frequency."
                ) from None
        return np.array(found, dtype=complex)

    def to_scipy(self) -> Any:
        """A scipy.signal.StateSpace; it carries no names."""
        from scipy.signal import StateSpace

        return StateSpace(self.A, self.B, self.C, self.D)

    def to_control(self) -> Any:
        """A control.StateSpace with the names of states, inputs and outputs. Needs the package `control`."""
        try:
            import control
        except ImportError:
            raise AirmuscleError(
                "to_control needs the package 'control' (python-control); pip install control, or use to_scipy()."
            ) from None
        # The package takes a dot in a name for that of a system and its signal.
        names = {
            kind: [name.replace(".", "_") for name in given]
            for kind, given in (("states", self.states), ("inputs", self.inputs), ("outputs", self.outputs))
        }
        return control.StateSpace(self.A, self.B, self.C, self.D, **names)

    def __repr__(self) -> str:
        slow = ", ".join(f"{p.value:.4g}" for p in self.poles[:6])
        more = ", ..." if len(self.states) > 6 else ""
        return (
            f"LinearModel({len(self.states)} states, inputs {', '.join(self.inputs) or 'none'}, {len(self.outputs)} "
            f"outputs; poles {slow}{more} 1/s)"
        )


def linearise(plant: System, state: Mapping[str, float], inputs: Mapping[str, float] | None = None) -> LinearModel:
    """A system near a state and inputs (0 unless given), by exact derivatives of the equations that are simulated.

    At a kink - a valve just shut, a muscle just slack, a stop just touched - derivatives are those of one side, and
    where two kinks meet, as in the middle of a valve without overlap, of one side of each: choose a state away from
    it. The state need not be a rest; `rates` says whether it is. Raises ParameterError for an unknown or missing name,
    or an input beyond its range.
    """
    from ..compile.jacobians import derivatives
    from ..compile.program import compile_system

    x = state_vector(plant, state).tolist()
    if isinstance(plant, Plant):
        check_state(plant, state)
    given = _inputs(plant, inputs or {})
    names, u = [s.name for s in plant.states], list(given.values())
    if not np.isfinite(u).all():
        raise ParameterError(f"linearise: inputs must be finite; they are {given}.")
    ready = compile_system(plant)
    at = derivatives(ready, x, u)
    further = [i for i, name in enumerate(ready.output_names) if name not in names]
    return LinearModel(
        at.rates_by_state, at.rates_by_input,
        np.vstack([np.eye(len(names)), at.outputs_by_state[further]]),
        np.vstack([np.zeros((len(names), len(given))), at.outputs_by_input[further]]),
        tuple(names), tuple(given), (*names, *(ready.output_names[i] for i in further)),
        units_of(plant, ready.output_names), dict(zip(names, x, strict=True)), given, at.rates,
        stiffness(plant, state) if isinstance(plant, Plant) else None,
    )  # fmt: skip


def _inputs(plant: System, inputs: Mapping[str, float]) -> dict[str, float]:
    if isinstance(plant, Plant):
        return given_inputs(plant, inputs)
    for name in inputs:
        if name not in plant.inputs:
            raise ParameterError(f"the system has no input '{name}'; there are {', '.join(plant.inputs) or 'none'}.")
    return {name: float(inputs.get(name, 0.0)) for name in plant.inputs}


def _places(kind: str, wanted: Sequence[str] | None, known: tuple[str, ...]) -> list[int]:
    if wanted is None:
        return list(range(len(known)))
    for name in wanted:
        if name not in known:
            raise ParameterError(f"no {kind} '{name}'; there are {', '.join(known)}.{suggestion(name, known)}")
    return [known.index(name) for name in wanted]

"""Where each plant of a batch begins."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import numpy.typing as npt

from ...analysis.equilibrium import find_equilibrium, find_equilibrium_of_each, given_inputs
from ...analysis.equilibrium.many import block_of
from ...compile import System
from ...core.arrays import Array
from ...core.errors import ParameterError, PhysicsError, suggestion
from ...plant.plant import Plant
from ...plant.state import has_negative_mass
from .variations import Variations


def count_of_starts(start: Mapping[str, npt.ArrayLike] | None) -> int | None:
    """How many plants a start speaks of; None where it is one for all."""
    sizes = {name: np.size(value) for name, value in (start or {}).items() if np.ndim(value) > 0}
    if len(set(sizes.values())) > 1:
        raise ParameterError(f"start: every column needs one value a plant; there are {sizes}.")
    return next(iter(sizes.values()), None)


def given_starts(system: System, start: Mapping[str, npt.ArrayLike], count: int) -> Array:
    """States (N, n) from numbers or columns (N,) by name."""
    names = [s.name for s in system.states]
    for name in start:
        if name not in names:
            raise ParameterError(
                f"the plant has no state '{name}'; there are {', '.join(names)}.{suggestion(name, names)}"
            )
    missing = [name for name in names if name not in start]
    if missing:
        raise ParameterError(f"the start lacks {', '.join(missing)}; give a number for all, or a column (N,).")
    found = np.empty((count, len(names)))
    for i, name in enumerate(names):
        try:
            found[:, i] = start[name]
        except (TypeError, ValueError):
            raise ParameterError(
                f"start: '{name}' is {start[name]!r}; it must be a number for all, or a column (N,)."
            ) from None
        wrong = np.flatnonzero(~np.isfinite(found[:, i]))
        if wrong.size:
            raise ParameterError(f"start, row {wrong[0]}: '{name}' is {found[wrong[0], i]}; it must be finite.")
    for row, i in np.argwhere(has_negative_mass(system, found)):
        raise ParameterError(f"start, row {row}: '{names[i]}' is {found[row, i]:g}; there is no less air than none.")
    return found


def resting_starts(variations: Variations, advanced: Callable[[int], None]) -> tuple[Array, dict[int, str]]:
    """The equilibrium at ambient pressure of every plant (N, n), and why there is none where there is none.

    A circuit without states does not matter to it, so plants that differ in nothing else share it. `advanced` is told
    how many are done.
    """
    from ...compile.program import compile_system  # CasADi, which describing a plant does not need

    plant = variations.system
    if not isinstance(plant, Plant):
        raise ParameterError(f"simulate_batch: give the start of {type(plant).__name__}, a value for each state.")
    given_inputs(plant, None)  # refused where an input cannot be 0
    rows, shared = _different(plant, variations)
    ready, pressures = compile_system(plant), (0.0,) * len(plant.muscles)
    inputs, names = np.zeros(len(plant.inputs)), [s.name for s in plant.states]
    states, reasons = np.full((rows.size, len(names)), np.nan), dict[int, str]()
    each = block_of(len(names))
    for begin in range(0, rows.size, each):
        part = rows[begin : begin + each]
        found = find_equilibrium_of_each(ready, variations.table(part), pressures, inputs)
        states[begin : begin + each] = found.states
        for i in np.flatnonzero(~np.isfinite(found.states).all(axis=1)):
            state = _rest(variations.one(int(part[i])), names)
            if isinstance(state, str):
                reasons[begin + int(i)] = state
            else:
                states[begin + i] = state
            advanced(begin + int(i))
        advanced(begin + part.size)
    return states[shared], {row: reasons[i] for row, i in enumerate(shared.tolist()) if i in reasons}


def _different(plant: Plant, variations: Variations) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """The first of all plants that share a rest, and for each plant (N,) which of these it shares it with."""
    stateless = not any(circuit.states(plant.ambient) for circuit in plant.circuits)
    matters = [i for i, path in enumerate(variations.paths) if not (stateless and path.startswith("circuit"))]
    known: dict[bytes, int] = {}
    table = np.ascontiguousarray(variations.values[:, matters])
    shared = [known.setdefault(row.tobytes(), len(known)) for row in table]
    first = np.unique(np.array(shared, dtype=np.intp), return_index=True)[1]
    return first, np.array(shared, dtype=np.intp)


def _rest(plant: System, names: list[str]) -> Array | str:
    assert isinstance(plant, Plant)
    try:
        state = find_equilibrium(plant, pressure=0.0)
    except PhysicsError as error:
        return f"it has no equilibrium to start from: {error}"
    return np.array([state[name] for name in names])

"""Where each plant of a batch begins."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import numpy.typing as npt

from ..equilibrium import equilibrium
from ..errors import ParameterError, PhysicsError, suggestion
from ..plant import Plant
from ..program import System
from ..start import less_than_none
from .variations import Variations

Array = npt.NDArray[np.float64]


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
    for row, i in np.argwhere(less_than_none(system, found)):
        raise ParameterError(f"start, row {row}: '{names[i]}' is {found[row, i]:g}; there is no less air than none.")
    return found


def resting_starts(variations: Variations, advanced: Callable[[int], None]) -> tuple[Array, dict[int, str]]:
    """The equilibrium at ambient pressure of every plant (N, n), and why there is none where there is none.

    A circuit does not matter to it, so plants that differ in nothing else share it. `advanced` is told how many are
    done.
    """
    plant = variations.system
    if not isinstance(plant, Plant):
        raise ParameterError(f"simulate_batch: give the start of {type(plant).__name__}, a value for each state.")
    matters = [i for i, path in enumerate(variations.paths) if not path.startswith("circuit")]
    names, known = [s.name for s in plant.states], dict[bytes, Array | str]()
    states, reasons = np.full((len(variations.values), len(names)), np.nan), {}
    for row, values in enumerate(variations.values):
        key = values[matters].tobytes()
        if key not in known:
            known[key] = _rest(variations.one(row), names)
        found = known[key]
        if isinstance(found, str):
            reasons[row] = found
        else:
            states[row] = found
        advanced(row + 1)
    return states, reasons


def _rest(plant: System, names: list[str]) -> Array | str:
    assert isinstance(plant, Plant)
    try:
        state = equilibrium(plant, pressure=0.0)
    except PhysicsError as error:
        return f"it has no equilibrium to start from: {error}"
    return np.array([state[name] for name in names])

"""Initial states of a batch: given, or the equilibria of the plants."""

from collections.abc import Callable, Mapping

import numpy as np
import numpy.typing as npt

from ....core import AirmuscleError, Array, ParameterError, PhysicsError, System, suggestion
from .variations import Column, Variations

STATES_AT_ONCE = 500
"""Systems whose default states are computed between two reports of progress (chosen)."""


def count_of_states(given: Mapping[str, npt.ArrayLike] | None) -> int | None:
    """The number of plants that initial states are given for; None where they are the same for all."""
    sizes = {name: np.size(value) for name, value in (given or {}).items() if np.ndim(value) > 0}
    if len(set(sizes.values())) > 1:
        raise ParameterError(f"initial_states: every column needs one value per plant; there are {sizes}.")
    return next(iter(sizes.values()), None)


def given_states(system: System, given: Mapping[str, npt.ArrayLike], count: int) -> Array:
    """Initial states (N, n) from numbers or columns (N,) by name."""
    names = [s.name for s in system.states]
    for name in given:
        if name not in names:
            raise ParameterError(
                f"the plant has no state '{name}'; there are {', '.join(names)}.{suggestion(name, names)}"
            )
    missing = [name for name in names if name not in given]
    if missing:
        raise ParameterError(f"initial_states lack {', '.join(missing)}; give a number for all, or a column (N,).")
    states = np.empty((count, len(names)))
    for i, name in enumerate(names):
        try:
            states[:, i] = given[name]
        except (TypeError, ValueError):
            raise ParameterError(
                f"initial_states: '{name}' is {str(given[name])[:80]}; it must be a number for all, or a column (N,)."
            ) from None
        wrong = np.flatnonzero(~np.isfinite(states[:, i]))
        if wrong.size:
            raise ParameterError(
                f"initial_states, row {wrong[0]}: '{name}' is {states[wrong[0], i]}; it must be finite."
            )
    for row, i in np.argwhere(states < np.asarray(system.state_lower_bounds)):
        raise ParameterError(
            f"initial_states, row {row}: '{names[i]}' is {states[row, i]:.4g}; it must not be negative."
        )
    return states


def check_states(variations: Variations, states: Array) -> None:
    """Raise the error of `simulate` for an impossible initial state (N, n), with its row."""
    names = [s.name for s in variations.system.states]
    try:
        columns = {name: column.view(Column) for name, column in zip(names, states.T, strict=True)}
        variations.as_columns().check_state(columns)
    except (TypeError, ValueError, AirmuscleError):  # rows differ, or one of them is impossible: row by row
        for row, state in enumerate(states.tolist()):
            try:
                variations.one(row).check_state(dict(zip(names, state, strict=True)))
            except AirmuscleError as error:
                text = str(error).removeprefix("the initial state: ")
                raise type(error)(f"initial_states, row {row}: {text}") from None


def default_states(variations: Variations, advanced: Callable[[int], None]) -> tuple[Array, dict[int, str]]:
    """The default state of every system (N, n), and why there is none where there is none.

    Systems that differ only in parameters without an effect on it share it. `advanced` is called with the number of
    systems that are done.
    """
    system = variations.system
    rows, shared = _distinct(system, variations)
    names = [s.name for s in system.states]
    states, reasons = np.full((rows.size, len(names)), np.nan), dict[int, str]()
    for begin in range(0, rows.size, STATES_AT_ONCE):
        part = rows[begin : begin + STATES_AT_ONCE]
        table = system.default_states(variations.table(part))
        if table is None:
            raise ParameterError(
                f"simulate_batch: give the initial_states of {type(system).__name__}, a value for each state."
            )
        states[begin : begin + part.size] = table
        for i in np.flatnonzero(~np.isfinite(table).all(axis=1)):
            state = _default_state(variations.one(int(part[i])), names)
            if isinstance(state, str):
                reasons[begin + int(i)] = state
            else:
                states[begin + i] = state
            advanced(begin + int(i))
        advanced(begin + part.size)
    return states[shared], {row: reasons[i] for row, i in enumerate(shared.tolist()) if i in reasons}


def _distinct(system: System, variations: Variations) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """The first of all systems that share a default state, and for each (N,) the index of the shared one."""
    relevant = [i for i, path in enumerate(variations.paths) if system.affects_default_state(path)]
    known: dict[bytes, int] = {}
    table = np.ascontiguousarray(variations.values[:, relevant])
    shared = [known.setdefault(row.tobytes(), len(known)) for row in table]
    first = np.unique(np.array(shared, dtype=np.intp), return_index=True)[1]
    return first, np.array(shared, dtype=np.intp)


def _default_state(system: System, names: list[str]) -> Array | str:
    try:
        state = system.default_state() or {}
    except PhysicsError as error:
        return f"it has no equilibrium to start from: {error}"
    return np.array([state[name] for name in names])

"""Variations: parameters of N plants by path, checked as if each plant were constructed; their
initial states.
"""

import dataclasses
import itertools
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ....core import (
    AirmuscleError,
    Array,
    ParameterError,
    PhysicsError,
    System,
    check_known,
    one_line,
    parts_of,
    tree,
)
from ....core.declaration import check_together

STATES_AT_ONCE = 500
"""Systems whose default states are computed between two reports of progress (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False)
class Variations:
    """A system, and for N others of its structure the values (N, V) of the parameters that
    differ.
    """

    system: System
    paths: tuple[str, ...]
    places: npt.NDArray[np.intp]
    values: Array

    def parameters(self, index: int) -> Array:
        """All parameters (P,) of one of the systems."""
        parameters = tree.flatten(self.system).copy()
        parameters[self.places] = self.values[index]
        return parameters

    def table(self, indices: npt.NDArray[np.intp]) -> Array:
        """All parameters (R, P) of some of the systems."""
        parameters = np.repeat(tree.flatten(self.system)[None, :], indices.size, axis=0)
        parameters[:, self.places] = self.values[indices]
        return parameters

    def one(self, index: int) -> System:
        """One of the systems."""
        return tree.unflatten(self.system, self.parameters(index).tolist())

    def nominal(self) -> Array:
        """Nominal size (N, n) of each state, below which its relative error no longer matters, for
        every system.
        """
        count = len(self.values)
        if not self.paths:
            return np.array([[s.nominal for s in self.system.states]] * count)
        try:
            columns = [np.broadcast_to(s.nominal, count) for s in self.as_columns().states]
            return np.column_stack([c.astype(float) for c in columns])
        except (
            TypeError,
            ValueError,
            AirmuscleError,
        ):  # a system whose `states` takes plain numbers only
            return np.array([[s.nominal for s in self.one(i).states] for i in range(count)])

    def as_columns(self) -> Any:
        """The system with a column (N,) in place of every parameter that differs."""
        leaves: list[Any] = tree.flatten(self.system).tolist()
        for place, column in zip(self.places, self.values.T, strict=True):
            leaves[place] = column.view(Column)
        return tree.unflatten(self.system, leaves)

    def check_consistent(self) -> None:
        """Raise ParameterError, naming the row, where parameters of a model do not go together."""
        for _, part in parts_of(self.as_columns()) if self.paths else ():
            try:
                check_together(part)
            except (
                TypeError,
                ValueError,
                AirmuscleError,
            ):  # rows differ, or one of them is impossible: row by row
                values = [leaf.value for leaf in tree.leaves(part)]
                columns = [
                    v.tolist() if isinstance(v, np.ndarray) else itertools.repeat(v) for v in values
                ]
                for row, *numbers in zip(range(len(self.values)), *columns, strict=False):
                    try:
                        check_together(tree.unflatten(part, numbers))
                    except ParameterError as error:
                        raise error.located(f"variations, row {row}") from None


class Column(np.ndarray):
    """A column with a truth value where all rows agree, so that one `if` serves for all of them."""

    def __bool__(self) -> bool:
        answers = np.asarray(self, dtype=bool)
        if answers.any() and not answers.all():
            raise ValueError("the rows differ")
        return bool(answers.any())


def variations_of(
    system: Any, columns_by_path: Mapping[str, npt.ArrayLike], count: int | None
) -> Variations:
    """The variations of a System, or of a controller. Raises ParameterError for an unknown path or
    an impossible value.

    `count` is the number of plants where initial states or inputs determine it.
    """
    if not isinstance(columns_by_path, Mapping):
        raise ParameterError(
            f"variations: they are {one_line(columns_by_path)}; give a column of values for each"
            " path."
        )
    leaves = {leaf.path: (place, leaf) for place, leaf in enumerate(tree.leaves(system))}
    columns = []
    for path, values in columns_by_path.items():
        check_known(f"variations: {type(system).__name__} has no parameter", path, leaves)
        columns.append(_column(leaves[path][1], values))
    follow = tree.absolute_pressures(system, dict(zip(columns_by_path, columns, strict=True)))
    columns_by_path = {**columns_by_path, **follow}
    columns += [_column(leaves[path][1], values) for path, values in follow.items()]
    sizes = {path: len(column) for path, column in zip(columns_by_path, columns, strict=True)}
    if len({*sizes.values(), *(() if count is None else (count,))}) > 1:
        counted_by_rest = "" if count is None else f", and initial states or inputs for {count}"
        raise ParameterError(
            f"variations: every column needs one value per plant; there are {sizes}"
            f"{counted_by_rest}."
        )
    count = next(iter(sizes.values()), count)
    if count is None:
        raise ParameterError(
            "simulate_batch: nothing varies; give variations, initial states or inputs, or use"
            " simulate."
        )
    if count == 0:
        raise ParameterError("simulate_batch: there are no plants; give at least one row.")
    table = np.column_stack(columns) if columns else np.empty((count, 0))
    varied = Variations(
        system,
        tuple(columns_by_path),
        np.array([leaves[p][0] for p in columns_by_path], dtype=np.intp),
        table,
    )
    varied.check_consistent()
    return varied


def _column(leaf: tree.Leaf, column: npt.ArrayLike) -> Array:
    """One parameter of all plants, within its bounds."""
    try:
        values = np.array(column, dtype=float)
    except (TypeError, ValueError):
        raise ParameterError(
            f"variations: '{leaf.path}' must be numbers, one for each plant; it is"
            f" {one_line(column)}."
        ) from None
    if values.ndim != 1:
        raise ParameterError(
            f"variations: '{leaf.path}' must be a column (N,), one value per plant; its shape is"
            f" {values.shape}."
        )
    declared = leaf.declared
    low, high = declared.bounds
    unit = "" if declared.unit == "1" else f" {declared.unit}"
    wrong = np.flatnonzero(~(np.isfinite(values) & (values >= low) & (values <= high)))
    if wrong.size:
        row = int(wrong[0])
        more = f" ({wrong.size - 1} further rows too)" if wrong.size > 1 else ""
        raise ParameterError(
            f"variations, row {row}: '{leaf.path}' ({declared.symbol}, {declared.meaning}) is"
            f" {values[row]:g}{unit}; allowed range: {low:g} to {high:g}{unit}{more}. Values are in"
            " SI units."
        )
    return values


def given_states(
    variations: Variations, states_by_name: Mapping[str, npt.ArrayLike], count: int
) -> Array:
    """Initial states (N, n) from numbers or columns (N,) by name. Raises ParameterError for an
    impossible one.
    """
    system = variations.system
    names = [s.name for s in system.states]
    check_known("the plant has no state", states_by_name, names)
    missing = [name for name in names if name not in states_by_name]
    if missing:
        raise ParameterError(
            f"initial_states lack {', '.join(missing)}; give a number for all, or a column (N,)."
        )
    states = np.empty((count, len(names)))
    for i, name in enumerate(names):
        try:
            states[:, i] = states_by_name[name]
        except (TypeError, ValueError):
            raise ParameterError(
                f"initial_states: '{name}' is {str(states_by_name[name])[:80]}; it must be a number"
                " for all, or a column (N,)."
            ) from None
        wrong = np.flatnonzero(~np.isfinite(states[:, i]))
        if wrong.size:
            raise ParameterError(
                f"initial_states, row {wrong[0]}: '{name}' is {states[wrong[0], i]}; it must be"
                " finite."
            )
    for row, i in np.argwhere(states < np.asarray(system.state_lower_bounds)):
        raise ParameterError(
            f"initial_states, row {row}: '{names[i]}' is {states[row, i]:.4g}; it must not be"
            " negative."
        )
    _check_states(variations, names, states)
    return states


def _check_states(variations: Variations, names: list[str], states: Array) -> None:
    """Raise the error of `simulate` for an impossible initial state (N, n), with its row."""
    try:
        columns = {name: column.view(Column) for name, column in zip(names, states.T, strict=True)}
        variations.as_columns().check_state(columns)
    except (
        TypeError,
        ValueError,
        AirmuscleError,
    ):  # rows differ, or one of them is impossible: row by row
        for row, state in enumerate(states.tolist()):
            try:
                variations.one(row).check_state(dict(zip(names, state, strict=True)))
            except AirmuscleError as error:
                raise type(error)(
                    f"initial_states, row {row}: {str(error).removeprefix('the initial state: ')}"
                ) from None


def default_states(
    variations: Variations, advanced: Callable[[int], None]
) -> tuple[Array, dict[int, str]]:
    """The default state of every system (N, n), and why there is none where there is none.

    Systems that differ only in parameters without an effect on it share it. `advanced` is told how
    many are done.
    """
    system = variations.system
    relevant = [i for i, path in enumerate(variations.paths) if system.affects_default_state(path)]
    known: dict[bytes, int] = {}
    values = np.ascontiguousarray(variations.values[:, relevant])
    shared = np.array(
        [known.setdefault(row.tobytes(), len(known)) for row in values], dtype=np.intp
    )
    rows = np.unique(shared, return_index=True)[1]
    states = np.full((rows.size, len(system.states)), np.nan)
    reasons = dict[int, str]()
    for begin in range(0, rows.size, STATES_AT_ONCE):
        part = rows[begin : begin + STATES_AT_ONCE]
        table = system.default_states(variations.table(part))
        if table is None:
            raise ParameterError(
                f"simulate_batch: give the initial_states of {type(system).__name__}, a value for"
                " each state."
            )
        states[begin : begin + part.size] = table
        for i in np.flatnonzero(~np.isfinite(table).all(axis=1)).tolist():
            try:
                state = variations.one(int(part[i])).default_state() or {}
                states[begin + i] = [state[s.name] for s in system.states]
            except PhysicsError as error:
                reasons[begin + i] = f"it has no equilibrium to start from: {error}"
            advanced(begin + i)
        advanced(begin + part.size)
    return states[shared], {
        row: reasons[i] for row, i in enumerate(shared.tolist()) if i in reasons
    }

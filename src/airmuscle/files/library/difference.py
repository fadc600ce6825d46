"""Difference of two muscles or laws: their parameters, and their forces where both are valid."""

import dataclasses
import functools
from typing import Any

import numpy as np

from ...bench.reported import Reported
from ...core import Array, ParameterError, cite, leaves, plotting
from ...physics.muscle.characteristic.validity_range import validity_range_of
from ...report.chapter import BY_ROW, Chapter, NamedValue, Plot, Table, TableColumn
from ...report.parameter_tables import ends_of_lists
from .entry import Entry
from .entry_display import PARTS
from .force_map import UNSTATED_CONTRACTIONS, UNSTATED_PRESSURES, forces_on_grid

PRESSURES = 5
CONTRACTIONS = 41
"""Isobars of the comparison, and points of each (chosen)."""
EQUAL = 1e-9
"""Difference of parameters, as a part of the greater one, up to which they are equal (chosen)."""


@dataclasses.dataclass(frozen=True)
class ParameterDifference:
    """A parameter [SI] that differs; None where an entry does not have it."""

    path: str
    unit: str
    meaning: str
    first: Any
    second: Any

    @property
    def ratio(self) -> float | None:
        """Second over first; None where one is zero, absent, or no number."""
        numbers = isinstance(self.first, float) and isinstance(self.second, float)
        if not numbers or not self.first or not self.second:
            return None
        return float(self.second / self.first)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class EntryDifference(Reported):
    """What differs between two entries.

    first, second  the entries
    parameters     those that differ or that one of them has alone
    pressures      of the isobars [Pa], shape (P,), in the range of both laws
    contractions   shape (C,)
    forces         tensions [N] of both, shape (2, P, C); not a number where a law has no solution
    """

    first: Entry
    second: Entry
    parameters: tuple[ParameterDifference, ...]
    pressures: Array
    contractions: Array
    forces: Array

    @property
    def force_difference(self) -> Array:
        """Tension of the second less that of the first [N], shape (P, C)."""
        return np.asarray(self.forces[1] - self.forces[0])

    @property
    def greatest_place(self) -> tuple[int, int] | None:
        """Indices of pressure and contraction of the greatest difference; None without any."""
        magnitudes = np.abs(self.force_difference)
        if not np.isfinite(magnitudes).any():
            return None
        row, column = np.unravel_index(np.nanargmax(magnitudes), magnitudes.shape)
        return int(row), int(column)

    @property
    def rms_difference(self) -> float:
        """Root mean square of the difference of the tensions [N]; not a number without any."""
        squares = self.force_difference**2
        return float(np.sqrt(np.nanmean(squares))) if np.isfinite(squares).any() else float("nan")

    def chapter(self) -> Chapter:
        """The description of the difference."""
        names = f"{self.first.name} and {self.second.name}"
        return Chapter(
            "difference",
            f"Difference of {names}",
            self._summary(),
            values=self._values(),
            tables=(*self._parameter_tables(), self._isobar_table()),
            plots=(
                Plot(
                    "difference",
                    f"Isobars of {names}, in the range in which both are valid.",
                    functools.partial(_isobar_figure, self),
                ),
            ),
            references=(*cite(self.first), *cite(self.second)),
        )

    def _summary(self) -> str:
        place = self.greatest_place
        if place is None:
            return "The laws have no point at which both have a solution."
        row, column = place
        greatest = self.force_difference[row, column]
        if not greatest:
            return "Both laws give the same forces."
        scale = float(np.nanmax(self.forces))
        share = f", {100 * abs(greatest) / scale:.3g} % of the greatest force" if scale else ""
        return (
            f"The force of {self.second.name} differs most at {self.pressures[row] / 1e3:.4g} kPa"
            f" and a contraction of {100 * self.contractions[column]:.3g} %: {greatest:+.4g}"
            f" N{share}. The rms difference is {self.rms_difference:.4g} N."
        )

    def _values(self) -> tuple[NamedValue, ...]:
        place = self.greatest_place
        if place is None:
            return ()
        greatest = float(self.force_difference[place])
        return (
            NamedValue("greatest difference of the force", greatest, "N"),
            NamedValue("rms difference of the force", self.rms_difference, "N"),
            NamedValue("parameters that differ", len(self.parameters)),
        )

    def _parameter_tables(self) -> tuple[Table, ...]:
        if not self.parameters:
            return ()
        items = self.parameters
        columns = {
            "parameter": [item.path for item in items],
            "first": TableColumn([item.first for item in items], BY_ROW),
            "second": TableColumn([item.second for item in items], BY_ROW),
            "unit": [item.unit for item in items],
            "ratio": TableColumn([item.ratio for item in items], "1", digits=4),
            "meaning": TableColumn([item.meaning for item in items], brief=False),
        }
        note = (
            f"First: {self.first.name}; second: {self.second.name}. A dash: the entry does not have"
            " it."
        )
        brief = ends_of_lists([item.path for item in items])
        return (Table("parameters", "Parameters that differ", columns, note, brief=brief),)

    def _isobar_table(self) -> Table:
        differences = self.force_difference
        greatest = []
        places = []
        for row in differences:
            finite = np.isfinite(row)
            column = int(np.nanargmax(np.abs(row))) if finite.any() else 0
            greatest.append(float(row[column]) if finite.any() else None)
            places.append(self.contractions[column])
        columns = {
            "pressure": TableColumn(self.pressures, "Pa", "kPa"),
            "greatest difference": TableColumn(greatest, "N"),
            "at contraction": TableColumn(places, "1", "%", 3),
        }
        return Table("isobars", "Difference along isobars", columns, brief=len(self.pressures))


def compare_entries(first: Entry, second: Entry) -> EntryDifference:
    """The difference of two muscles or laws: parameters by path, forces in the range of both.

    The range of a law that states none is 0 to 6 bar and 0 to 25 % (chosen). Raises ParameterError
    for ranges without a common part.
    """
    pressures = _common(
        first, second, "pressure", UNSTATED_PRESSURES, lambda value: f"{value / 1e3:.4g} kPa"
    )
    contractions = _common(
        first, second, "contraction", UNSTATED_CONTRACTIONS, lambda value: f"{100 * value:.4g} %"
    )
    isobars = np.linspace(*pressures, PRESSURES)
    points = np.linspace(*contractions, CONTRACTIONS)
    forces = [forces_on_grid(entry.characteristic, isobars, points) for entry in (first, second)]
    return EntryDifference(
        first, second, _parameter_differences(first, second), isobars, points, np.array(forces)
    )


def _common(
    first: Entry, second: Entry, name: str, unstated: tuple[float, float], shown: Any
) -> tuple[float, float]:
    """The part of a range [SI] that both entries state."""
    ranges = []
    for entry in (first, second):
        known = validity_range_of(entry.characteristic, entry.validity_range)
        ranges.append(unstated if known is None else getattr(known, name))
    low = max(limits[0] for limits in ranges)
    high = min(limits[1] for limits in ranges)
    if low >= high:
        texts = [f"{shown(limits[0])} to {shown(limits[1])}" for limits in ranges]
        raise ParameterError(
            f"{first.name} is valid from {texts[0]} and {second.name} from {texts[1]}: they have no"
            f" {name} in common. Compare entries that were measured in the same range."
        )
    return low, high


def _parameter_differences(first: Entry, second: Entry) -> tuple[ParameterDifference, ...]:
    """The parameters that differ, in the order of the files; of parts of different models their
    names alone.
    """
    differences: list[ParameterDifference] = []
    parts_of_first = _parts(first)
    parts_of_second = _parts(second)
    for name in PARTS:
        pair = (parts_of_first.get(name), parts_of_second.get(name))
        if type(pair[0]) is type(pair[1]):
            differences += _differences_of_part(name, *pair)
        else:
            models = [None if part is None else type(part).__name__ for part in pair]
            meaning = "model of this part"
            differences.append(ParameterDifference(name, "", meaning, models[0], models[1]))
    return tuple(differences)


def _parts(entry: Entry) -> dict[str, Any]:
    """The parts of an entry by name; a geometry that is that of the law is left out."""
    parts = {name: part for name in PARTS if (part := getattr(entry, name, None)) is not None}
    own = getattr(parts.get("characteristic"), "geometry", None)
    if "geometry" in parts and parts["geometry"] == own:
        del parts["geometry"]
    return parts


def _differences_of_part(name: str, first: Any, second: Any) -> list[ParameterDifference]:
    """The parameters that differ of two parts of one model."""
    if first is None:
        return []
    leaves_of_first = {leaf.path: leaf for leaf in leaves(first)}
    leaves_of_second = {leaf.path: leaf for leaf in leaves(second)}
    differences = []
    for path in dict.fromkeys((*leaves_of_first, *leaves_of_second)):
        pair = [leaves_of_first.get(path), leaves_of_second.get(path)]
        values = [None if leaf is None else float(leaf.value) for leaf in pair]
        if not _are_equal(*values):
            declared = next(leaf for leaf in pair if leaf is not None).declared
            differences.append(
                ParameterDifference(
                    f"{name}.{path}", declared.unit, declared.meaning, values[0], values[1]
                )
            )
    return differences


def _are_equal(first: float | None, second: float | None) -> bool:
    if first is None or second is None:
        return first is second
    return abs(first - second) <= EQUAL * max(abs(first), abs(second))


def _isobar_figure(difference: EntryDifference) -> Any:
    """Isobars of both laws: lines of the first, dashes of the second."""
    figure, axes = plotting.new_figure()
    percent = 100.0 * difference.contractions
    for row, pressure in enumerate(difference.pressures):
        colour = plotting.LINES[row]
        label = f"{pressure / 1e3:.4g} kPa"
        axes.plot(percent, difference.forces[0, row], color=colour, label=label)
        axes.plot(percent, difference.forces[1, row], color=colour, linestyle="--")
    axes.plot([], [], color=plotting.BLACK, label=difference.first.name)
    axes.plot([], [], color=plotting.BLACK, linestyle="--", label=difference.second.name)
    axes.set_xlabel("contraction in %")
    axes.set_ylabel("force in N")
    plotting.legend_outside(axes, title="gauge pressure")
    return figure

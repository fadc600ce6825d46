"""Evaluation of a muscle or a law: the third of pressure, contraction and force from the other
two.
"""

import dataclasses
import math
import warnings
from collections.abc import Iterator, Mapping
from typing import Any

from ...bench.reported import Reported
from ...core import check_above_vacuum, contraction_text, quantity, quantity_text
from ...core.errors import (
    AirmuscleWarning,
    GeometryLimitError,
    ParameterError,
    PhysicsError,
    RatingError,
    SolveError,
)
from ...physics import muscle
from ...physics.muscle.characteristic import ForceLaw, ValidityRange, validity_range_of
from ...physics.muscle.characteristic.calls import silent_beyond_range
from ...physics.muscle.working_point import WorkingPoint, describe_point
from ...report.chapter import Chapter, NamedValue, Plot, Table, TableColumn
from .entry import Entry, own_length

UNITS = {"pressure": "Pa", "contraction": "1", "force": "N"}


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Evaluation(Reported):
    """A working point of an entry; `solved` is the quantity that follows from the other two."""

    entry: Entry
    point: WorkingPoint
    solved: str

    @property
    def stiffness(self) -> float | None:
        """-dF/deps at constant pressure [N]; None where the force is not unique or not defined."""
        try:
            return float(
                self.entry.characteristic.stiffness(self.point.pressure, self.point.contraction)
            )
        except PhysicsError:
            return None

    @property
    def validity_range(self) -> ValidityRange | None:
        """The validity range of the law; None if none is stated."""
        return validity_range_of(self.entry.characteristic, self.entry.validity_range)

    def chapter(self) -> Chapter:
        """The description of the point: quantities, stiffness, and the isobars around it."""
        point = self.point
        length = own_length(self.entry)
        stiffness = self.stiffness
        limits = self.validity_range
        ratings = self.entry.ratings
        remarks = {"pressure": "gauge"}
        if length:
            moved = quantity_text(length * point.contraction, "m", "mm")
            resting_length = quantity_text(length, "m", "mm", 6)
            remarks["contraction"] = f"{moved} of {resting_length}"
        shown = {"pressure": "kPa", "contraction": "%", "force": "N"}
        digits = {
            name: 4 if name in (self.solved, "contraction") else 6 for name in UNITS
        }  # a given value as given
        values = [
            NamedValue(
                name,
                value,
                UNITS[name],
                shown[name],
                digits[name],
                "; ".join(filter(None, (remarks.get(name, ""), "solved" * (name == self.solved)))),
            )
            for name, value in point._asdict().items()
        ]
        if stiffness is not None and length:
            values.append(
                NamedValue(
                    "stiffness", stiffness / length, "N/m", "N/mm", remark="at constant pressure"
                )
            )
            values.append(NamedValue("stiffness per contraction", stiffness, "N", brief=False))
        elif stiffness is not None:
            values.append(
                NamedValue(
                    "stiffness per contraction",
                    stiffness,
                    "N",
                    "N/%",
                    remark="at constant pressure",
                )
            )
        title = self.entry.title
        caption = (
            f"{title}: force over contraction at constant gauge pressure. Working point:"
            f" {describe_point(point)}."
        )
        inside = (
            None if limits is None else bool(limits.contains(point.pressure, point.contraction))
        )
        permitted = None if ratings is None else not ratings.excesses(**point._asdict())
        return Chapter(
            name="evaluation",
            title=f"{self.entry.name}: {title}",
            summary="",
            values=(
                *values,
                NamedValue("solved", self.solved, brief=False),
                NamedValue("resting length", length, "m", "mm", brief=False),
                NamedValue("inside the validity range", inside, brief=False),
                NamedValue("permitted", permitted, brief=False),
            ),
            plots=(Plot("isobars", caption, self._figure),),
        )

    def _figure(self) -> Any:
        law = self.entry.characteristic
        title = self.entry.title
        return muscle.isobar_figure(law, title, self.isobars(), self.validity_range, self.point)

    def isobars(self) -> "muscle.Isobars":
        """The isobars of the law, with that of the point."""
        return muscle.compute_isobars(self.entry.characteristic, self.validity_range, self.point)

    def isobar_table(self) -> Table:
        """The isobars as a table with one column of tensions per pressure."""
        curves = self.isobars()
        columns = {"contraction": TableColumn(curves.contractions, "1")}
        for pressure, forces in zip(curves.pressures, curves.forces, strict=True):
            columns[f"force at {pressure / 1e3:.6g} kPa"] = TableColumn(forces, "N")
        return Table("isobars", "Isobars", columns, "Gauge pressures.", series=True)


def evaluate(entry: Entry, given: Mapping[str, Any]) -> Evaluation:
    """The working point of two of pressure, contraction and force: numbers in SI units, or texts
    with a unit.

    If several solutions exist, it is the one reached from the state of rest. Warns of a point that
    is measured but not permitted, slack, or extrapolated. Raises SolveError, GeometryLimitError,
    UnitError, and RatingError for a point that is neither permitted nor measured.
    """
    unknown = [name for name in UNITS if name not in given]
    if len(unknown) != 1 or len(given) != 2:
        raise ParameterError(f"give two of {', '.join(UNITS)}, not {', '.join(given) or 'none'}.")
    values = {
        name: quantity(given[name], unit, where=name)
        for name, unit in UNITS.items()
        if name in given
    }
    law = entry.characteristic
    solved = unknown[0]
    if "pressure" in values:
        check_above_vacuum(values["pressure"])
    contraction = values.get("contraction")
    if contraction is not None and isinstance(law, ForceLaw):  # the other laws check it themselves
        _check_contraction(law, contraction)
    with silent_beyond_range():  # the warnings below name the range of the entry
        point = WorkingPoint(**values, **{solved: float(getattr(law, solved)(*values.values()))})
    if not math.isfinite(sum(point)) or (
        solved == "contraction" and not -0.5 <= point.contraction < 1.0
    ):
        raise SolveError(
            f"{type(law).__name__}: the solution {describe_point(point)} is not physical. Give"
            " values nearer to the validity range of the characteristic (airmuscle show)."
        )
    evaluation = Evaluation(entry, point, solved)
    for message in _warnings(evaluation):
        warnings.warn(message, AirmuscleWarning, stacklevel=2)
    return evaluation


def _check_contraction(law: ForceLaw, contraction: float) -> None:
    """Raise GeometryLimitError for a contraction outside the range of a law."""
    low, high = law.contraction_range
    if low <= contraction <= high:
        return
    as_percentage = contraction >= 1.0 and contraction / 100 <= high
    hint = f" For a percentage, write '{contraction:g} %'." if as_percentage else ""
    raise GeometryLimitError(
        f"contraction: {100 * contraction:.6g} % is outside the range of"
        f" {type(law).__name__}, {100 * low:.4g} to {100 * high:.4g} %.{hint}"
    )


def _warnings(evaluation: Evaluation) -> Iterator[str]:
    """That a point is measured but not permitted, slack, or extrapolated. Raises RatingError as
    `evaluate`.
    """
    point = evaluation.point
    ratings = evaluation.entry.ratings
    limits = evaluation.validity_range
    is_measured = limits is not None and limits.contains(point.pressure, point.contraction)
    if excesses := "; ".join(ratings.excesses(**point._asdict()) if ratings is not None else ()):
        if not is_measured:
            raise RatingError(
                f"the point exceeds the ratings of the maker and the measured range: {excesses}."
                " Choose a permitted point, or a larger muscle."
            )
        yield f"the point exceeds the ratings of the maker: {excesses}."
    if point.force < 0:
        yield "the force is negative; a muscle cannot push and is slack here."
    if limits is not None and not is_measured:
        low, high = limits.pressure
        contractions = map(contraction_text, limits.contraction)
        yield (
            "the operating point is outside the validity range of the characteristic,"
            f" {low / 1e3:.4g} to {high / 1e3:.4g} kPa and {' to '.join(contractions)}: the result"
            " is an extrapolation."
        )

"""Result of one isometric or isobaric record: threshold, slope, hysteresis and noise of its force.

Such a record is one line of the plane of pressure and contraction, by which no law of both is
determined; what it shows of the muscle needs no law.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core import Array
from ...recording.recording import Recording
from ...report.chapter import Chapter, NamedValue, Table, TableColumn
from ...report.shown import value_text
from ..inspection import CONTRACTION_BAND, RIPPLE_BAND, estimate_noise, motion_direction
from ..reported import Reported
from .bench_rows import MIN_FORCE, MIN_ROWS, BenchRows, limits

BINS = 8
MIN_BINS = 4
"""Intervals of the swept quantity in which the branches are compared, and the minimum number of
those with rows of both branches (chosen)."""


class _Swept(NamedTuple):
    """The swept quantity of a kind of record: its column, SI unit and displayed unit, and the name
    of the value at which the force vanishes.
    """

    column: str
    unit: str
    shown: str
    vanishing: str
    slope_unit: str
    """SI unit of the slope of the force; one over the contraction has that of the force."""


_SWEPT = {
    "isometric": _Swept("pressure", "Pa", "kPa", "threshold pressure", "N/Pa"),
    "isobaric": _Swept("contraction", "1", "%", "contraction without force", "N"),
}
MAX_LISTED = 6
"""Records of each kind in the brief view (chosen)."""


@dataclasses.dataclass(frozen=True, repr=False)
class LevelRecord(Reported):
    """What the force of an isometric or isobaric record shows without a law."""

    origin: str
    kind: str
    """'isometric' or 'isobaric'."""
    level: float
    """The contraction, or the pressure [Pa], that is held."""
    threshold: float
    """Pressure [Pa], or contraction, at which the line through the rows that pull gives no
    force.
    """
    is_reached: bool
    """Whether the record contains it; otherwise it is extrapolated."""
    slope: float
    """Slope of this line [N/Pa], or [N] per unit of contraction."""
    hysteresis: float | None
    """Median difference of the force [N] of the deflating and the inflating branch at equal
    pressure, or of the extending and the contracting one at equal contraction; None without both
    branches."""
    noise: float
    """Standard deviation of the noise of the force [N]."""

    def chapter(self) -> Chapter:
        """The description of the record: one quantity for each value."""
        constant = "contraction" if self.kind == "isometric" else "pressure"
        units = ("1", "%") if constant == "contraction" else ("Pa", "kPa")
        return Chapter(
            "level-record",
            f"{self.origin}, {self.kind}",
            "The line through the rows that pull, the distance of the branches, and the noise; a"
            " law needs records at three levels or more.",
            values=(NamedValue(constant, self.level, *units), *self.values()),
        )

    def values(self) -> tuple[NamedValue, ...]:
        """Threshold, slope, hysteresis and noise."""
        swept = _SWEPT[self.kind]
        remark = "" if self.is_reached else "extrapolated"
        values = [
            NamedValue(swept.vanishing, self.threshold, swept.unit, swept.shown, remark=remark),
            NamedValue("slope of the force", self.slope, swept.slope_unit, f"N/{swept.shown}"),
        ]
        if self.hysteresis is not None:
            values.append(NamedValue("distance of the branches", self.hysteresis, "N", digits=3))
        values.append(NamedValue("noise of the force", self.noise, "N", digits=3))
        return tuple(values)

    @property
    def summary(self) -> str:
        """The values in one phrase."""
        return ", ".join(f"{value.name} {value_text(value)}" for value in self.values())


def level_record(recording: Recording) -> LevelRecord | None:
    """The result of a record at one contraction or one pressure; None for any other record, and
    where the muscle pulls in too few rows or the force does not change.
    """
    if any(name not in recording for name in BenchRows._fields):
        return None
    complete = np.isfinite(sum(recording[name] for name in BenchRows._fields))
    recording = recording.rows(complete)
    rows = BenchRows(*(recording[name] for name in BenchRows._fields))
    if rows.force.size < MIN_ROWS or not rows.greatest > 0.0:
        return None
    held_length = np.ptp(rows.contraction) <= CONTRACTION_BAND
    held_pressure = np.ptp(rows.pressure) <= RIPPLE_BAND * float(np.max(np.abs(rows.pressure)))
    if held_length == held_pressure:
        return None
    kind = "isometric" if held_length else "isobaric"
    swept = recording[_SWEPT[kind].column]
    pulls = rows.force > MIN_FORCE * rows.greatest
    if np.count_nonzero(pulls) < MIN_ROWS or not np.ptp(swept[pulls]) > 0.0:
        return None
    slope, intercept = (
        np.polynomial.Polynomial.fit(swept[pulls], rows.force[pulls], 1).convert().coef[::-1]
    )
    if slope == 0.0:
        return None
    threshold = float(-intercept / slope)
    low, high = limits(swept)
    constant = rows.contraction if held_length else rows.pressure
    return LevelRecord(
        origin=recording.origin,
        kind=kind,
        level=float(np.median(constant)),
        threshold=threshold,
        is_reached=low <= threshold <= high,
        slope=float(slope),
        hysteresis=_branch_distance(recording, swept, rows.force),
        noise=estimate_noise(rows.force),
    )


def _branch_distance(recording: Recording, swept: Array, force: Array) -> float | None:
    """The median difference of the force [N] of the branch on which a swept quantity (N,) falls and
    that on which it rises, over intervals of this quantity.
    """
    direction = motion_direction(swept, recording.columns.get("time"))
    low, high = (float(value) for value in np.quantile(swept, [0.05, 0.95]))
    edges = np.linspace(low, high, BINS + 1)
    interval = np.searchsorted(edges, swept)
    slope = np.polynomial.Polynomial.fit(swept, force, 3)
    rest = force - slope(swept)
    differences = []
    for number in range(1, BINS + 1):
        falling, rising = (rest[(interval == number) & (direction == sign)] for sign in (-1, 1))
        if falling.size and rising.size:
            differences.append(float(np.mean(falling) - np.mean(rising)))
    return float(np.median(differences)) if len(differences) >= MIN_BINS else None


def level_tables(recordings: Sequence[Recording]) -> tuple[Table, ...]:
    """The tables of the isometric and of the isobaric records among recordings, each if there is
    one.
    """
    results = [result for result in map(level_record, recordings) if result is not None]
    tables = []
    for kind, swept in _SWEPT.items():
        records = [result for result in results if result.kind == kind]
        constant = _SWEPT["isobaric" if kind == "isometric" else "isometric"]
        columns: dict[str, Any] = {
            "record": [result.origin for result in records],
            constant.column: TableColumn(
                [result.level for result in records], constant.unit, constant.shown
            ),
            swept.vanishing: TableColumn(
                [result.threshold for result in records], swept.unit, swept.shown, short="threshold"
            ),
            "extrapolated": [not result.is_reached for result in records],
            "slope of the force": TableColumn(
                [result.slope for result in records],
                swept.slope_unit,
                f"N/{swept.shown}",
                short="slope",
            ),
            "distance of the branches": TableColumn(
                [result.hysteresis for result in records], "N", digits=3, short="branches"
            ),
            "noise of the force": TableColumn(
                [result.noise for result in records], "N", digits=3, short="noise"
            ),
        }
        title = f"Force of the {kind} records, without a law"
        if records:
            tables.append(Table(f"{kind}-records", title, columns, brief=MAX_LISTED))
    return tuple(tables)

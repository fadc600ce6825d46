"""Support of a law by measured rows: records of no pulling muscle, single points, and single lines
of the plane of pressure and contraction.

Every command asks before it fits, so that all of them refuse the same data for the same cause. A
reading that never changes, a wrong sign or unit, and a muscle that is slack or stretched everywhere
are of no use for any command. One or two points determine no law. Sound records of one line do not
compare laws, but have a result of their own (`level_record`).
"""

import dataclasses
import enum
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...core import Array, Hint, HintedText, IdentificationError, counted, level_text
from ...recording.columns import displayed
from ...recording.recording import Recording
from ...report.chapter import Chapter
from ..inspection import CONTRACTION_BAND, RIPPLE_BAND, rounding
from .bench_rows import MAX_ELONGATION, BenchRows, file_list, limits, recordings_with
from .contractions import MAX_STRETCH
from .level_records import LevelRecord, level_record
from .pressures import REVERSED

MIN_POINTS = 3
"""Number of different points from which rows show a curve (chosen)."""
MIN_PRESSURE = 10.0
MAX_PRESSURE = 1e8
MIN_FORCE = 1e-3
MAX_FORCE = 1e6
"""Limits of the highest pressure [Pa] and of the greatest force [N] of a muscle (chosen: below what
sensors resolve, and a hundredfold of what muscles on sale bear)."""
ROUNDED_PRESSURE = 1e-6
"""Pressure [Pa] up to which a simulated muscle is without pressure, by rounding (chosen)."""
COUPLED = 0.05
"""Root mean square distance of the rows from one curve in the plane of pressure and contraction, as
a fraction of the range, up to which both quantities move together (chosen)."""
CURVE_DEGREE = 3
"""Degree of this curve (chosen)."""
HELD_BANDS = {"pressure": RIPPLE_BAND, "contraction": CONTRACTION_BAND}
"""Range of a quantity that is held: of a pressure as a fraction of its maximum, of a
contraction."""


class DataUse(enum.IntEnum):
    """Uses of measured rows; what makes one impossible does so for those before it."""

    COMPARISON = 0
    """A comparison of laws, and a surface over pressure and contraction."""
    FIT = 1
    """A fit of any law."""
    PREDICTION = 2
    """A comparison with a known law: the rows are none of a pulling muscle."""


class Cause(NamedTuple):
    """A cause for which data do not support what is asked of them."""

    name: str
    """In one phrase, for tables."""
    reason: str
    """As a clause with the numbers of the data."""
    remedy: str
    """What to do, as a phrase in the imperative."""
    hint: Hint | None = None
    """The argument that does it."""
    prevents: DataUse = DataUse.PREDICTION
    """The last use that is not possible."""


@dataclasses.dataclass(frozen=True)
class Support:
    """What the rows of the recordings of a fit support."""

    origin: str
    """The files that are judged."""
    cause: Cause | None = None
    """The first cause for which something is not possible; None for rows over a region of pressures
    and contractions."""
    record: LevelRecord | None = None
    """What a single isometric or isobaric record shows without a law."""

    @property
    def reason(self) -> str:
        """The cause with the files; empty without one."""
        return "" if self.cause is None else f"{self.origin}: {self.cause.reason}"

    @property
    def refusal(self) -> HintedText:
        """The cause, what to do, and the result of a single record, as sentences; empty without a
        cause.
        """
        if self.cause is None:
            return HintedText("")
        remedy = self.cause.remedy
        hints = [] if self.cause.hint is None else [self.cause.hint]
        result = "" if self.record is None else f" The record gives: {self.record.summary}."
        return HintedText(f"{self.reason}. {remedy[:1].upper()}{remedy[1:]}.", *hints, result)

    def chapter_of_record(self) -> Chapter | None:
        """What a single isometric or isobaric record gives in place of a comparison of laws; None
        for other data.
        """
        if self.cause is None or self.record is None:
            return None
        remedy = self.cause.remedy
        problem = f"Laws cannot be compared. {self.reason}. {remedy[:1].upper()}{remedy[1:]}."
        return dataclasses.replace(self.record.chapter(), problems=(problem,))

    def check(self, use: DataUse) -> None:
        """Raise IdentificationError where the rows do not support this use."""
        if self.cause is not None and self.cause.prevents >= use:
            raise IdentificationError(self.refusal, cause=self.cause.name)


def support_of(recordings: Sequence[Recording]) -> Support:
    """Judge the rows of all recordings together; those without pressure, contraction or force are
    not judged.
    """
    complete = [run for run in recordings if all(name in run for name in BenchRows._fields)]
    measured = recordings_with(complete, *BenchRows._fields)
    if not measured:
        names = file_list([run.origin for run in complete])
        return Support(names, next(_empty_columns(complete), None))
    cause = next(_causes(_complete_rows(measured)), None)
    is_line = cause is not None and cause.prevents is DataUse.COMPARISON
    return Support(
        file_list([run.origin for run in measured]),
        cause,
        level_record(measured[0]) if is_line and len(measured) == 1 else None,
    )


def support_of_transients(recordings: Sequence[Recording], observed: Iterable[str]) -> Support:
    """Judge records of fills, discharges and motions, each alone, by their observed quantities.

    They need not cover pressures and contractions, and a few rows at rest may determine a load; but
    they must be those of a pulling muscle.
    """
    names = set(observed)
    for recording in recordings:
        cause = next(_transient_causes(recording, names), None)
        if cause is not None:
            return Support(recording.origin, cause)
    return Support(file_list([run.origin for run in recordings]))


def _transient_causes(recording: Recording, observed: set[str]) -> Iterator[Cause]:
    """All causes of one transient record, the most fundamental one first."""
    judged = [name for name in GREATEST if name in observed and name in recording]
    for name in judged:
        yield from _too_great(name, recording[name])
    if "pressure" in judged and np.nanmax(recording["pressure"], initial=0.0) > ROUNDED_PRESSURE:
        yield from _without_pressure(recording["pressure"])
    complete = recordings_with([recording], *BenchRows._fields)
    rows = _complete_rows(complete) if complete else None
    if "force" in judged:
        if rows is not None and np.max(np.abs(rows.force), initial=0.0) > MIN_FORCE:
            yield from _constant_forces(rows)  # a muscle without load may be slack throughout
        yield from _wrong_sign(recording["force"])
    if rows is not None:
        yield from _longer_than_at_rest(rows)


def _empty_columns(recordings: Sequence[Recording]) -> Iterator[Cause]:
    """The fault of columns without a value."""
    for run in recordings:
        for name in BenchRows._fields:
            if len(run) and np.isnan(run[name]).all():
                remedy = "record it, or correct its column"
                yield Cause(f"no row has a {name}", f"no row has a {name}", remedy)


def _complete_rows(recordings: Sequence[Recording]) -> BenchRows:
    """The rows with all three quantities, those at the limit of the sensor too."""
    columns = [np.concatenate([run[name] for run in recordings]) for name in BenchRows._fields]
    complete = np.isfinite(np.sum(columns, axis=0))
    return BenchRows(*(column[complete] for column in columns))


def _causes(rows: BenchRows) -> Iterator[Cause]:
    """All causes, the most fundamental one first."""
    if not rows.force.size:
        yield Cause(
            "no row is complete",
            "no row has a pressure, a contraction and a force",
            "record all three at the same times",
        )
        return
    yield from _impossible_values(rows)
    yield from _constant_forces(rows)
    yield from _without_tension(rows)
    yield from _longer_than_at_rest(rows)
    yield from _single_points(rows)
    yield from _single_lines(rows)


def _longer_than_at_rest(rows: BenchRows) -> Iterator[Cause]:
    """A muscle that would be stretched beyond what any bears."""
    low, high = limits(rows.contraction)
    if low < -MAX_STRETCH and -low > REVERSED * max(high, 0.0):
        yield Cause(
            "the muscle is longer than at rest",
            f"the muscle is longer than at rest, by up to {-100 * low:.3g} %, which none bears",
            "check the resting length; if the column is a strain (L - L0)/L0, multiply it by -1",
        )


def _single_points(rows: BenchRows) -> Iterator[Cause]:
    """Too few points of pressure and contraction."""
    count = rows.force.size
    points = _points(rows)
    is_at_one_length = _is_held("contraction", rows.contraction)
    if count >= MIN_POINTS and _are_equal(rows):
        yield Cause(
            "all rows are equal",
            f"all {count} rows are equal, {_point(rows)}: they are one point, which determines no"
            " law",
            "check that each row is a new reading, and change the pressure or the length",
            prevents=DataUse.FIT,
        )
    elif count >= MIN_POINTS and _is_held("pressure", rows.pressure) and is_at_one_length:
        yield Cause(
            "pressure and contraction do not change",
            f"the pressure is {_level(rows, 'pressure')} and the contraction"
            f" {_level(rows, 'contraction')} in every row, so that the force is known at one point"
            " alone",
            "change the pressure or the length",
            prevents=DataUse.FIT,
        )
    elif points < MIN_POINTS:
        yield Cause(
            f"there {'is' if points == 1 else 'are'} {counted(points, 'point')}",
            f"{counted(count, 'row')} with {counted(points, 'point')} of pressure and contraction"
            " cannot show how the force depends on them",
            "measure runs over the whole range",
            prevents=DataUse.FIT,
        )


def _point(rows: BenchRows) -> str:
    texts = (displayed(name, float(getattr(rows, name)[0])) for name in rows._fields)
    return ", ".join(f"{name} {text}" for name, text in zip(rows._fields, texts, strict=True))


def _is_constant(name: str, values: Array) -> bool:
    return bool(np.ptp(values) <= rounding(name, values))


def _are_equal(rows: BenchRows) -> bool:
    return all(_is_constant(name, getattr(rows, name)) for name in rows._fields)


def _is_held(name: str, values: Array) -> bool:
    """Whether a pressure or a contraction stays at one level."""
    scale = float(np.max(np.abs(values))) if name == "pressure" else 1.0
    return bool(np.ptp(values) <= HELD_BANDS[name] * scale)


GREATEST = {"pressure": MAX_PRESSURE, "force": MAX_FORCE}


def _too_great(name: str, values: Array) -> Iterator[Cause]:
    """A pressure or a force that no muscle bears."""
    unit = "Pa" if name == "pressure" else "N"
    size = float(np.nanmax(np.abs(values), initial=0.0))
    if size > GREATEST[name]:
        yield Cause(
            f"the unit of the {name} is wrong",
            f"the {name} is up to {size:.3g} {unit}, above {GREATEST[name]:g} {unit}, which no"
            " muscle bears: its unit is wrong",
            f"correct the unit of the {name}",
            _state_unit(name),
        )


def _without_pressure(pressure: Array) -> Iterator[Cause]:
    """A pressure by which no muscle pulls."""
    highest = float(np.nanmax(pressure, initial=0.0))
    if highest < MIN_PRESSURE:
        yield Cause(
            "there is no pressure",
            f"the pressure is at most {highest:.3g} Pa, without which no muscle pulls",
            "measure under pressure, or correct the unit of the pressure",
            _state_unit("pressure"),
        )


def _impossible_values(rows: BenchRows) -> Iterator[Cause]:
    """Values whose unit must be wrong, or that are those of a rig at rest."""
    yield from _too_great("pressure", rows.pressure)
    yield from _too_great("force", rows.force)
    highest = float(np.max(rows.pressure))
    if not float(np.min(rows.contraction)) < -MAX_ELONGATION:  # a stretched muscle pulls without
        yield from _without_pressure(rows.pressure)
    if float(np.max(np.abs(rows.force))) < MIN_FORCE:
        least = displayed("contraction", float(np.min(rows.contraction)))
        yield Cause(
            "the muscle is slack in every row",
            f"the force is less than {MIN_FORCE:g} N in every row: the muscle is slack, or the load"
            f" cell is not connected. The pressure is at most {displayed('pressure', highest)}, the"
            f" contraction at least {least}",
            "measure where the muscle pulls, at a higher pressure or a greater length, or correct"
            " the unit of the force",
            _state_unit("force"),
        )


def _state_unit(name: str) -> Hint:
    return Hint("To state the unit", "units", {name: ...}, "ColumnMapping")


def _constant_forces(rows: BenchRows) -> Iterator[Cause]:
    """A reading of the force that never changes; a load that a muscle carries along one curve is
    none.
    """
    is_reading = rows.force.size >= MIN_POINTS and _is_constant("force", rows.force)
    if not is_reading or _are_equal(rows):
        return
    reading = float(np.median(rows.force))
    is_carried = reading > 0.0 and is_coupled(rows.pressure, rows.contraction)
    if not is_carried:
        yield Cause(
            "the force does not change",
            f"the force is {reading:.4g} N in every row, which no muscle gives: the load cell is at"
            " its limit or not connected",
            "check the sensor and its cable",
        )


def _wrong_sign(force: Array) -> Iterator[Cause]:
    """Tension that is counted negative."""
    low, high = limits(force)
    if low < 0.0 and -low > REVERSED * max(high, 0.0):
        yield Cause(
            "the sign of the force is wrong",
            f"the force is negative, down to {low:.4g} N, but tension is positive: the sign of the"
            " force is wrong",
            "multiply its column by -1",
        )


def _without_tension(rows: BenchRows) -> Iterator[Cause]:
    """A muscle that does not pull, or whose tension is counted negative."""
    yield from _wrong_sign(rows.force)
    if float(np.max(rows.force)) <= 0.0:
        yield Cause(
            "the muscle is slack in every row",
            "no row has a positive force: the muscle is slack in every row",
            "measure where the muscle pulls, at a higher pressure or a greater length",
        )


def _single_lines(rows: BenchRows) -> Iterator[Cause]:
    """Sound rows along one line of the plane of pressure and contraction."""
    if _is_held("contraction", rows.contraction):
        yield Cause(
            "there is one contraction",
            f"the contraction is {_level(rows, 'contraction')} in every row, so that the"
            " data do not show how the force depends on it",
            "measure the same at two further lengths or more",
            prevents=DataUse.COMPARISON,
        )
    elif _is_held("pressure", rows.pressure):
        yield Cause(
            "there is one pressure",
            f"the pressure is {_level(rows, 'pressure')} in every row, so that the data do"
            " not show how the force depends on it",
            "measure the same at two further pressures or more",
            prevents=DataUse.COMPARISON,
        )
    elif is_coupled(rows.pressure, rows.contraction):
        load = (
            f", at a constant force of {displayed('force', float(np.median(rows.force)))}"
            if np.ptp(rows.force) <= RIPPLE_BAND * float(np.max(np.abs(rows.force)))
            else ""
        )
        yield Cause(
            "pressure and contraction move together",
            f"pressure and contraction move together in every row{load}, so that the effect of one"
            " on the force cannot be told from that of the other",
            "hold one of them at three levels or more while the other changes",
            prevents=DataUse.COMPARISON,
        )


def _level(rows: BenchRows, name: str) -> str:
    """The level of a quantity that is held, as text."""
    values = getattr(rows, name)
    return level_text(name, float(np.median(values)), float(np.max(np.abs(values))))


def _points(rows: BenchRows) -> int:
    """The number of different points of pressure and contraction, counted up to `MIN_POINTS`."""
    counts = np.stack(
        [
            _numbered("pressure", rows.pressure),
            _numbered("contraction", rows.contraction),
        ]
    )
    if counts.max() + 1 >= MIN_POINTS:
        return MIN_POINTS
    return int(np.unique(counts, axis=1).shape[1])


def _numbered(name: str, values: Array) -> Array:
    """The number (N,) of the value of each row in increasing order, within rounding."""
    order = np.argsort(values)
    steps = np.diff(values[order], prepend=values[order[0]]) > rounding(name, values)
    numbers = np.zeros(values.size, dtype=int)
    numbers[order] = np.cumsum(steps)
    return numbers


def is_coupled(pressure: Array, contraction: Array) -> bool:
    """Whether all points (N,) lie on one curve of the plane of pressure [Pa] and contraction, along
    which both change.
    """
    if _is_held("pressure", pressure) or _is_held("contraction", contraction):
        return False
    first, second = (_scaled(values) for values in (pressure, contraction))
    return min(_distance(first, second), _distance(second, first)) < COUPLED


def _scaled(values: Array) -> Array:
    return np.asarray((values - np.min(values)) / np.ptp(values))


def _distance(abscissa: Array, ordinate: Array) -> float:
    """Root mean square distance of points from a polynomial, of the degree that their abscissas
    determine with one point more.
    """
    distinct = np.unique(np.round(abscissa, 2)).size
    degree = max(min(CURVE_DEGREE, distinct - 2), 1)
    curve = np.polynomial.Chebyshev.fit(abscissa, ordinate, degree)(abscissa)
    return float(np.sqrt(np.mean((ordinate - curve) ** 2)))

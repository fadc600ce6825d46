"""Records of a campaign and their kinds, static points, slow runs, fills, creep and release; check
that they are of one rig."""

import dataclasses
import enum
import itertools
from collections.abc import Mapping, Sequence

import numpy as np

from ...core import Array, IdentificationError, ShortRepr
from ...recording import Recording, resting_length_of
from ..diagnosis import match_rows
from ..hysteresis import describe_run, rows_of
from ..inspection import (
    AT_REST,
    CONTRACTION_BAND,
    ISOBARIC,
    ISOMETRIC,
    ISOTONIC,
    RELATIVE_BAND,
    Inspection,
    Interval,
    Mask,
    Run,
    Sensor,
    estimate_sensors,
    inspect,
    inspect_all,
    quasi_static_rows,
    true_intervals,
)
from .transient import MAX_RELEASE, MIN_STEP, PressureStep, find_motion, find_pressure_steps

MIN_HOLD = 10.0
MIN_HOLD_RATIO = 10.0
"""Minimum duration of a hold [s], and its minimum ratio to the duration of the motion before it
(chosen).
"""
MIN_RUN_ROWS = 100
MIN_ROWS = 8
"""Minimum number of rows of a run that is a record of its own, and of any record (chosen)."""
MIN_SLOW = 0.5
"""Minimum fraction of slow rows of a record that is used for static fits (chosen)."""
LEVEL_SHARE = 0.05
"""Distance of the end of a step from the highest or the lowest pressure, as a fraction of their
difference, within which it leads to the supply or to ambient pressure (chosen)."""
MAX_CHANGE = 0.04
"""Maximum change of pressure and length in a slow row within 0.1 s, as a fraction of their range
(chosen). It exceeds that of a quasi-static row, because the friction along the motion is taken into
account."""


class RecordKind(enum.Enum):
    """Kind of a record of a campaign."""

    ISOBARIC = "isobaric"
    ISOMETRIC = "isometric"
    ISOTONIC = "isotonic"
    STATIC = "static"
    FILL = "fill"
    RELEASE = "release"
    CREEP = "creep"
    UNUSED = "unused"

    @property
    def is_static(self) -> bool:
        """Whether the rows are used for the static characteristic."""
        return self is RecordKind.STATIC or self in _KINDS.values()


_KINDS = {
    ISOBARIC: RecordKind.ISOBARIC,
    ISOMETRIC: RecordKind.ISOMETRIC,
    ISOTONIC: RecordKind.ISOTONIC,
}


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class CampaignRecord(ShortRepr):
    """A recording of a campaign, its kind, and the reason of this kind as a phrase."""

    recording: Recording
    kind: RecordKind
    reason: str
    inspection: Inspection
    steps: tuple[PressureStep, ...] = ()
    """The steps of the pressure of a fill."""

    @property
    def origin(self) -> str:
        """Name of the file."""
        return self.recording.origin

    @property
    def resting_length(self) -> float | None:
        """Resting length [m], None if it is not stated."""
        return resting_length_of(self.recording)

    @property
    def level(self) -> tuple[str, float] | None:
        """The constant quantity and its value [SI]; None if no quantity is constant."""
        run = _longest(self.inspection.runs)
        column, value = (None, None) if run is None else (run.constant_column, run.constant_value)
        return None if column is None or value is None else (column, value)


def classify_records(recordings: Sequence[Recording]) -> tuple[CampaignRecord, ...]:
    """The records of a campaign with their kinds, one for each long run of a recording with several
    levels of one quantity; the sensors are estimated from all recordings of the rig together."""
    sensors = estimate_sensors(recordings) if recordings else {}
    records = []
    for record in map(_classify, inspect_all(recordings)):
        recording = record.recording
        runs = record.inspection.runs
        long = [run for run in runs if len(run.interval) >= MIN_RUN_ROWS and run.constant_column]
        if record.kind.is_static and "time" in recording and len(long) > 1:
            records += [
                _classify(inspect(rows_of(recording, run.interval), sensors)) for run in long
            ]
        else:
            records += _cut_at_levels(record, sensors)
    return tuple(records)


def static_levels(record: CampaignRecord) -> list[CampaignRecord]:
    """The rows of each pressure of a record of static points; any other record as it is."""
    points = record.inspection.static_points
    if points is None:
        return [record]
    parts = [
        record.recording.rows(points.pressure_level == k)
        for k in range(int(points.pressure_level.max()) + 1)
    ]
    return [dataclasses.replace(record, recording=part, inspection=inspect(part)) for part in parts]


def _cut_at_levels(record: CampaignRecord, sensors: Mapping[str, Sensor]) -> list[CampaignRecord]:
    """The steps of a held muscle to the supply and to ambient pressure, if it has more levels, and
    its other rows.
    """
    recording = record.recording
    levels = list[tuple[float, int, int]]()
    usable = len(recording) >= MIN_ROWS and all(
        name in recording for name in ("time", "pressure", "contraction")
    )
    if record.kind.is_static or not usable or not np.isfinite(recording["pressure"]).all():
        return [record]
    if _span(recording["contraction"]) > CONTRACTION_BAND:
        return [record]
    for interval in true_intervals(quasi_static_rows(recording, sensors)):
        value = float(np.median(recording["pressure"][interval.rows]))
        if levels and abs(value - levels[-1][0]) <= MIN_STEP:
            levels[-1] = (*levels[-1][:2], interval.stop)
        elif len(interval) >= MIN_ROWS:
            levels.append((value, interval.start, interval.stop))
    if len(levels) < 3 or len(levels) <= len(record.steps) + 1:
        return [record]
    low = min(levels)[0]
    high = max(levels)[0]
    margin = LEVEL_SHARE * (high - low)
    parts = []
    for (_, begin, end), (value, _, stop) in itertools.pairwise(levels):
        start = max(
            begin, end - max(MIN_ROWS, (end - begin) // 4)
        )  # without the end of the step before
        if min(abs(value - low), abs(value - high)) <= margin:
            part = _classify(inspect(rows_of(recording, Interval(start, stop)), sensors))
            parts += [part] if part.kind is RecordKind.FILL else []
    count = len(levels) - 1
    reason = (
        f"{count - len(parts)} of {count} pressure steps at a held length end between the lowest"
        " and the highest pressure, or are no fill through an open valve; with a measured force"
        " they would be static points"
    )
    return [*parts, dataclasses.replace(record, kind=RecordKind.UNUSED, reason=reason, steps=())]


def _classify(inspection: Inspection) -> CampaignRecord:
    recording = inspection.recording
    if unusable := _unusable(recording):
        return CampaignRecord(recording, RecordKind.UNUSED, unusable, inspection)
    if inspection.static_points is not None and "force" in recording:
        return CampaignRecord(
            recording, RecordKind.STATIC, inspection.static_points.description, inspection
        )
    if not np.isfinite(recording["contraction"]).all():  # friction acts along it
        return CampaignRecord(
            recording, RecordKind.UNUSED, "values of the contraction are missing", inspection
        )
    if "time" in recording:
        steps = find_pressure_steps(recording, inspection.sensors)
        if steps and _span(recording["contraction"]) <= CONTRACTION_BAND:
            step = steps[0]
            reason = (
                f"pressure step of {step.change / 1e3:.4g} kPa within {step.duration:.3g} s at a"
                " held length"
            )
            return CampaignRecord(recording, RecordKind.FILL, reason, inspection, steps)
        motion = find_motion(recording)
        has_length = isinstance(recording.constants.get("resting_length"), float | int)
        if (
            has_length and motion is not None and abs(motion.travel) > 0.5 * motion.range
        ):  # moved once, and not back
            if not np.isfinite(recording["time"]).all():
                return CampaignRecord(
                    recording, RecordKind.UNUSED, "values of the time are missing", inspection
                )
            rest = float(recording["time"][-1]) - motion.end
            pressure = recording["pressure"]
            is_constant = _span(pressure) <= RELATIVE_BAND * max(
                float(np.max(np.abs(pressure))), 1.0
            )
            if is_constant and rest >= max(MIN_HOLD, MIN_HOLD_RATIO * motion.duration):
                reason = (
                    f"motion within {motion.duration:.3g} s, then held for {rest:.4g} s at constant"
                    " pressure"
                )
                return CampaignRecord(recording, RecordKind.CREEP, reason, inspection)
            if motion.duration < MAX_RELEASE:
                reason = (
                    f"motion of {1e3 * abs(motion.travel):.3g} mm within {motion.duration:.3g} s"
                )
                return CampaignRecord(recording, RecordKind.RELEASE, reason, inspection)
    return _classify_static(inspection)


def _classify_static(inspection: Inspection) -> CampaignRecord:
    recording = inspection.recording
    run = _longest(inspection.runs)
    if run is None or run.kind is AT_REST or "force" not in recording:
        reason = "no measured force" if "force" not in recording else "no quantity varies"
        return CampaignRecord(recording, RecordKind.UNUSED, reason, inspection)
    slow = float(slow_rows(recording, inspection).mean())
    if slow < MIN_SLOW:
        neither = "the record is neither a fill at a held length nor a release"
        reason = f"only {100 * slow:.3g} % of the rows are slow, and {neither}"
        return CampaignRecord(recording, RecordKind.UNUSED, reason, inspection)
    kind = _KINDS.get(run.kind, RecordKind.STATIC)
    count = "" if len(inspection.runs) == 1 else f"{len(inspection.runs)} runs, the longest "
    reason = (
        f"{count}{describe_run(run)}"
        if kind is not RecordKind.STATIC
        else "slow, with no constant quantity"
    )
    return CampaignRecord(recording, kind, reason, inspection)


def slow_rows(recording: Recording, inspection: Inspection) -> Mask:
    """Mask of the rows in which pressure and length change by less than `MAX_CHANGE`, shape
    (N,).
    """
    return quasi_static_rows(recording, inspection.sensors, max_change=MAX_CHANGE)


def _unusable(recording: Recording) -> str:
    """The reason why a recording cannot be used; empty if it can be."""
    if "pressure" not in recording:
        return "no pressure column"
    if "contraction" not in recording and "force" not in recording:
        needed = (
            "the held length and the resting length, in the file or as constants length and"
            " resting_length"
        )
        return f"only the pressure is recorded; a fill also needs {needed}"
    if "contraction" not in recording:
        return "the contraction is not known: a length column and the resting length are needed"
    if len(recording) < MIN_ROWS:
        return f"{len(recording)} rows; at least {MIN_ROWS} are needed"
    return "" if np.isfinite(recording["pressure"]).all() else "values of the pressure are missing"


def _longest(runs: Sequence[Run]) -> Run | None:
    return max(runs, key=lambda run: len(run.interval), default=None)


def _span(values: Array) -> float:
    """The range of the values without the extreme rows."""
    return float(np.ptp(np.quantile(values, [0.01, 0.99])))


MAX_RATIO = 1.5
MAX_SCALE = 10.0
"""Maximum ratio of the forces of two records at the same pressure, contraction and length, and of
the maximum forces by pressure of two isobaric records of one length (chosen)."""
OWN_FOLDER = "Give the files of one muscle and one rig in a folder of their own"


def check_one_rig(records: Sequence[CampaignRecord]) -> None:
    """Raise IdentificationError where records of one length are of different specimens, or
    contradict each other.
    """
    by_length: dict[float, list[CampaignRecord]] = {}
    for record in records:
        if record.kind is not RecordKind.UNUSED and record.resting_length is not None:
            by_length.setdefault(round(record.resting_length, 6), []).append(record)
    for length, of_length in by_length.items():
        specimens = {
            str(r.recording.constants["specimen"])
            for r in of_length
            if "specimen" in r.recording.constants
        }
        if len(specimens) > 1:
            names = ", ".join(sorted(specimens))
            raise IdentificationError(
                f"the records of {1e3 * length:.4g} mm are of several specimens: {names}."
                f" {OWN_FOLDER}."
            )
        isobaric = [record for record in of_length if record.kind is RecordKind.ISOBARIC]
        _check_scale(isobaric)
        _check_forces([record.recording for record in isobaric])


def _check_scale(records: Sequence[CampaignRecord]) -> None:
    """Raise IdentificationError where the force by pressure differs by a factor that only a unit
    explains.
    """
    levels = [(record.recording, record.level[1]) for record in records if record.level is not None]
    scales = [
        (float(np.max(recording["force"])) / level, recording)
        for recording, level in levels
        if level > 0
    ]
    positive = sorted((pair for pair in scales if pair[0] > 0), key=lambda pair: pair[0])
    if positive and positive[-1][0] > MAX_SCALE * positive[0][0]:
        low, first = positive[0]
        high, last = positive[-1]
        raise IdentificationError(
            f"the force by pressure of {_with_units(last)} is {high / low:.3g} times that of"
            f" {_with_units(first)}, at the same length: a unit is wrong, or the files are of"
            f" different muscles. {OWN_FOLDER}, or correct the units."
        )


def _with_units(recording: Recording) -> str:
    units = [
        f"{name} in {recording.units[name]}"
        for name in ("pressure", "force")
        if name in recording.units
    ]
    return f"{recording.origin} ({', '.join(units)})"


def _check_forces(recordings: Sequence[Recording]) -> None:
    """Raise IdentificationError where forces at equal pressure and contraction differ by a
    factor.
    """
    for match in match_rows(recordings).runs:
        names = [block.recording.origin for block in (match.first, match.second)]
        first, second = (float(np.mean(force)) for force in match.forces)
        if max(first, second) > MAX_RATIO * min(first, second):
            pressure = float(np.median(match.first.recording["pressure"][match.first.rows]))
            raise IdentificationError(
                f"{' and '.join(names)} contradict each other: at {pressure / 1e3:.3g} kPa and the"
                f" same contractions their forces are {first:.4g} and {second:.4g} N. They are of"
                f" different muscles or rigs, or a unit is wrong. {OWN_FOLDER}, or correct the"
                " units."
            )

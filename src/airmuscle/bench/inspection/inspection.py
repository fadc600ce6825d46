"""Inspection of a recording before any fit: sampling, sensors, runs, branches, plateaus, and
data-quality findings.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ...core import counted
from ...core.errors import ColumnError, Hint, HintedText
from ...recording.columns import ZERO_NOT_STATED, quantity_of
from ...recording.recording import Recording
from ..readers import UNIFORM, WITHOUT_TIME
from .branches import branch_column_agreement, find_branches
from .inspection_result import Finding, Inspection
from .interval import find_static_points
from .outliers import find_outliers
from .plateaus import find_plateaus, quasi_static_rows
from .resolution import rounding
from .runs import AT_REST, FREE, KINDS, Run, find_runs, moved_column
from .sensor import Sampling, Sensor, analyse_sampling, estimate_sensors

MAX_SATURATED_FRACTION = 0.5
"""Fraction of saturated rows above which too few rows remain for a fit (chosen)."""
MAX_FINAL_CHANGE = 0.02
"""A record is too short if its last tenth changes by more than this fraction of the range
(chosen).
"""
RAMP_TOLERANCE = 0.1
"""Relative difference of the rate at the end from the usual one up to which the pressure is swept
(chosen).
"""
NOISE_FACTOR = 10.0
"""A pressure with a range below this multiple of the sensor's standard deviation is constant
(chosen).
"""
MIN_ROWS_PER_STEP = 5
"""A step sampled by fewer rows than this is undersampled (chosen)."""


def inspect(recording: Recording, shared_sensors: Mapping[str, Sensor] | None = None) -> Inspection:
    """Inspect a recording. `shared_sensors`, estimated from several recordings of the test rig,
    take precedence.
    """
    shared = {
        name: sensor for name, sensor in (shared_sensors or {}).items() if name in recording.columns
    }
    sensors = {**estimate_sensors(recording), **shared}
    sampling = analyse_sampling(recording)
    runs = find_runs(recording, sensors)
    ordered = sampling is None or not (sampling.repeated_rows or sampling.backward_rows)
    points = find_static_points(recording)
    branches = () if points else find_branches(recording, sensors.get("pressure"), runs=runs)
    findings = [
        *_time_findings(recording, sampling),
        *_sensor_findings(recording, sensors),
        *_run_findings(recording, runs),
        *_motion_findings(recording),
        *_duration_findings(recording, sampling, sensors),
    ]
    return Inspection(
        recording,
        sampling,
        sensors,
        runs,
        branches,
        find_plateaus(recording, sensors) if ordered else (),
        find_outliers(recording, sensors),
        float(quasi_static_rows(recording, sensors).mean()) if len(recording) else 0.0,
        branch_column_agreement(recording, branches) if branches else None,
        tuple(sorted(findings, key=lambda finding: not finding.serious)),
        points,
    )


def inspect_all(recordings: Sequence[Recording]) -> tuple[Inspection, ...]:
    """Inspect recordings from one test rig, whose sensors are estimated jointly."""
    sensors = estimate_sensors(recordings)
    return tuple(inspect(recording, sensors) for recording in recordings)


def check_contents(recordings: Sequence[Recording]) -> None:
    """Raise ColumnError where a recording contradicts its file, or where a single recording
    contains no variation. What the rows of pressure, contraction and force support is judged by
    what uses them (`support_of`).
    """
    sensors = estimate_sensors(recordings) if recordings else {}
    for recording in recordings:
        runs = find_runs(
            recording, {name: s for name, s in sensors.items() if name in recording.columns}
        )
        is_at_rest = any(run.kind == AT_REST for run in runs)
        is_judged = all(name in recording for name in ("pressure", "contraction", "force"))
        if not is_at_rest or (len(recordings) == 1 and not is_judged):
            check_swept(recording, runs)


def check_swept(recording: Recording, runs: tuple[Run, ...]) -> None:
    """Raise ColumnError if no quantity of a recording varies, or if the run is not of the stated
    kind.
    """
    for finding in _run_findings(recording, runs):
        if finding.serious:
            raise ColumnError(f"{recording.origin}: {finding.text}")


def _time_findings(recording: Recording, sampling: Sampling | None) -> Iterator[Finding]:
    points = find_static_points(recording)
    if points is not None:
        slack = int(np.count_nonzero(recording["force"] <= 0)) if "force" in recording else 0
        at_zero = f", {slack} of them without tension" if slack else ""
        yield Finding(
            f"no time column: {points.description}{at_zero}. The order of the rows has no meaning,"
            " so that noise, saturation, branches and outliers are not assessed."
        )
        return
    if sampling is None:
        yield Finding(
            "no time column: rows are taken as steady states; sampling and outliers cannot be"
            " assessed."
        )
        return
    for rows, verb in ((sampling.repeated_rows, "repeats"), (sampling.backward_rows, "decreases")):
        if rows:
            hints = (UNIFORM, WITHOUT_TIME) if sampling.rounded else (WITHOUT_TIME,)
            text = (
                f"time {verb} in {counted(len(rows), 'row')}, first in row {rows[0] + 1}. Sort the"
                " rows, delete "
            )
            yield Finding(
                HintedText(f"{text}duplicates, or write two runs to two files.", *hints),
                serious=True,
            )
    if sampling.gaps:
        longest = max(sampling.gaps, key=lambda gap: gap.duration)
        yield Finding(
            f"{counted(len(sampling.gaps), 'gap')} in time, the longest of {longest.duration:.4g} s"
            f" after row {longest.row + 1} (sample time {sampling.sample_time:.4g} s). Do not fit"
            " dynamics across gaps."
        )


def _sensor_findings(recording: Recording, sensors: Mapping[str, Sensor]) -> Iterator[Finding]:
    for name, sensor in sensors.items():
        for limit, adjective in ((sensor.lower_limit, "lower"), (sensor.upper_limit, "upper")):
            if name not in recording.columns or not len(recording) or not np.isfinite(limit):
                continue
            side = 1.0 if adjective == "lower" else -1.0
            count = int(np.count_nonzero(sensor.censoring(recording[name]) == side))
            fraction = count / len(recording)
            quantity = quantity_of(name)
            unit = f" {quantity.unit}" if quantity and quantity.unit != "1" else ""
            if count:
                yield Finding(
                    f"the {name} sensor saturates at its {adjective} limit, {limit:.4g}{unit}, in"
                    f" {counted(count, 'row')} ({100 * fraction:.0f} %). These rows are bounds"
                    " (censored), not values.",
                    serious=fraction >= MAX_SATURATED_FRACTION,
                )


def _run_findings(recording: Recording, runs: tuple[Run, ...]) -> Iterator[Finding]:
    stated = recording.constants.get("run")
    if any(run.kind == AT_REST for run in runs):
        subject = (
            "no measured quantity varies"
            if len(recording.columns) > 2
            else "the only quantity does not vary"
        )
        yield Finding(
            f"{subject}{_pressure_range(recording)}: no characteristic can be identified. Vary the"
            " pressure of an isometric run or the length of an isobaric run, and check that the"
            " sensors were connected.",
            serious=True,
        )
    elif isinstance(stated, str) and runs:
        kinds = {run.kind.name for run in runs}
        open_kind = moved_column(recording) is None and kinds == {FREE.name}
        if stated not in kinds and stated in {kind.name for kind in KINDS} and not open_kind:
            yield Finding(
                f"the run is stated to be {stated}, but the data are {' and '.join(sorted(kinds))}"
                f"{_pressure_range(recording)}. Correct the statement, or use another file.",
                serious=True,
            )


def _motion_findings(recording: Recording) -> Iterator[Finding]:
    """A recording of pressure and force without a length: the kind of the run and the contraction
    remain open.
    """
    moved = moved_column(recording)
    if "pressure" not in recording or "force" not in recording:
        return
    if moved is None:
        example = {"length": "73.2 mm"}
        text = (
            "no length or contraction was recorded, so the kind of the run is open and no"
            " characteristic can be "
        )
        hints = (
            Hint(
                "To state the held length of an isometric run",
                "constants",
                example,
                "ColumnMapping",
            ),
            Hint(
                "To state its place in the names of the files",
                "file_name",
                "held{length [mm]}",
                "ColumnMapping",
            ),
        )
        yield Finding(HintedText(f"{text}identified.", *hints))
    elif "contraction" not in recording:
        converted = Hint(f"To convert the {moved}", "resting_length", "300 mm", "ColumnMapping")
        remedy = (" ", ZERO_NOT_STATED) if moved == "position" else (converted,)
        yield Finding(
            HintedText(
                "a static fit needs the contraction and will refuse this recording.", *remedy
            )
        )


def _pressure_range(recording: Recording) -> str:
    """The pressure range as ` (pressure 298.8 to 301.2 kPa)`, to show which pressure was taken as
    constant.
    """
    if "pressure" not in recording or not np.isfinite(recording["pressure"]).any():
        return ""
    low, high = np.nanquantile(recording["pressure"], [0.01, 0.99])
    return f" (pressure {low / 1e3:.4g} to {high / 1e3:.4g} kPa)"


def _duration_findings(
    recording: Recording, sampling: Sampling | None, sensors: Mapping[str, Sensor]
) -> Iterator[Finding]:
    """Records that end before the pressure has settled, and steps faster than the sampling."""
    if sampling is None or "pressure" not in recording or sampling.rows < 2 * MIN_ROWS_PER_STEP:
        return
    pressure = recording["pressure"]
    span = float(np.ptp(pressure))
    noise = NOISE_FACTOR * (sensors["pressure"].std if "pressure" in sensors else 0.0)
    if span <= max(noise, rounding("pressure", pressure)):
        return
    last = pressure[-max(len(pressure) // 10, 3) :]
    quasi_static = quasi_static_rows(recording, sensors)
    if span > 0 and not quasi_static[-1] and abs(last[-1] - last[0]) > MAX_FINAL_CHANGE * span:
        changes = np.abs(np.diff(pressure[:: -len(last)]))
        usual = np.median(changes)
        yield Finding(
            "the record ends before the pressure has settled (it changes by"
            f" {abs(last[-1] - last[0]) / 1e3:.4g} kPa in the last tenth) and may be shorter than"
            " the dynamics. Record until the pressure has settled.",
            serious=not abs(changes[0] - usual)
            <= RAMP_TOLERANCE * usual,  # in a sweep, it changes as it usually does
        )
    max_step = float(np.max(np.abs(np.diff(pressure)))) if len(pressure) > 1 else 0.0
    if max_step > 0.5 * span > 0 and sampling.sample_time:
        yield Finding(
            f"the pressure changes by {max_step / 1e3:.4g} kPa between two rows, more than half of"
            f" its range: the step is undersampled at {sampling.rate:.4g} rows per second."
        )

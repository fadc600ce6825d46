"""What is wrong, or may be, with a recording, each in words that say what to do."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping

import numpy as np

from ...core.errors import ColumnError
from ..columns import quantity_of
from ..recording import Recording
from .quasi_static import quasi_static_rows
from .runs import AT_REST, KINDS, Run
from .sampling import Sampling
from .sensor import Sensor

MAX_SATURATED_FRACTION = 0.5
"""The part of the rows at an end of a sensor from which on a fit would have little left (chosen)."""
MAX_FINAL_CHANGE = 0.02
"""A record is short where its last tenth still changes by this part of the range (chosen)."""
NOISE_FACTOR = 10.0
"""A pressure whose range is less than this many deviations of its sensor is constant (chosen)."""
MIN_ROWS_PER_STEP = 5
"""A step seen in fewer rows than this is too fast for its sampling (chosen)."""


@dataclasses.dataclass(frozen=True)
class Finding:
    """Something to know. `serious` means that a fit of this recording would mislead or fail."""

    text: str
    serious: bool = False


def collect_findings(
    recording: Recording, timing: Sampling | None, sensed: Mapping[str, Sensor], found: tuple[Run, ...]
) -> tuple[Finding, ...]:
    """All that stands out in a recording, the serious first."""
    everything = [
        *_time_findings(recording, timing),
        *_sensor_findings(recording, sensed),
        *_run_findings(recording, found),
        *_duration_findings(recording, timing, sensed),
    ]
    return tuple(sorted(everything, key=lambda finding: not finding.serious))


def check_swept(recording: Recording, found: tuple[Run, ...]) -> None:
    """Raise ColumnError where nothing in a recording is swept, or it is not the run that it is said to be."""
    for finding in _run_findings(recording, found):
        if finding.serious:
            raise ColumnError(f"{recording.origin}: {finding.text}")


def _time_findings(recording: Recording, timing: Sampling | None) -> Iterator[Finding]:
    if timing is None:
        yield Finding(
            "there is no time: rows are taken as settled points, and neither rate nor glitches can be judged."
        )
        return
    for rows, said in ((timing.repeats, "repeats"), (timing.backward, "runs backwards")):
        if rows:
            yield Finding(
                f"time {said} in {len(rows)} rows, first in row {rows[0] + 1}. Sort the rows, delete what is double, "
                "or put two runs into two files.",
                serious=True,
            )
    if timing.gaps:
        longest = max(timing.gaps, key=lambda gap: gap.length)
        yield Finding(
            f"{len(timing.gaps)} gaps in time, the longest of {longest.length:.4g} s behind row {longest.row + 1} "
            f"(usual step {timing.step:.4g} s). Do not fit dynamics across them."
        )


def _sensor_findings(recording: Recording, sensed: Mapping[str, Sensor]) -> Iterator[Finding]:
    for name, sensor in sensed.items():
        for end, word in ((sensor.lower_limit, "lowest"), (sensor.upper_limit, "highest")):
            if name not in recording.columns or not np.isfinite(end):
                continue
            count = int(np.count_nonzero(np.abs(recording[name] - end) <= 0.25 * sensor.resolution))
            part = count / len(recording)
            quantity = quantity_of(name)
            if count:
                yield Finding(
                    f"the {name} stands still at its {word} reading, {end:.6g} {quantity.unit if quantity else ''}, in "
                    f"{count} rows ({part:.0%}): the sensor is cut off there. Such rows are bounds, not values.",
                    serious=part >= MAX_SATURATED_FRACTION,
                )


def _run_findings(recording: Recording, found: tuple[Run, ...]) -> Iterator[Finding]:
    stated = recording.constants.get("run")
    if any(run.kind is AT_REST for run in found):
        what = "nothing that was measured changes" if len(recording.columns) > 2 else "the one quantity does not change"
        held = _pressure_range(recording)
        yield Finding(
            f"{what}{held}: no characteristic can be found from it. Sweep the pressure of an isometric run, the length "
            "of an isobaric one, and check that the sensors were connected.",
            serious=True,
        )
    elif isinstance(stated, str) and found:
        kinds = {run.kind.name for run in found}
        if stated not in kinds and stated in {kind.name for kind in KINDS}:
            yield Finding(
                f"it is said to be {stated}, but what was measured is {' and '.join(sorted(kinds))}"
                f"{_pressure_range(recording)}. Correct the statement, or take another file.",
                serious=True,
            )


def _pressure_range(recording: Recording) -> str:
    """`(pressure within 1.2 kPa of 300 kPa)`, to show what was taken as constant."""
    if "pressure" not in recording:
        return ""
    low, high = np.quantile(recording["pressure"], [0.01, 0.99])
    return f" (pressure from {low / 1e3:.4g} to {high / 1e3:.4g} kPa)"


def _duration_findings(
    recording: Recording, timing: Sampling | None, sensed: Mapping[str, Sensor]
) -> Iterator[Finding]:
    """Records that end before the pressure has settled, and steps faster than the sampling."""
    if timing is None or "pressure" not in recording or timing.rows < 2 * MIN_ROWS_PER_STEP:
        return
    pressure = recording["pressure"]
    reach = float(np.ptp(pressure))
    if reach <= NOISE_FACTOR * (sensed["pressure"].std if "pressure" in sensed else 0.0):
        return
    last = pressure[-max(len(pressure) // 10, 3) :]
    calm = quasi_static_rows(recording, sensed)
    if reach > 0 and not calm[-1] and abs(last[-1] - last[0]) > MAX_FINAL_CHANGE * reach:
        yield Finding(
            f"the record ends while the pressure still changes ({abs(last[-1] - last[0]) / 1e3:.4g} kPa in the last "
            "tenth): it may be shorter than the dynamics. Record until the pressure has settled.",
            serious=True,
        )
    biggest = float(np.max(np.abs(np.diff(pressure)))) if len(pressure) > 1 else 0.0
    if biggest > 0.5 * reach > 0:
        yield Finding(
            f"the pressure changes by {biggest / 1e3:.4g} kPa, most of its range, from one row to the next: the "
            f"step is faster than {timing.rate:.4g} rows per second can show."
        )

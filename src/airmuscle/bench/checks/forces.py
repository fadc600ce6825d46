"""Checks of the force: sign, zero of the sensor, and a force that does not fit the pressure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...recording.recording import Recording
from .bench_rows import BenchRows, PressureLine, file_list, limits, pressure_lines, recordings_with

MAX_OFFSET = 0.05
"""Maximum negative force, as a fraction of the maximum force (chosen): a muscle cannot push."""
REVERSED = 3.0
"""Ratio of negative to positive values from which a sign is taken for reversed (chosen)."""
COMPRESSED = 0.3
"""Range of the forces at zero pressure, as a fraction of the lowest force, above which they are no offset (chosen)."""
AREAS = (1e-7, 5e-2)
"""Range of the maximum force divided by the highest pressure [m2] (chosen: 1e-5 to 1e-2 of muscles on sale)."""


def check_force_signs(recordings: Sequence[Recording]) -> Iterator[str]:
    """A force that is negative where the muscle pulls, or that states a pushing muscle."""
    forces = {each.origin: limits(each["force"]) for each in recordings_with(recordings, "force")}
    size = max((abs(value) for pair in forces.values() for value in pair), default=0.0)
    greatest = max((high for _, high in forces.values()), default=0.0)
    for origin, (low, high) in forces.items():
        if low < -MAX_OFFSET * size and -low > REVERSED * max(high, 0.0):
            yield (
                f"{origin}: the force is negative, down to {low:.4g} N. The force of a muscle in tension is positive, "
                "and negative rows count as slack: if the sensor counts tension as negative, multiply the column by -1."
            )
            return
    origin, (low, _) = min(forces.items(), key=lambda item: item[1][0], default=("", (0.0, 0.0)))
    if low < -MAX_OFFSET * greatest and not _is_compressed(recordings, low):
        yield (
            f"{origin}: the force is down to {low:.4g} N, but a muscle cannot push. The sensor has an offset, or "
            "carries a weight: all forces are then wrong by the same amount. Subtract the reading of the slack muscle."
        )


def _is_compressed(recordings: Sequence[Recording], low: float) -> bool:
    """Whether the forces at zero pressure vary with the length, as those of a muscle that is pushed together do."""
    slack = BenchRows.of(recordings_with(recordings, *BenchRows._fields)).slack_forces
    return bool(slack.size and np.ptp(slack) > COMPRESSED * -low)


def check_force_area(recordings: Sequence[Recording]) -> Iterator[str]:
    """A maximum force that is too great or too small for the highest pressure."""
    given = recordings_with(recordings, "pressure", "force")
    greatest = max((limits(each["force"])[1] for each in given), default=0.0)
    highest = max((float(np.nanmax(each["pressure"])) for each in recordings_with(recordings, "pressure")), default=0.0)
    varied = any(float(np.ptp(each["pressure"])) > 0.1 * highest for each in given)
    if greatest <= 0 or highest <= 0 or (highest < 1e3 and not varied):
        return
    area = greatest / highest
    if not AREAS[0] <= area <= AREAS[1]:
        yield (
            f"the maximum force, {greatest:.4g} N, divided by the highest pressure, {highest / 1e3:.4g} kPa, is "
            f"{area:.3g} m2; allowed range: {AREAS[0]:g} to {AREAS[1]:g} m2 for pneumatic muscles. The unit of force "
            "or pressure is probably wrong."
        )


MAX_ZERO = 0.012
"""Maximum reading of the slack muscle, as a fraction of the maximum force (chosen)."""
MAX_EXTRAPOLATED = 0.015
"""Maximum force extrapolated to zero pressure, as a fraction of the maximum force (chosen)."""
MIN_ROWS = 3
"""Minimum number of rows without pressure (chosen)."""
MIN_LEVELS, MIN_RANGE = 3, 0.05
"""Minimum number of contractions whose lines show the zero, and their minimum range (chosen)."""
_REMEDY = "Subtract the reading of the slack muscle at zero pressure from the column, or measure it."


def check_force_zero(recordings: Sequence[Recording]) -> Iterator[str]:
    """A sensor that reads a force at zero pressure, measured there or extrapolated to it.

    The force at zero gauge pressure is at most 0 at each contraction: the wall resists contraction and does not pull
    (Chou and Hannaford, IEEE Trans. Robot. Autom. 12 (1996), with elastic wall: Tondu and Lopez 2000).
    """
    given = recordings_with(recordings, *BenchRows._fields)
    rows = BenchRows.of(given)
    if not rows.force.size or not rows.greatest > 0:
        return
    slack = rows.slack_forces
    if slack.size >= MIN_ROWS:
        reading = float(np.median(slack))
        if reading > MAX_ZERO * rows.greatest:
            yield (
                f"{file_list([each.origin for each in given])}: the force is {reading:.3g} N at zero pressure and "
                "shortened length, where a muscle is slack: the zero of the force sensor is wrong, and all forces by "
                f"the same amount. {_REMEDY}"
            )
        return
    offset = extrapolated_offset(pressure_lines(rows))
    if offset > MAX_EXTRAPOLATED * rows.greatest:
        yield (
            f"{file_list([each.origin for each in given])}: the force extrapolates to {offset:.3g} N at zero pressure, "
            "where a muscle does not pull: the zero of the force sensor, or that of the pressure, is probably wrong. "
            f"{_REMEDY}"
        )


def extrapolated_offset(lines: Sequence[PressureLine]) -> float:
    """The greatest force [N] at zero pressure of the lines at several contractions; 0 where none is positive by three
    standard errors."""
    if len(lines) < MIN_LEVELS or lines[-1].contraction - lines[0].contraction < MIN_RANGE:
        return 0.0
    return max(line.intercept if line.intercept > 3.0 * line.error else 0.0 for line in lines)

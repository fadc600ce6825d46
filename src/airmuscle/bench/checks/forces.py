"""Checks of the force: reversed sign, a pushing muscle, and a force that does not fit the pressure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...recording.recording import Recording
from .bench_rows import BenchRows, limits, recordings_with

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

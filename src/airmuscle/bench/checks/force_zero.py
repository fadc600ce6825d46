"""Check of the zero of the force sensor: a muscle without gauge pressure, shorter than at rest, does not pull."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...recording.recording import Recording
from .bench_rows import BenchRows, PressureLine, file_list, pressure_lines, recordings_with

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

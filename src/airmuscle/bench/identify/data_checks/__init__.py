"""Checks of the data of a static fit: contradictions, outliers and sensor delays, as notes that name their cause.

They need no law. `DataChecks` joins them with the checks of `bench.checks`, for every static fit.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from ....recording import Recording
from ...checks import find_suspicious, without_missing_codes
from ...segment.remembered import remembered
from .contradictions import contradiction_notes, repeatability
from .matched_rows import match_rows
from .outlier_notes import outlier_notes
from .scatter import Scatter
from .sensor_delay import SensorDelay, delay_notes, find_delay

__all__ = ["DataChecks", "Scatter", "SensorDelay", "delay_notes", "find_delay"]


@dataclasses.dataclass(frozen=True)
class DataChecks:
    """What the recordings of a bench show without a law.

    notes    what contradicts a static characteristic, as sentences with files and remedy
    scatter  noise of the force sensor and repeatability of the force
    delay    delay of the force after the pressure; None without one
    """

    notes: tuple[str, ...]
    scatter: Scatter
    delay: SensorDelay | None

    @classmethod
    def of(cls, recordings: Sequence[Recording]) -> DataChecks:
        """The checks of recordings, without the rows in which a code stands for a missing value."""
        return _check(recordings)


@remembered
def _check(recordings: Sequence[Recording]) -> DataChecks:
    measured = without_missing_codes([recording for recording in recordings if len(recording)])
    matches, delay = match_rows(measured), find_delay(measured)
    found = (*contradiction_notes(matches), *outlier_notes(measured), *delay_notes(delay))
    return DataChecks((*find_suspicious(recordings), *found), Scatter.of(measured, repeatability(matches)), delay)

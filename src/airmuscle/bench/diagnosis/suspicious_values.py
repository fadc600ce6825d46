"""Checks of the recordings of one bench: values that are possible as numbers, but that no muscle
explains.

The recordings are judged together, because a single run may be slack or at one pressure. Each check
is a function of the recordings that yields a text with what was found, in which files, how much,
and the remedy. Every command that reads files issues them as warnings, and every static fit repeats
them in its notes.
"""

import warnings
from collections.abc import Callable, Iterator, Sequence

from ...core import AirmuscleWarning
from ...recording.recording import Recording
from . import contractions, pressures
from .level_records import LevelRecord, level_record, level_tables
from .support import DataUse, Support, support_of

__all__ = [
    "DataUse",
    "LevelRecord",
    "Support",
    "find_suspicious",
    "level_record",
    "level_tables",
    "support_of",
    "warn_of_suspicious_values",
]

BenchCheck = Callable[[Sequence[Recording]], Iterator[str]]
CHECKS: tuple[BenchCheck, ...] = (
    pressures.check_lowest_pressures,
    pressures.check_mixed_pressures,
    pressures.check_absolute_isobars,
    pressures.check_pressure_zero,
    pressures.check_force_signs,
    pressures.check_force_zero,
    contractions.check_contraction_signs,
    contractions.check_resting_length,
    contractions.check_contraction_limit,
    contractions.check_length_and_contraction,
    contractions.check_elongation,
    pressures.check_pressure_limit,
    pressures.check_force_area,
)
"""The checks of values without those that are codes for missing values."""


def find_suspicious(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """The findings of all checks on the recordings of one bench, as sentences with their remedy."""
    measured = [recording for recording in recordings if len(recording)]
    values = contractions.without_missing_codes(measured)
    return (
        *contractions.check_missing_codes(measured),
        *(text for check in CHECKS for text in check(values)),
    )


def warn_of_suspicious_values(recordings: Sequence[Recording]) -> None:
    """Issue an AirmuscleWarning for each finding on the recordings of one bench."""
    for text in find_suspicious(recordings):
        warnings.warn(AirmuscleWarning(text), stacklevel=3)

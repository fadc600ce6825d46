"""Checks of the recordings of one bench: values that are possible as numbers, but that no muscle explains.

The recordings are judged together, because a single run may be slack or at one pressure. Each check is a function of
the recordings that yields a text with what was found, in which files, how much, and the remedy. Every command that
reads files issues them as warnings, and every static fit repeats them in its notes.
"""

import warnings
from collections.abc import Callable, Iterator, Sequence

from ...core import AirmuscleWarning
from ...recording.recording import Recording
from .contractions import (
    check_contraction_limit,
    check_contraction_signs,
    check_elongation,
    check_length_and_contraction,
    check_missing_codes,
    without_missing_codes,
)
from .pressures import (
    check_absolute_isobars,
    check_force_area,
    check_force_signs,
    check_force_zero,
    check_lowest_pressures,
    check_mixed_pressures,
    check_pressure_limit,
)

__all__ = ["find_suspicious", "warn_of_suspicious_values", "without_missing_codes"]

BenchCheck = Callable[[Sequence[Recording]], Iterator[str]]
CHECKS: tuple[BenchCheck, ...] = (
    check_lowest_pressures,
    check_mixed_pressures,
    check_absolute_isobars,
    check_force_signs,
    check_force_zero,
    check_contraction_signs,
    check_contraction_limit,
    check_length_and_contraction,
    check_elongation,
    check_pressure_limit,
    check_force_area,
)
"""The checks of values without those that are codes for missing values."""


def find_suspicious(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """The findings of all checks on the recordings of one bench, as sentences with their remedy."""
    measured = [recording for recording in recordings if len(recording)]
    values = without_missing_codes(measured)
    return (*check_missing_codes(measured), *(text for check in CHECKS for text in check(values)))


def warn_of_suspicious_values(recordings: Sequence[Recording]) -> None:
    """Issue an AirmuscleWarning for each finding on the recordings of one bench."""
    for text in find_suspicious(recordings):
        warnings.warn(AirmuscleWarning(text), stacklevel=3)

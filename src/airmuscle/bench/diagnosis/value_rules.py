"""Table of the rules of values: numbers that are possible, but that no muscle explains.

The recordings of a bench are judged together, because a single run may be slack or at one pressure.
Commands that read files issue the findings as warnings; every static fit states them, too.
"""

import dataclasses
import functools
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence

from ...core import AirmuscleWarning
from ...recording import Recording
from ..inspection import remembered
from . import contractions, pressures
from .rules import Diagnosis, DiagnosisRule, Subject, apply_rules


@dataclasses.dataclass(frozen=True, eq=False)
class BenchData:
    """The recordings of one bench as their rules see them."""

    recordings: tuple[Recording, ...]
    """Those with rows."""

    @functools.cached_property
    def values(self) -> list[Recording]:
        """The recordings without the rows in which a code stands for a missing value."""
        return contractions.without_missing_codes(self.recordings)


def _of_values(
    check: Callable[[Sequence[Recording]], Iterator[str]],
) -> Callable[[BenchData], Iterable[str]]:
    """The condition of a rule from a check of recordings."""
    return lambda bench: check(bench.values)


VALUE_RULES = (
    DiagnosisRule(
        "codes of missing values that are read as numbers",
        Subject.VALUES,
        lambda bench: contractions.check_missing_codes(bench.recordings),
        "leave these rows out",
    ),
    DiagnosisRule(
        "pressures of which the lowest is the atmosphere",
        Subject.VALUES,
        _of_values(pressures.check_lowest_pressures),
        "state that the pressure is absolute",
    ),
    DiagnosisRule(
        "absolute and gauge pressures mixed",
        Subject.VALUES,
        _of_values(pressures.check_mixed_pressures),
        "state the reference of each file",
    ),
    DiagnosisRule(
        "isobars of absolute pressures",
        Subject.VALUES,
        _of_values(pressures.check_absolute_isobars),
        "state that the pressure is absolute",
    ),
    DiagnosisRule(
        "a zero of the pressure",
        Subject.VALUES,
        _of_values(pressures.check_pressure_zero),
        "subtract the reading without pressure",
    ),
    DiagnosisRule(
        "a force of the wrong sign",
        Subject.VALUES,
        _of_values(pressures.check_force_signs),
        "multiply its column by -1",
    ),
    DiagnosisRule(
        "a zero of the force",
        Subject.VALUES,
        _of_values(pressures.check_force_zero),
        "subtract the reading of the slack muscle",
    ),
    DiagnosisRule(
        "a contraction of the wrong sign, or percent as ratios",
        Subject.VALUES,
        _of_values(contractions.check_contraction_signs),
        "correct the sign or the unit of the contraction",
    ),
    DiagnosisRule(
        "a resting length that the rows contradict",
        Subject.VALUES,
        _of_values(contractions.check_resting_length),
        "measure the resting length without pressure and load",
    ),
    DiagnosisRule(
        "a muscle that pulls where none is so short",
        Subject.VALUES,
        _of_values(contractions.check_contraction_limit),
        "correct the unit of the contraction or the resting length",
    ),
    DiagnosisRule(
        "a contraction that the length contradicts",
        Subject.VALUES,
        _of_values(contractions.check_length_and_contraction),
        "correct the resting length or the contraction",
    ),
    DiagnosisRule(
        "an elongation under pressure",
        Subject.VALUES,
        _of_values(contractions.check_elongation),
        "check the sign of the contraction",
    ),
    DiagnosisRule(
        "a pressure that no muscle bears",
        Subject.VALUES,
        _of_values(pressures.check_pressure_limit),
        "correct the unit of the pressure",
    ),
    DiagnosisRule(
        "a force that no bore explains",
        Subject.VALUES,
        _of_values(pressures.check_force_area),
        "correct the unit of force or pressure",
    ),
)
"""The rules of values, in the order in which they are told."""


@remembered
def bench_data(recordings: Sequence[Recording]) -> BenchData:
    """The recordings with rows."""
    return BenchData(tuple(recording for recording in recordings if len(recording)))


def diagnose_values(recordings: Sequence[Recording]) -> tuple[Diagnosis, ...]:
    """The findings on the values of the recordings of one bench, which reading states."""
    return apply_rules(VALUE_RULES, bench_data(recordings))


def warn_of_suspicious_values(recordings: Sequence[Recording]) -> None:
    """Issue an AirmuscleWarning for each finding on the values of the recordings of one bench."""
    for diagnosis in diagnose_values(recordings):
        warnings.warn(AirmuscleWarning(diagnosis.text), stacklevel=3)

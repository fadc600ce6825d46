"""Table of the rules of recordings, and the diagnosis of recordings, points, fits and predictions.

The recordings are judged together, because a single run may be slack or at one pressure. Commands
that read files issue the findings on values as warnings; every static fit states all of them.
"""

import dataclasses
import functools
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence

from ...core import AirmuscleWarning, ParameterError, one_line
from ...recording import Recording
from ..inspection import remembered
from . import contractions, pressures
from .branch_residuals import SensorDelay, delay_notes, find_delay
from .contradictions import contradiction_notes, repeatability, two_muscle_notes
from .data_checks import outlier_notes, saturation_notes
from .matched_rows import Matches, match_rows
from .misfit import LawMisfit
from .rules import Diagnosable, Diagnosis, DiagnosisRule, Subject, apply_rules, texts_of
from .scatter import Scatter, force_noise

TOLD_APART = " tells the contradicting rows apart"
"""Part of the text of contradicting rows whose cause is known."""


@dataclasses.dataclass(frozen=True, eq=False)
class BenchData:
    """The recordings of one bench as their rules see them."""

    recordings: tuple[Recording, ...]
    """Those with rows."""

    @functools.cached_property
    def values(self) -> list[Recording]:
        """The recordings without the rows in which a code stands for a missing value."""
        return contractions.without_missing_codes(self.recordings)

    @functools.cached_property
    def matches(self) -> Matches:
        """Rows of different runs at equal pressure and contraction."""
        return match_rows(self.values)

    @functools.cached_property
    def delay(self) -> SensorDelay | None:
        """Delay of the force after the pressure; None without one."""
        return find_delay(self.values)

    @functools.cached_property
    def contradictions(self) -> list[str]:
        """What is said of contradicting rows."""
        return contradiction_notes(self.matches)

    @property
    def scatter(self) -> Scatter:
        """The scatter of the force."""
        return Scatter(force_noise(self.values), repeatability(self.matches))


def _two_muscles(bench: BenchData) -> list[str]:
    if any(TOLD_APART in text for text in bench.contradictions):
        return []
    return two_muscle_notes(match_rows(bench.values, by_branch=True))


def _of_values(
    check: Callable[[Sequence[Recording]], Iterator[str]],
) -> Callable[[BenchData], Iterable[str]]:
    """The condition of a rule from a check of recordings."""
    return lambda bench: check(bench.values)


RECORDING_RULES = (
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
    DiagnosisRule(
        "rows that contradict each other",
        Subject.RECORDINGS,
        lambda bench: bench.contradictions,
        "remove the cause that tells them apart, or fit each group by itself",
    ),
    DiagnosisRule(
        "runs of two muscles",
        Subject.RECORDINGS,
        _two_muscles,
        "write the name of the muscle in a column",
    ),
    DiagnosisRule(
        "outliers of the force",
        Subject.RECORDINGS,
        lambda bench: outlier_notes(bench.values),
        "leave them out, or reduce their weight by a robust loss",
    ),
    DiagnosisRule(
        "a pressure sensor at its limit",
        Subject.RECORDINGS,
        lambda bench: saturation_notes(bench.values),
        "leave these rows out, or use a sensor of a greater range",
    ),
    DiagnosisRule(
        "loops of a delay or of a filter of a sensor",
        Subject.RECORDINGS,
        lambda bench: delay_notes(bench.delay),
        "shift the later quantity, turn the filter off, or ramp the pressure more slowly",
    ),
)
"""The rules of recordings, in the order in which they are told."""
VALUE_RULES = tuple(rule for rule in RECORDING_RULES if rule.subject is Subject.VALUES)


@dataclasses.dataclass(frozen=True)
class Findings:
    """What the rules find in recordings, or in a fit to them, and the scatter of the force."""

    diagnoses: tuple[Diagnosis, ...]
    scatter: Scatter
    delay: SensorDelay | None = None
    """Delay of the force after the pressure; None without one."""
    misfit: LawMisfit | None = None
    """That a law does not follow the data, with the causes that explain the residuals; its text is
    among the diagnoses."""

    @property
    def notes(self) -> tuple[str, ...]:
        """The texts of the diagnoses; what contradicts a characteristic with files and remedy."""
        return texts_of(self.diagnoses)


@remembered
def bench_data(recordings: Sequence[Recording]) -> BenchData:
    """The recordings with rows, of which the rules share what they compute."""
    return BenchData(tuple(recording for recording in recordings if len(recording)))


@remembered
def examine_recordings(recordings: Sequence[Recording]) -> Findings:
    """The findings of all rules of recordings."""
    bench = bench_data(recordings)
    return Findings(apply_rules(RECORDING_RULES, bench), bench.scatter, bench.delay)


def diagnose_values(recordings: Sequence[Recording]) -> tuple[Diagnosis, ...]:
    """The findings on the values of the recordings of one bench, which reading states."""
    return apply_rules(VALUE_RULES, bench_data(recordings))


def warn_of_suspicious_values(recordings: Sequence[Recording]) -> None:
    """Issue an AirmuscleWarning for each finding on the values of the recordings of one bench."""
    for diagnosis in diagnose_values(recordings):
        warnings.warn(AirmuscleWarning(diagnosis.text), stacklevel=3)


def diagnose(subject: Recording | Sequence[Recording] | Diagnosable) -> tuple[Diagnosis, ...]:
    """The findings of all rules of recordings, of the points of a fit, of a fit or of a prediction,
    each with its text and its rule. Raises ParameterError for anything else, and ColumnError for
    recordings of no muscle."""
    if isinstance(subject, Recording):
        return examine_recordings([subject]).diagnoses
    if isinstance(subject, Sequence) and not isinstance(subject, str):
        return examine_recordings(subject).diagnoses
    diagnoses = getattr(subject, "diagnoses", None)
    if diagnoses is None:
        raise ParameterError(
            f"diagnose: {one_line(subject)} has no rules. Give recordings, the points of a fit, a"
            " fit, or a prediction."
        )
    return tuple(diagnoses)

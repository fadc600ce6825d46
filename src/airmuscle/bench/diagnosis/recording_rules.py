"""Table of the rules of recordings, and the diagnosis of recordings, points and fits."""

import dataclasses
from collections.abc import Sequence

from ...core import ParameterError, one_line
from ...recording import Recording
from ..inspection import remembered
from .branch_residuals import SensorDelay, delay_notes, find_delay
from .cause_names import MisfitCause
from .contradictions import contradiction_notes, repeatability, two_muscle_notes
from .data_checks import outlier_notes, saturation_notes
from .matched_rows import Matches, match_rows
from .misfit import LawMisfit
from .rules import Diagnosable, Diagnosis, DiagnosisRule, Subject, apply_rules, texts_of
from .scatter import Scatter, force_noise
from .value_rules import VALUE_RULES, BenchData, bench_data

TOLD_APART = " tells the contradicting rows apart"
"""Part of the text of contradicting rows whose cause is known."""


@remembered
def _matches(recordings: Sequence[Recording]) -> Matches:
    """Rows of different runs at equal pressure and contraction."""
    return match_rows(recordings)


@remembered
def _delay(recordings: Sequence[Recording]) -> SensorDelay | None:
    """Delay of the force after the pressure; None without one."""
    return find_delay(recordings)


def _two_muscles(bench: BenchData) -> list[str]:
    if any(TOLD_APART in text for text in contradiction_notes(_matches(bench.values))):
        return []
    return two_muscle_notes(match_rows(bench.values, by_branch=True))


RECORDING_RULES = (
    *VALUE_RULES,
    DiagnosisRule(
        "rows that contradict each other",
        Subject.RECORDINGS,
        lambda bench: contradiction_notes(_matches(bench.values)),
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
        lambda bench: delay_notes(_delay(bench.values)),
        "shift the later quantity, turn the filter off, or ramp the pressure more slowly",
    ),
)
"""The rules of recordings, in the order in which they are told."""


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
    causes: tuple[MisfitCause, ...] = ()
    """What explains the residuals of a law where they are more than noise: those of a misfit, or of
    two branches."""

    @property
    def notes(self) -> tuple[str, ...]:
        """The texts of the diagnoses; what contradicts a characteristic with files and remedy."""
        return texts_of(self.diagnoses)


@remembered
def examine_recordings(recordings: Sequence[Recording]) -> Findings:
    """The findings of all rules of recordings."""
    bench = bench_data(recordings)
    scatter = Scatter(force_noise(bench.values), repeatability(_matches(bench.values)))
    return Findings(apply_rules(RECORDING_RULES, bench), scatter, _delay(bench.values))


def diagnose(subject: Recording | Sequence[Recording] | Diagnosable) -> tuple[Diagnosis, ...]:
    """The findings of all rules of recordings, of the check of a record, of the points of a fit, of
    a fit or of a prediction, each with its text and its rule. Raises ParameterError for anything
    else, and ColumnError for recordings of no muscle."""
    if isinstance(subject, Recording):
        return examine_recordings([subject]).diagnoses
    if isinstance(subject, Sequence) and not isinstance(subject, str):
        return examine_recordings(subject).diagnoses
    diagnoses = getattr(subject, "diagnoses", None)
    if diagnoses is None:
        raise ParameterError(
            f"diagnose: {one_line(subject)} has no rules. Give recordings, the check of a record,"
            " the points of a fit, a fit, or a prediction."
        )
    return tuple(diagnoses)

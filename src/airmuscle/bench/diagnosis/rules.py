"""Rules of diagnosis: what a rule looks at, the condition with the text of what was found, and the
remedy.

A calculation judges nothing. What is wrong with recordings, points, a fit or a prediction is said
by rules, which `diagnose` applies on demand; a new rule is one entry in the table of its subject.
"""

import dataclasses
import enum
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple, Protocol


class Subject(enum.Enum):
    """What a rule looks at."""

    VALUES = "the values of recordings"
    """Values that are possible as numbers, but that no muscle explains; said when files are
    read."""
    RECORDINGS = "recordings together"
    """Recordings that contradict a static characteristic or each other."""
    POINTS = "the points of a fit"
    FIT = "a fit"
    PREDICTION = "a prediction"


@dataclasses.dataclass(frozen=True)
class DiagnosisRule:
    """A rule of a table."""

    name: str
    """What it finds, as a noun phrase."""
    subject: Subject
    find: Callable[[Any], Iterable[str]]
    """Texts, one for each finding, with what was found, where and how much; none where the
    condition does not hold."""
    remedy: str
    """What to do, as a phrase in the imperative; a text states it with the numbers of the data."""


class Diagnosis(NamedTuple):
    """A finding of a rule: the name of the rule, and the text as one or several sentences."""

    rule: str
    text: str

    def __str__(self) -> str:
        return str(self.text)


class Diagnosable(Protocol):
    """What `diagnose` takes besides recordings: a check, points, a fit, a prediction."""

    @property
    def diagnoses(self) -> tuple[Diagnosis, ...]:
        """The findings of the rules of its kind."""


def apply_rules(rules: Iterable[DiagnosisRule], subject: object) -> tuple[Diagnosis, ...]:
    """The findings of rules in their order."""
    return tuple(Diagnosis(rule.name, text) for rule in rules for text in rule.find(subject))


def texts_of(diagnoses: Iterable[Diagnosis]) -> tuple[str, ...]:
    """The texts, for the notes of a result."""
    return tuple(diagnosis.text for diagnosis in diagnoses)

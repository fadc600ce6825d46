"""Claims of a report: statements of papers with the expected and the computed value; every verdict
is computed.
"""

import abc
import dataclasses
import enum
import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, ClassVar

from .formatting import DIGITS, MISSING, format_number, to_plain

HOLDS = "holds"
DIFFERS = "differs"
DEPENDS = "depends"
NOT_TESTABLE = "not testable"
NOT_PRINTED = "not printed"
MARKS = {HOLDS: "✓", DIFFERS: "✗", DEPENDS: "±", NOT_TESTABLE: "?", NOT_PRINTED: "–"}
"""A sign next to each verdict, so that it does not depend on colour."""

MEANINGS = {
    HOLDS: (
        "The reproduced value agrees with the expected one within the tolerance, in every reading."
    ),
    DIFFERS: "The reproduced value does not agree with the expected one, in any reading.",
    DEPENDS: "It agrees in some readings of the paper and not in others.",
    NOT_TESTABLE: (
        "Its measurements are lost, its condition is not printed, or every law fulfils it."
    ),
    NOT_PRINTED: "The paper gives no value to compare with, or no value can be computed.",
}
"""Meaning of each verdict."""


class Kind(enum.Enum):
    """Kind of an entry in the list of claims; each kind is listed and counted apart from the
    others.
    """

    CLAIM = "claim"
    FINDING = "comparison"
    CHECK = "check"

    @property
    def description(self) -> str:
        """Description of the kind for the report."""
        return _DESCRIPTIONS[self][1]

    def headline(self, count: int) -> str:
        """Name of the kind behind the number of its statements."""
        return f"{self.value}{'s' * (count != 1)} {_DESCRIPTIONS[self][0]}"


_DESCRIPTIONS = {
    Kind.CLAIM: ("of the papers", "claims of the paper"),
    Kind.FINDING: ("of this report", "comparisons of this report, which the paper does not make"),
    Kind.CHECK: ("of the computation", "checks of the computation"),
}


@dataclasses.dataclass(frozen=True)
class PublishedValue(abc.ABC):
    """The value that a paper prints for a claim, and the criterion for the reproduced number.

    Where a paper says only "low" or "comparable", the bound is `chosen`: then `claims.json` gives
    no published value, and the bound as the tolerance. A value that follows from printed ones, or
    from a word such as "higher", is `derived`: it is not published either, and `claims.json` gives
    it as the expected value.
    """

    value: float
    tolerance: float = 0.0
    chosen: bool = False
    derived: bool = False
    relation: ClassVar[str] = ""
    """Sign before the value."""

    @property
    def published(self) -> bool:
        """Whether the paper prints the value."""
        return not (self.chosen or self.derived)

    @abc.abstractmethod
    def agrees(self, reproduced: float) -> bool:
        """Whether the reproduced number confirms the claim."""


class Equal(PublishedValue):
    """Criterion: the reproduced number equals the printed one within the tolerance."""

    def agrees(self, reproduced: float) -> bool:
        return abs(reproduced - self.value) <= self.tolerance


class AtLeast(PublishedValue):
    """Criterion: the reproduced number is not below the printed one minus the tolerance."""

    relation = "≥ "

    def agrees(self, reproduced: float) -> bool:
        return reproduced >= self.value - self.tolerance


class AtMost(PublishedValue):
    """Criterion: the reproduced number is not above the printed one plus the tolerance."""

    relation = "≤ "

    def agrees(self, reproduced: float) -> bool:
        return reproduced <= self.value + self.tolerance


@dataclasses.dataclass(frozen=True)
class Claim:
    """One statement of a paper, in one case, with the printed and the reproduced value.

    `case` names the interpretation, load or range for which the statement is evaluated; a statement
    with several cases counts once. `printed` is None if the paper gives no value to compare with,
    `reproduced` is None if no value can be computed; in both cases the verdict is "not printed".
    `untestable` marks a statement that no computation can decide, because its measurements are
    lost, its condition is not printed or every law fulfils it: it is "not testable". `place` is
    where the paper states it, `note` gives the reason of a difference, or the values chosen.
    """

    paper: str
    claim: str
    printed: PublishedValue | None
    reproduced: float | None
    unit: str
    note: str = ""
    case: str = ""
    kind: Kind = Kind.CLAIM
    untestable: bool = False
    place: str = ""

    @property
    def text(self) -> str:
        """The statement with its case: `accurate below 20 % [line A]`."""
        return f"{self.claim} [{self.case}]" if self.case else self.claim

    @property
    def verdict(self) -> str:
        if self.untestable:
            return NOT_TESTABLE
        if self.printed is None or self.reproduced is None or not math.isfinite(self.reproduced):
            return NOT_PRINTED
        return HOLDS if self.printed.agrees(self.reproduced) else DIFFERS

    def as_dict(self) -> dict[str, Any]:
        """Return the claim as a record of `claims.json`."""
        printed = self.printed
        return {
            "paper": self.paper,
            "kind": self.kind.value,
            "claim": to_plain(self.text),
            "statement": to_plain(self.claim),
            "case": to_plain(self.case),
            "place": to_plain(self.place),
            "published": printed.value if printed and printed.published else None,
            "expected": printed.value if printed and printed.derived else None,
            "reproduced": self.reproduced,
            "unit": self.unit,
            "tolerance": (
                None if printed is None else printed.value if printed.chosen else printed.tolerance
            ),
            "verdict": self.verdict,
            "note": to_plain(self.note),
        }


@dataclasses.dataclass(frozen=True)
class ClaimRow:
    """One row of a table of claims: a claim without its value, the function that reproduces the
    value, and the cases.

    `reproduce` returns the value, or the value with a further sentence of the note; without it
    these are the arguments, and without arguments no value can be computed. `cases` maps the name
    of each case to its arguments.
    """

    blank: Claim
    reproduce: Callable[..., Any] | None = None
    cases: Mapping[str, tuple[Any, ...]] = dataclasses.field(default_factory=lambda: {"": ()})

    def claim(self, case: str, *arguments: Any) -> Claim:
        """Return the claim in one case, evaluated for these arguments."""
        result = self.reproduce(*arguments) if self.reproduce else arguments or None
        value, reason = result if isinstance(result, tuple) else (result, "")
        note = f"{self.blank.note} {reason}".strip()
        return dataclasses.replace(
            self.blank,
            reproduced=value,
            note=note,
            case=case,
        )

    def claims(self, *subject: Any) -> tuple[Claim, ...]:
        """Return the claims of all cases; the function is given the subject before the arguments of
        the case.
        """
        return tuple(
            self.claim(case, *subject, *arguments) for case, arguments in self.cases.items()
        )


def claims_of(rows: Iterable[ClaimRow], *subject: Any) -> tuple[Claim, ...]:
    """Return the claims of the rows of a table, each in all its cases."""
    return tuple(claim for row in rows for claim in row.claims(*subject))


@dataclasses.dataclass(frozen=True)
class Statement:
    """A statement with all the cases for which it is evaluated."""

    claim: str
    cases: tuple[Claim, ...]

    @property
    def common_note(self) -> str:
        """The note of several cases that have the same one; otherwise empty."""
        notes = {case.note for case in self.cases}
        return notes.pop() if len(notes) == 1 < len(self.cases) else ""

    @property
    def reproduced(self) -> list[float]:
        """The values of the cases that have the expected value and the unit of the first one."""
        first = self.cases[0]
        alike = (
            case.reproduced
            for case in self.cases
            if (case.printed, case.unit) == (first.printed, first.unit)
        )
        return [value for value in alike if value is not None and math.isfinite(value)]

    @property
    def verdict(self) -> str:
        """The common verdict of the cases; "depends" if the statement holds in some and differs in
        others.
        """
        verdicts = [case.verdict for case in self.cases]
        decided = {verdict for verdict in verdicts if verdict in (HOLDS, DIFFERS)}
        return DEPENDS if len(decided) > 1 else decided.pop() if decided else verdicts[0]


def statements(claims: Iterable[Claim], kind: Kind = Kind.CLAIM) -> tuple[Statement, ...]:
    """Return the statements of one kind in the order of their first case, each with all its
    cases.
    """
    cases: dict[tuple[str, str], list[Claim]] = {}
    for claim in claims:
        if claim.kind is kind:
            cases.setdefault((claim.paper, claim.claim), []).append(claim)
    return tuple(Statement(text, tuple(group)) for (_, text), group in cases.items())


def format_published(claim: Claim, *, with_tolerance: bool = True) -> str:
    """Return the published value with its relation and tolerance: `≥ 4`, `20 ± 0.5`; an en dash if
    there is none.
    """
    if claim.printed is None:
        return MISSING
    tolerance = (
        f" ± {format_number(claim.printed.tolerance)}"
        if claim.printed.tolerance and with_tolerance
        else ""
    )
    origin = " (chosen)" if claim.printed.chosen else " (derived)" if claim.printed.derived else ""
    return f"{claim.printed.relation}{format_number(claim.printed.value)}{tolerance}{origin}"


def count_verdicts(claims: Iterable[Claim], kind: Kind = Kind.CLAIM) -> dict[str, int]:
    """Return the number of statements of one kind with each verdict; the cases of a statement count
    once.
    """
    verdicts = [statement.verdict for statement in statements(claims, kind)]
    return {verdict: verdicts.count(verdict) for verdict in MARKS}


def format_reproduced(statement: Statement, digits: int = DIGITS) -> str:
    """Return the reproduced value of a statement, or the range of its readings: `1.64 to 41.18`."""
    if not statement.reproduced:
        return MISSING
    low, high = (format_number(end(statement.reproduced), digits) for end in (min, max))
    return low if low == high else f"{low} to {high}"


def format_verdicts(count: int, verdict: str) -> str:
    """A number of statements or readings with their verdict: `1 holds`, `4 hold`."""
    plural = {HOLDS: "hold", DIFFERS: "differ", DEPENDS: "depend"}
    return f"{count} {verdict if count == 1 else plural.get(verdict, verdict)}"


def count_readings(statement: Statement) -> str:
    """The number of cases of a statement with each verdict: `7 readings: 4 hold, 3 differ`."""
    verdicts = [case.verdict for case in statement.cases]
    texts = []
    for verdict in MARKS:
        count = verdicts.count(verdict)
        if count:
            texts.append(format_verdicts(count, verdict))
    return f"{len(verdicts)} readings: {', '.join(texts)}"

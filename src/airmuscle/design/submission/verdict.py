"""Verdict on a contribution: its refusals with reasons, and the chapters of its page."""

import dataclasses
import math
from collections.abc import Iterator, Mapping

from ...bench import RecordPrediction
from ...bench.prediction import prediction_chapters
from ...bench.reported import Reported, unit_column
from ...core import counted
from ...files.library import Entry
from ...report.chapter import BY_ROW, Chapter, NamedValue, Table, TableColumn
from ..audit import AuditResult
from .declaration import Submission, SubmittedRecord

RULES = (
    "declaration",
    "licence",
    "records present",
    "hashes",
    "records of fit and held out",
    "muscle file",
    "readable records",
    "diagnoses",
    "law follows records",
    "held-out figures",
    "audit",
)
"""What a contribution is examined for, in this order."""


@dataclasses.dataclass(frozen=True)
class Refusal:
    """A reason to refuse a contribution: the rule, what was found, and what to do."""

    rule: str
    text: str
    remedy: str


@dataclasses.dataclass(frozen=True)
class HeldOutFigure:
    """The error of a record that was held out [SI], over all its rows that are compared.

    quantity    what the law gives
    rms_error   computed anew; not a number where the record was not predicted
    share       of the rows within the 95 % band; None where the muscle states no band
    """

    quantity: str
    unit: str
    rms_error: float
    share: float | None


UNKNOWN = HeldOutFigure("", "", math.nan, None)
"""Of a record that was not predicted."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class SubmissionVerdict(Reported):
    """Whether a contribution is accepted, and why not.

    entry        the muscle; None where its file cannot be read
    refusals     reasons; none of an accepted contribution
    figures      of the records that were held out, by file
    predictions  of their recordings
    audit        of the law; None without a muscle
    notes        findings that are no reason to refuse
    """

    submission: Submission
    entry: Entry | None
    refusals: tuple[Refusal, ...]
    figures: Mapping[str, HeldOutFigure] = dataclasses.field(default_factory=dict)
    predictions: tuple[RecordPrediction, ...] = ()
    audit: AuditResult | None = None
    notes: tuple[str, ...] = ()

    @property
    def is_accepted(self) -> bool:
        """Whether nothing speaks against the contribution."""
        return not self.refusals

    def library_entry(self) -> Entry:
        """The muscle as the library takes it, with who measured and who sent it. Raises ValueError
        for a contribution that is not accepted.
        """
        if self.entry is None or not self.is_accepted:
            raise ValueError("a contribution that is not accepted is no entry of the library")
        return dataclasses.replace(
            self.entry,
            name=self.submission.name,
            measured_by=self.submission.measured_by,
            submitted_by=self.submission.contributor,
        )

    def chapter(self) -> Chapter:
        """The verdict: what was examined, what was refused, the records and their figures."""
        submission = self.submission
        values = {
            "muscle": submission.muscle,
            "licence": submission.licence,
            "contributor": submission.contributor,
            "measured by": submission.measured_by,
            **{f"rig: {key}": text for key, text in submission.rig.items()},
        }
        return Chapter(
            "submission",
            f"Contribution {submission.name}",
            self._summary(),
            values=tuple(NamedValue(name, text, brief=False) for name, text in values.items()),
            tables=tuple(self._tables()),
            notes=self.notes,
        )

    def chapters(self) -> list[Chapter]:
        """All chapters of the page: verdict, muscle, predicted records, audit."""
        chapters = [self.chapter()]
        if self.entry is not None:
            chapters.append(dataclasses.replace(self.entry.chapter(), brief=False))
        if self.entry is not None and self.predictions:
            predicted = prediction_chapters(self.submission.muscle, self.entry, self.predictions)
            chapters += [dataclasses.replace(chapter, brief=False) for chapter in predicted]
        if self.audit is not None:
            chapters.append(dataclasses.replace(self.audit.chapter(), brief=False))
        return chapters

    def _summary(self) -> str:
        if self.is_accepted:
            records = counted(len(self.submission.records), "record")
            return (
                f"Accepted: {len(RULES)} rules found nothing against the muscle and its {records}."
            )
        return f"Refused for {counted(len(self.refusals), 'reason')}; each says what to do."

    def _tables(self) -> Iterator[Table]:
        yield self._rule_table()
        if self.refusals:
            columns = {
                "rule": [refusal.rule for refusal in self.refusals],
                "reason": [refusal.text for refusal in self.refusals],
                "what to do": [refusal.remedy for refusal in self.refusals],
            }
            yield Table("refusals", "Reasons", columns, brief=len(self.refusals))
        if self.submission.records:
            yield self._record_table()

    def _rule_table(self) -> Table:
        refused = {refusal.rule for refusal in self.refusals}
        verdicts = ["refused" if rule in refused else "nothing found" for rule in RULES]
        return Table("examined", "Rules", {"rule": list(RULES), "verdict": verdicts})

    def _record_table(self) -> Table:
        records = self.submission.records
        figures = [self.figures.get(record.file, UNKNOWN) for record in records]
        errors = [figure.rms_error for figure in figures]
        shares = [figure.share for figure in figures]
        columns = {
            "record": [record.file for record in records],
            "use": [record.use for record in records],
            "rms error": TableColumn(errors, BY_ROW),
            "unit": unit_column([figure.quantity for figure in figures]),
            "stated": [record.rms_error for record in records],
            "within the 95 % band": TableColumn(shares, "1", "%", digits=3, short="within"),
            "sha256": TableColumn([record.sha256 for record in records], brief=False),
            "address": TableColumn([_address(record) for record in records], brief=False),
        }
        return Table("raw-records", "Raw records", columns, brief=len(records))


def _address(record: SubmittedRecord) -> str:
    return record.address or "in the folder"

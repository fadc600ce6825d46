"""Findings of an audit, each with a replay, and their report."""

import dataclasses

from ...bench.reported import Reported
from ...report.chapter import Chapter, NamedValue, Table


@dataclasses.dataclass(frozen=True)
class AuditFinding:
    """What is wrong: rule, text with place and size, and lines that show it again."""

    rule: str
    text: str
    replay: tuple[str, ...]


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class AuditResult(Reported):
    """The result of an audit.

    subject   what was examined
    rules     names of the rules that were applied
    left_out  rules that were not applied, each with the reason
    findings  what was found
    evaluations  number of points at which the subject was evaluated
    """

    subject: str
    rules: tuple[str, ...]
    findings: tuple[AuditFinding, ...]
    left_out: tuple[tuple[str, str], ...] = ()
    evaluations: int = 0

    def chapter(self) -> Chapter:
        """The description of the audit."""
        found = {finding.rule for finding in self.findings}
        reasons = dict(self.left_out)
        names = (*self.rules, *reasons)
        verdicts = [
            "found" if name in found else "left out" if name in reasons else "passed"
            for name in names
        ]
        tables = [
            Table(
                "rules",
                "Rules",
                {
                    "rule": list(names),
                    "verdict": verdicts,
                    "reason": [reasons.get(name, "") for name in names],
                },
                brief=len(names),
            )
        ]
        if self.findings:
            columns = {
                "rule": [finding.rule for finding in self.findings],
                "replay": ["; ".join(finding.replay) for finding in self.findings],
            }
            tables.append(
                Table("replay", "Lines that show each finding", columns, brief=len(found))
            )
        return Chapter(
            "audit",
            f"Audit of {self.subject}",
            self._summary(),
            values=(
                NamedValue("findings", len(self.findings)),
                NamedValue("points evaluated", self.evaluations),
            ),
            tables=tuple(tables),
            problems=tuple(finding.text for finding in self.findings),
        )

    def _summary(self) -> str:
        count = len(self.findings)
        number = len(self.rules)
        if not count:
            return (
                f"None of the {number} rules found a fault. That is no proof: only points of the"
                " stated range and of its surroundings were examined."
            )
        noun = "finding" if count == 1 else "findings"
        examined = "rule" if number == 1 else "rules"
        return f"{count} {noun} by {number} {examined}; each has lines that show it again."

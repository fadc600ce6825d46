"""Audit of a muscle law: units, limits, direction of change, behaviour beyond the range, energy."""

from collections.abc import Callable

from .audited_law import AuditedLaw
from .finding import AuditFinding, AuditResult
from .law_rules import LAW_RULES, NO_MEMORY

AFTER_MEMORY = "means nothing for a function that remembers earlier calls"


def audit_law(law: AuditedLaw, evaluations: Callable[[], int] | None = None) -> AuditResult:
    """The audit of a law by the rules that apply to it.

    evaluations  counts the points at which the law was evaluated

    A law that expects another unit is examined further in that unit. Raises what the law raises.
    """
    findings: list[AuditFinding] = []
    rules: list[str] = []
    left_out: list[tuple[str, str]] = []
    subject = law
    remembers = False
    for rule in LAW_RULES:
        reason = AFTER_MEMORY if remembers else rule.needs(subject)
        if reason:
            left_out.append((rule.name, reason))
            continue
        rules.append(rule.name)
        outcome = rule.apply(subject)
        findings += outcome.findings
        remembers = remembers or (rule.name == NO_MEMORY and bool(outcome.findings))
        subject = outcome.subject or subject
    count = evaluations() if evaluations is not None else 0
    return AuditResult(law.name, tuple(rules), tuple(findings), tuple(left_out), count)

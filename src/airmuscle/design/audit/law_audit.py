"""Audit of a muscle law: units, limits, direction of change, behaviour beyond the range, energy."""

import dataclasses

import numpy as np

from ...core import Array
from .audited_law import AuditedLaw
from .finding import AuditFinding, AuditResult
from .law_rules import LAW_RULES, NO_MEMORY

AFTER_MEMORY = "means nothing for a function that remembers earlier calls"


class _CountedForce:
    """A force that counts the points at which it was evaluated."""

    def __init__(self, law: AuditedLaw) -> None:
        self.law = law
        self.evaluations = 0

    def __call__(self, pressure: Array, contraction: Array) -> Array:
        self.evaluations += np.broadcast(pressure, contraction).size
        return self.law.force(pressure, contraction)


def audit_law(law: AuditedLaw) -> AuditResult:
    """The audit of a law by the rules that apply to it.

    A law that expects another unit is examined further in that unit. Raises what the law raises.
    """
    findings: list[AuditFinding] = []
    rules: list[str] = []
    left_out: list[tuple[str, str]] = []
    force = _CountedForce(law)
    subject = dataclasses.replace(law, force=force)
    remembers = False
    for rule in LAW_RULES:
        reason = AFTER_MEMORY if remembers else rule.needs(subject)
        if reason:
            left_out.append((rule.name, reason))
            continue
        rules.append(rule.name)
        with np.errstate(invalid="ignore"):  # a force that is not finite is a finding
            outcome = rule.apply(subject)
        findings += outcome.findings
        remembers = remembers or (rule.name == NO_MEMORY and bool(outcome.findings))
        subject = outcome.subject or subject
    return AuditResult(law.name, tuple(rules), tuple(findings), tuple(left_out), force.evaluations)

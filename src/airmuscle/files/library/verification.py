"""Verification of library entries: comparison of the model with the published values of its checks."""

from __future__ import annotations

import dataclasses

from ...core.errors import ParameterError
from .entry import Check, Entry


@dataclasses.dataclass(frozen=True)
class CheckResult:
    """A check of a library entry with the value computed by the model."""

    check: Check
    computed: float

    @property
    def passes(self) -> bool:
        """Whether the computed value is within the tolerance; False for NaN."""
        return abs(self.computed - self.check.equals) <= self.check.tolerance

    def __str__(self) -> str:
        conditions = ", ".join(f"{name} {value:.4g}" for name, value in self.check.conditions)
        relation = "within" if self.passes else "NOT within"
        return (
            f"{self.check.quantity} at {conditions}: computed {self.computed:.4g}, {relation} "
            f"{self.check.equals:.4g} ± {self.check.tolerance:.4g} ({self.check.source})"
        )


def verify(entry: Entry) -> tuple[CheckResult, ...]:
    """Results of all checks of a library entry. Raises SolveError if the model has no solution."""
    return tuple(CheckResult(check, _compute(entry, check)) for check in entry.checks)


def _compute(entry: Entry, check: Check) -> float:
    conditions = dict(check.conditions)
    if check.quantity != "volume":
        return float(getattr(entry.characteristic, check.quantity)(**conditions))
    if entry.geometry is None:
        raise ParameterError(f"{entry.name}: a check of the volume requires a [geometry] in the file.")
    return float(entry.geometry.volume(**conditions))

"""Results of the checks of an entry."""

import dataclasses
from typing import Any

from ...core import ParameterError
from .check import Check
from .entry import Entry


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
        check = self.check
        conditions = ", ".join(f"{name} {value:.4g}" for name, value in check.conditions)
        relation = "within" if self.passes else "NOT within"
        return (
            f"{check.quantity} at {conditions}: computed {self.computed:.4g}, {relation} "
            f"{check.equals:.4g} ± {check.tolerance:.4g} ({check.source})"
        )


def verify(entry: Entry) -> tuple[CheckResult, ...]:
    """Results of all checks of a library entry. Raises SolveError if the model has no solution."""
    results = []
    for check in entry.checks:
        model: Any = entry.geometry if check.quantity == "volume" else entry.characteristic
        if model is None:
            raise ParameterError(
                f"{entry.name}: a check of the volume requires a [geometry] in the file."
            )
        results.append(
            CheckResult(check, float(getattr(model, check.quantity)(**dict(check.conditions))))
        )
    return tuple(results)

"""How well a muscle keeps energy, and whether a library entry gives the numbers printed for it."""

from __future__ import annotations

import dataclasses

from ..core.errors import ParameterError
from .entry import Check, Entry


@dataclasses.dataclass(frozen=True)
class CheckResult:
    """A check of a library entry and what the model gives for it."""

    check: Check
    computed: float

    @property
    def passes(self) -> bool:
        """Whether the model gives the number within its tolerance; NaN never holds."""
        return abs(self.computed - self.check.equals) <= self.check.tolerance

    def __str__(self) -> str:
        given = ", ".join(f"{name} {value:g}" for name, value in self.check.conditions)
        word = "is" if self.passes else "is NOT"
        return (
            f"{self.check.quantity} at {given} {word} {self.check.equals:g} within {self.check.tolerance:g}: "
            f"{self.computed:.8g} ({self.check.source})"
        )


def verify(entry: Entry) -> tuple[CheckResult, ...]:
    """Every check of a library entry, computed. Raises NoSolution where the model has no answer."""
    return tuple(CheckResult(check, _compute(entry, check)) for check in entry.checks)


def _compute(entry: Entry, check: Check) -> float:
    given = dict(check.conditions)
    if check.quantity != "volume":
        return float(getattr(entry.characteristic, check.quantity)(**given))
    if entry.geometry is None:
        raise ParameterError(f"{entry.name}: a check asks for the volume, but the file has no [geometry].")
    return float(entry.geometry.volume(**given))

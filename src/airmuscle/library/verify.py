"""How well a muscle keeps energy, and whether a library entry gives the numbers printed for it."""

from __future__ import annotations

import dataclasses

from ..core.errors import ParameterError
from .entry import Check, Entry


@dataclasses.dataclass(frozen=True)
class Verdict:
    """A check of a library entry and what the model gives for it."""

    check: Check
    found: float

    @property
    def holds(self) -> bool:
        """Whether the model gives the number within its tolerance; NaN never holds."""
        return abs(self.found - self.check.equals) <= self.check.tolerance

    def __str__(self) -> str:
        given = ", ".join(f"{name} {value:g}" for name, value in self.check.given)
        word = "is" if self.holds else "is NOT"
        return (
            f"{self.check.quantity} at {given} {word} {self.check.equals:g} within {self.check.tolerance:g}: "
            f"{self.found:.8g} ({self.check.source})"
        )


def verify(entry: Entry) -> tuple[Verdict, ...]:
    """Every check of a library entry, computed. Raises NoSolution where the model has no answer."""
    return tuple(Verdict(check, _computed(entry, check)) for check in entry.checks)


def _computed(entry: Entry, check: Check) -> float:
    given = dict(check.given)
    if check.quantity != "volume":
        return float(getattr(entry.characteristic, check.quantity)(**given))
    if entry.geometry is None:
        raise ParameterError(f"{entry.name}: a check asks for the volume, but the file has no [geometry].")
    return float(entry.geometry.volume(**given))

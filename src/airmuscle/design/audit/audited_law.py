"""Law of others as the subject of an audit, and the range in which it is meant to hold."""

import dataclasses
from collections.abc import Callable

import numpy as np

from ...core import Array, ParameterError, ShortRepr

Force = Callable[[Array, Array], Array]
"""Tension [N] at gauge pressures [Pa] and contractions [1]."""


@dataclasses.dataclass(frozen=True, repr=False)
class EnclosedVolume(ShortRepr):
    """Volume [m3] at contractions [1] and the resting length [m] of a muscle."""

    volume: Callable[[Array], Array]
    resting_length: float


@dataclasses.dataclass(frozen=True, repr=False)
class AuditedLaw(ShortRepr):
    """A law and the range in which it is meant to hold.

    force         tension [N] at gauge pressure [Pa] and contraction [1], arrays of one shape
    pressures     least and greatest gauge pressure [Pa]
    contractions  least and greatest contraction [1]
    enclosed      volume and resting length, if known
    is_table      whether it is known at points alone, and says nothing beyond them
    refuses       whether it refuses points without a solution, as entries of the library do
    """

    name: str
    force: Force
    pressures: tuple[float, float]
    contractions: tuple[float, float]
    enclosed: EnclosedVolume | None = None
    is_table: bool = False
    refuses: bool = False

    def __post_init__(self) -> None:
        for what, (low, high) in (
            ("pressures", self.pressures),
            ("contractions", self.contractions),
        ):
            if not (np.isfinite([low, high]).all() and low < high):
                raise ParameterError(
                    f"AuditedLaw: {what} are {low:g} to {high:g}; the first must be less than the"
                    " second."
                )

    def call(self, pressure: float, contraction: float) -> str:
        """A line of a replay: the call with its value."""
        value = float(self.force(np.array([pressure]), np.array([contraction]))[0])
        return f"{self.name}({pressure:.6g}, {contraction:.6g}) = {value:.6g}"

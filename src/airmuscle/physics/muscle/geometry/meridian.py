"""Meridian (interface): assumed outline of one segment between two rings, and its integrals."""

from __future__ import annotations

import abc
from typing import ClassVar, NamedTuple

from ....core import ops
from ....core.arrays import Array
from ....core.ops import Value
from ....core.reference import Reference

SAGA_2007 = Reference(
    "saga-2007",
    "Saga, N., Nakamura, T., Yaegashi, K.",
    "Mathematical Model of Pneumatic Artificial Muscle Reinforced by Straight Fibers",
    "Journal of Intelligent Material Systems and Structures 18:175-180",
    2007,
    "10.1177/1045389X06063462",
    "equations (1) to (19), Table 1; restored from a damaged copy and rederived",
)

Profile = tuple[Array, Array]
"""Axial positions [m] and radii [m]."""


class Segment(NamedTuple):
    """One segment of the muscle at a contraction. x: axial position; r: radius; s: arc length; r_0: end radius."""

    end_radius: Value
    """r_0 [m]."""
    length: Value
    """Chord l [m]."""
    arc: Value
    """Int ds [m]; equal to the fibre length except for approximate meridians."""
    max_radius: Value
    """Maximum radius, in the middle [m]."""
    end_sine: Value
    """Sine of the end slope angle phi_0."""
    end_cosine: Value
    """Cosine of the end slope angle; negative beyond a right angle."""
    excess: Value
    """Int (r - r_0) dx [m2]."""
    arc_excess: Value
    """G = Int (r - r_0) ds [m2]."""
    arc_excess_squared: Value
    """Q = Int (r - r_0)^2 ds [m3]."""
    volume: Value
    """Enclosed volume [m3]."""

    @property
    def half_section(self) -> Value:
        """A_1 = Int r dx [m2], the projected area of the half shell on which the pressure acts."""
        return self.excess + self.end_radius * self.length

    @property
    def end_slope(self) -> Value:
        """tan(phi_0)."""
        return self.end_sine / self.end_cosine


class Meridian(abc.ABC):
    """Assumed shape of the fibres in one segment of fibre length l_0 and end radius r_0."""

    references: ClassVar[tuple[Reference, ...]] = (SAGA_2007,)
    max_contraction: ClassVar[float] = 0.5
    """Above 50 % every meridian is beyond its maximum volume or, for the parabola (3), beyond its maximum radius."""

    @abc.abstractmethod
    def segment(self, contraction: Value, fibre_length: Value, end_radius: Value) -> Segment:
        """Shape and integrals of the segment at a contraction [1]; lengths in [m]; arrays broadcast."""

    @abc.abstractmethod
    def profile(self, contraction: float, fibre_length: float, end_radius: float, position: Array) -> Profile:
        """Axial positions from the middle [m] and radii [m] at normalised positions from -1 to 1 along the outline."""


def segment_volume(end_radius: Value, length: Value, excess: Value, excess_squared: Value) -> Value:
    """pi Int r^2 dx from Int (r - r_0) dx and Int (r - r_0)^2 dx."""
    return ops.pi * (end_radius**2 * length + 2 * end_radius * excess + excess_squared)

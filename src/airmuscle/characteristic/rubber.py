"""The rubber of a straight-fibre muscle's wall: a straight line of hoop stress over strain."""

from __future__ import annotations

import abc

from ..core.declaration import model, parameter
from ..core.ops import Value, pi
from ..geometry.meridian import Segment


@model
class RubberLine:
    """sigma = alpha eps + beta,   eps = (r - r_0)/r_0: nominal hoop stress, on the initial wall thickness.

    Fibres that do not stretch leave the hoop force per arc as sigma t, so that the wall needs no correction for
    thinning. A positive beta is a stress at rest, as of a balloon. Reference: Saga et al. 2007, (10), (11), Fig. 4.
    """

    slope: float = parameter("Pa", "alpha", "growth of the hoop stress with strain", bounds=(0.0, 1e8))
    intercept: float = parameter("Pa", "beta", "hoop stress at rest", bounds=(-1e7, 1e7))

    def stress(self, strain: Value) -> Value:
        """Hoop stress [Pa] at a hoop strain [1]."""
        return self.slope * strain + self.intercept

    def energy(self, arc_excess: Value, arc_excess_squared: Value, end_radius: Value) -> Value:
        """U/t = 2 pi (alpha Q/(2 r_0) + beta G) [N] per wall thickness; linear: it takes their growth as well."""
        return 2 * pi * (self.slope * arc_excess_squared / (2 * end_radius) + self.intercept * arc_excess)

    def _integrate_stress(self, excess: Value, path: Value, end_radius: Value) -> Value:
        return self.slope / end_radius * excess + self.intercept * path


class RubberIntegral(abc.ABC):
    """What the hoop stress is integrated along."""

    @abc.abstractmethod
    def hoop_stress(self, rubber: RubberLine, segment: Segment) -> Value:
        """H = Int sigma over one segment [N/m]."""


@model
class AxialIntegral(RubberIntegral):
    """H = Int sigma dx, as Saga et al. 2007 print in (12)."""

    def hoop_stress(self, rubber: RubberLine, segment: Segment) -> Value:
        return rubber._integrate_stress(segment.excess, segment.length, segment.end_radius)


@model
class ArcIntegral(RubberIntegral):
    """H = Int sigma ds: a hoop stress acts along the arc."""

    def hoop_stress(self, rubber: RubberLine, segment: Segment) -> Value:
        return rubber._integrate_stress(segment.arc_excess, segment.arc, segment.end_radius)

"""Rubber wall of a straight-fibre muscle: linear relation between hoop stress and strain."""

import abc

from ....core import Value, model, parameter, pi
from ..geometry.meridian import Segment


@model
class RubberLine:
    """Linear rubber: sigma = alpha eps + beta,   eps = (r - r_0)/r_0.

    sigma: nominal hoop stress, referred to the initial wall thickness. With inextensible fibres the hoop force per arc
    length is sigma t, so that no correction for the decreasing thickness is required. A positive beta is a prestress,
    as in a balloon. Reference: Saga et al. 2007, (10), (11), Fig. 4.
    """

    slope: float = parameter("Pa", "alpha", "increase of the hoop stress with strain", bounds=(0.0, 1e8))
    intercept: float = parameter("Pa", "beta", "hoop stress at rest", bounds=(-1e7, 1e7))

    def stress(self, strain: Value) -> Value:
        """Hoop stress [Pa] at a hoop strain [1]."""
        return self.slope * strain + self.intercept

    def energy(self, arc_excess: Value, arc_excess_squared: Value, end_radius: Value) -> Value:
        """Energy per wall thickness [N], U/t = 2 pi (alpha Q/(2 r_0) + beta G); linear, also valid for derivatives."""
        return 2 * pi * (self.slope * arc_excess_squared / (2 * end_radius) + self.intercept * arc_excess)

    def integrate_stress(self, excess: Value, length: Value, end_radius: Value) -> Value:
        """Integral of the hoop stress [N/m] from the integral of r - r_0 [m2] over a path and its length [m]."""
        return self.slope / end_radius * excess + self.intercept * length


class RubberIntegral(abc.ABC):
    """Path of integration of the hoop stress (interface)."""

    @abc.abstractmethod
    def hoop_stress(self, rubber: RubberLine, segment: Segment) -> Value:
        """H = Int sigma [N/m] over one segment."""


@model
class AxialIntegral(RubberIntegral):
    """Integration along the axis: H = Int sigma dx, as printed in (12) of Saga et al. 2007."""

    def hoop_stress(self, rubber: RubberLine, segment: Segment) -> Value:
        return rubber.integrate_stress(segment.excess, segment.length, segment.end_radius)


@model
class ArcIntegral(RubberIntegral):
    """Integration along the arc: H = Int sigma ds, as a hoop stress acts along the arc."""

    def hoop_stress(self, rubber: RubberLine, segment: Segment) -> Value:
        return rubber.integrate_stress(segment.arc_excess, segment.arc, segment.end_radius)

"""Rubber wall of a straight-fibre muscle: linear relation of hoop stress and strain, threshold of
contraction.
"""

import abc

from ....core import Value, model, parameter, pi
from ..geometry.meridian import Segment
from ..geometry.straight_fibre import FibreTube
from .base import Characteristic
from .solve import check_solution


@model
class RubberLine:
    """Linear rubber: sigma = alpha eps + beta,   eps = (r - r_0)/r_0.

    sigma: nominal hoop stress, referred to the initial wall thickness. With inextensible fibres the
    hoop force per arc length is sigma t, so that no correction for the decreasing thickness is
    required. A positive beta is a prestress, as in a balloon. Reference: Saga et al. 2007, (10),
    (11), Fig. 4.
    """

    slope: float = parameter(
        "Pa", "alpha", "increase of the hoop stress with strain", bounds=(0.0, 1e8)
    )
    intercept: float = parameter("Pa", "beta", "hoop stress at rest", bounds=(-1e7, 1e7))

    def stress(self, strain: Value) -> Value:
        """Hoop stress [Pa] at a hoop strain [1]."""
        return self.slope * strain + self.intercept

    def energy(self, arc_excess: Value, arc_excess_squared: Value, end_radius: Value) -> Value:
        """Energy per wall thickness [N], U/t = 2 pi (alpha Q/(2 r_0) + beta G); linear, also valid
        for derivatives.
        """
        return (
            2
            * pi
            * (self.slope * arc_excess_squared / (2 * end_radius) + self.intercept * arc_excess)
        )

    def integrate_stress(self, excess: Value, length: Value, end_radius: Value) -> Value:
        """Integral of the hoop stress [N/m] from the integral of r - r_0 [m2] over a path and its
        length [m].
        """
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


class RubberLaw(Characteristic):
    """Law of straight fibres on a rubber tube, which contracts above a threshold pressure (base
    class).
    """

    geometry: FibreTube
    rubber: RubberLine
    wall_thickness: float

    @property
    def threshold_pressure(self) -> float:
        """Gauge pressure [Pa] at which contraction starts, independent of the load: t beta/r_0."""
        return float(self.wall_thickness * self.rubber.intercept / self.geometry.end_radius)

    def check_threshold(self, pressure: Value, force: Value) -> None:
        """Raise SolveError for a gauge pressure [Pa] below the threshold; `force` is quoted."""
        above = (self.threshold_pressure, float("inf"))
        check_solution(
            pressure + 0.0 * force, above, (pressure, force), self._below_threshold_message
        )

    def _below_threshold_message(self, pressure: float, force: float) -> str:
        return (
            f"{type(self).__name__}: {pressure / 1e3:.4g} kPa is below the threshold pressure of "
            f"{self.threshold_pressure / 1e3:.4g} kPa, at which contraction starts."
        )

"""Series elements of the Hill-type muscle: compliance between the contractile element and the load."""

from __future__ import annotations

import abc

from ...core import ops
from ...core.declaration import model, parameter
from ...core.ops import Value


class SeriesElement:
    """Element in series with the contractile element (base class)."""


@model
class RigidSeriesElement(SeriesElement):
    """Rigid connection: contractile element and muscle have the same contraction, as in Hošovský et al."""


class ElasticSeriesElement(SeriesElement, abc.ABC):
    """Elastic series element (interface): a tension-only spring, at least as stiff as at zero stretch."""

    stiffness: float

    @abc.abstractmethod
    def force(self, stretch: Value) -> Value:
        """Tension [N] at a stretch [m]."""

    @abc.abstractmethod
    def tangent_stiffness(self, stretch: Value) -> Value:
        """Derivative of the tension with respect to a positive stretch [N/m]."""


@model
class SeriesSpring(ElasticSeriesElement):
    """Tension-only spring: F = k max(s, 0) with stretch s, for compliant fittings, ropes or sensors."""

    stiffness: float = parameter("N/m", "k_SE", "stiffness of the series element", bounds=(1.0, 1e9))

    def force(self, stretch: Value) -> Value:
        return self.stiffness * ops.maximum(stretch, 0.0)

    def tangent_stiffness(self, stretch: Value) -> Value:
        return self.stiffness


@model
class CubicSeriesSpring(ElasticSeriesElement):
    """Tension-only cubic spring: F = k s (1 + (s/s_h)^2), s = max(stretch, 0): its stiffness grows with the stretch.

    s_h is the stretch at which the force is twice that of the linear spring. The series element of the Hill model is
    nonlinear in Fig. 1 of Hošovský et al.; the paper prints no law, so the cubic one is chosen.
    """

    stiffness: float = parameter("N/m", "k_SE", "stiffness of the series element at zero stretch", bounds=(1.0, 1e9))
    hardening_stretch: float = parameter(
        "m", "s_h", "stretch at which the force is twice that of a linear spring", bounds=(1e-6, 10.0)
    )

    def force(self, stretch: Value) -> Value:
        positive = ops.maximum(stretch, 0.0)
        return self.stiffness * positive * (1.0 + (positive / self.hardening_stretch) ** 2)

    def tangent_stiffness(self, stretch: Value) -> Value:
        return self.stiffness * (1.0 + 3.0 * (stretch / self.hardening_stretch) ** 2)

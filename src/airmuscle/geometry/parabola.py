"""Parabolic outlines: Saga's, whose arc is only nearly the fibre's length, and the one whose arc is."""

from __future__ import annotations

import numpy as np

from ..core import ops
from ..core.arrays import Array
from ..core.declaration import model
from ..core.ops import Value
from .meridian import Meridian, Profile, Segment, segment_volume

_NODES, _WEIGHTS = (
    (0.5 * (v + shift)).tolist() for v, shift in zip(np.polynomial.legendre.leggauss(24), (1, 0), strict=True)
)


def _arc_element(slope_squared: Value, t: float) -> Value:
    """ds/dx at the fraction t of the half length, where the end slope is u: sqrt(1 + u^2 t^2)."""
    return ops.sqrt(1.0 + slope_squared * t * t)


def arc_surplus(slope_squared: Value) -> Value:
    """arc/chord - 1 = (sqrt(1 + u^2) + asinh(u)/u)/2 - 1 of a parabola with end slope u, exact down to u = 0.

    This and its kin are summed at 24 Gauss points, whose error is below rounding for u < 4: all terms are positive,
    so that nothing cancels where the closed forms do.
    """
    z = slope_squared
    return z * sum(w * t * t / (1.0 + _arc_element(z, t)) for t, w in zip(_NODES, _WEIGHTS, strict=True))


def _arc_surplus_derivative(slope_squared: Value) -> Value:
    """The derivative of `arc_surplus` by u^2."""
    return sum(0.5 * w * t * t / _arc_element(slope_squared, t) for t, w in zip(_NODES, _WEIGHTS, strict=True))


def _arc_moment(slope_squared: Value, power: int) -> Value:
    """Int_0^1 (1 - t^2)^power sqrt(1 + u^2 t^2) dt."""
    z = slope_squared
    return sum(w * (1.0 - t * t) ** power * _arc_element(z, t) for t, w in zip(_NODES, _WEIGHTS, strict=True))


def _parabolic_segment(slope: Value, slope_squared: Value, length: Value, end_radius: Value) -> Segment:
    rise = length * slope / 4
    excess = 2 * length * rise / 3
    steepness = ops.sqrt(1.0 + slope_squared)
    return Segment(
        end_radius=end_radius,
        length=length,
        arc=length * (1.0 + arc_surplus(slope_squared)),
        max_radius=end_radius + rise,
        end_sine=slope / steepness,
        end_cosine=1.0 / steepness,
        excess=excess,
        arc_excess=length * rise * _arc_moment(slope_squared, 1),
        arc_excess_squared=length * rise**2 * _arc_moment(slope_squared, 2),
        volume=segment_volume(end_radius, length, excess, 8 * length * rise**2 / 15),
    )


class _ParabolicMeridian(Meridian):
    def profile(self, contraction: float, fibre_length: float, end_radius: float, along: Array) -> Profile:
        segment = self.segment(contraction, fibre_length, end_radius)
        t = along
        rise = segment.max_radius - end_radius
        return segment.length / 2 * t, end_radius + rise * (1.0 - t * t)


@model
class Parabola(_ParabolicMeridian):
    """f(x) = -x^2/(2 a) + l^2/(8 a) + r_0,   a = sqrt(l^3/(24 (l_0 - l))).

    a [m] makes the arc l_0 to second order in the slope only: it is 0.3 % too short at 10 % contraction and 11 %
    at 40 %. End slope l/(2 a). Reference: Saga et al. 2007, equations (2), (3).
    """

    def segment(self, contraction: Value, fibre_length: Value, end_radius: Value) -> Segment:
        stretch = 1.0 - contraction
        slope_squared = 6.0 * contraction / stretch
        return _parabolic_segment(ops.sqrt(slope_squared), slope_squared, fibre_length * stretch, end_radius)


@model
class TrueArcParabola(_ParabolicMeridian):
    """The parabola whose arc is the fibre's length: (sqrt(1 + u^2) + asinh(u)/u)/2 = 1/(1 - eps), u the end slope.

    Solved for u^2 by four Newton steps from u = sqrt(6 eps)(1 + 0.95 eps), which reach rounding for eps <= 0.5.
    """

    def segment(self, contraction: Value, fibre_length: Value, end_radius: Value) -> Segment:
        z = self.slope_squared(contraction)
        return _parabolic_segment(ops.sqrt(z), z, fibre_length * (1.0 - contraction), end_radius)

    def slope_squared(self, contraction: Value) -> Value:
        """The square of the end slope at a contraction [1]."""
        wanted = contraction / (1.0 - contraction)
        z = 6.0 * contraction * (1.0 + 0.95 * contraction) ** 2
        for _ in range(5):
            z = z - (arc_surplus(z) - wanted) / _arc_surplus_derivative(z)
        return z

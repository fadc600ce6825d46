"""Parabolic meridians: the approximation of Saga et al. 2007, and the parabola with the exact fibre length."""

from __future__ import annotations

import numpy as np

from ....core import ops
from ....core.arrays import Array
from ....core.declaration import model
from ....core.ops import Value
from .meridian import Meridian, Profile, Segment, segment_volume

_NODES, _WEIGHTS = (
    (0.5 * (v + shift)).tolist() for v, shift in zip(np.polynomial.legendre.leggauss(24), (1, 0), strict=True)
)


def _arc_element(slope_squared: Value, t: float) -> Value:
    """ds/dx = sqrt(1 + u^2 t^2) at the fraction t of the half length; u is the end slope."""
    return ops.sqrt(1.0 + slope_squared * t * t)


def arc_surplus(slope_squared: Value) -> Value:
    """arc/chord - 1 = (sqrt(1 + u^2) + asinh(u)/u)/2 - 1 of a parabola with end slope u, accurate down to u = 0.

    This and the related integrals use Gauss quadrature with 24 points, whose error is below rounding for u < 4. All
    terms are positive, so that there is no cancellation, unlike in the closed forms.
    """
    z = slope_squared
    return z * sum(w * t * t / (1.0 + _arc_element(z, t)) for t, w in zip(_NODES, _WEIGHTS, strict=True))


def _arc_surplus_derivative(slope_squared: Value) -> Value:
    """Derivative of `arc_surplus` with respect to u^2."""
    return sum(0.5 * w * t * t / _arc_element(slope_squared, t) for t, w in zip(_NODES, _WEIGHTS, strict=True))


def _arc_moment(slope_squared: Value, power: int) -> Value:
    """Int_0^1 (1 - t^2)^power sqrt(1 + u^2 t^2) dt."""
    z = slope_squared
    return sum(w * (1.0 - t * t) ** power * _arc_element(z, t) for t, w in zip(_NODES, _WEIGHTS, strict=True))


def _parabolic_segment(slope: Value, slope_squared: Value, length: Value, end_radius: Value) -> Segment:
    """Segment with a parabolic meridian of this end slope, chord length [m] and end radius [m]."""
    rise = length * slope / 4
    rise_squared = length**2 * slope_squared / 16  # not rise**2, whose derivative is 0 times infinity at rest
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
        arc_excess_squared=length * rise_squared * _arc_moment(slope_squared, 2),
        volume=segment_volume(end_radius, length, excess, 8 * length * rise_squared / 15),
    )


class _ParabolicMeridian(Meridian):
    """Common profile of the parabolic meridians."""

    def profile(self, contraction: float, fibre_length: float, end_radius: float, position: Array) -> Profile:
        segment = self.segment(contraction, fibre_length, end_radius)
        t = position
        rise = segment.max_radius - end_radius
        return segment.length / 2 * t, end_radius + rise * (1.0 - t * t)


@model
class Parabola(_ParabolicMeridian):
    """Parabola: f(x) = -x^2/(2 a) + l^2/(8 a) + r_0,   a = sqrt(l^3/(24 (l_0 - l))).

    With this a [m] the arc equals l_0 to second order in the slope only: it is 0.3 % too short at 10 % contraction
    and 11 % at 40 %. The end slope is l/(2 a). Reference: Saga et al. 2007, equations (2), (3).
    """

    def segment(self, contraction: Value, fibre_length: Value, end_radius: Value) -> Segment:
        stretch = 1.0 - contraction
        slope_squared = 6.0 * contraction / stretch
        return _parabolic_segment(ops.sqrt(slope_squared), slope_squared, fibre_length * stretch, end_radius)


@model
class TrueArcParabola(_ParabolicMeridian):
    """Parabola whose arc equals the fibre length: (sqrt(1 + u^2) + asinh(u)/u)/2 = 1/(1 - eps), u: end slope.

    u^2 is computed by five Newton steps from u = sqrt(6 eps)(1 + 0.95 eps), which converge to rounding precision for
    eps <= 0.5.
    """

    def segment(self, contraction: Value, fibre_length: Value, end_radius: Value) -> Segment:
        z = self.slope_squared(contraction)
        return _parabolic_segment(ops.sqrt(z), z, fibre_length * (1.0 - contraction), end_radius)

    def slope_squared(self, contraction: Value) -> Value:
        """Square of the end slope at a contraction [1]."""
        target = contraction / (1.0 - contraction)
        z = 6.0 * contraction * (1.0 + 0.95 * contraction) ** 2
        for _ in range(5):
            z = z - (arc_surplus(z) - target) / _arc_surplus_derivative(z)
        return z

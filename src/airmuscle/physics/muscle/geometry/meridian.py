"""Meridians of a straight-fibre muscle: parabolas and catenary of Saga et al. 2007, circular arc;
their integrals.
"""

import abc
import math
from typing import ClassVar, NamedTuple

import numpy as np

from ....core import Array, Reference, Value, model, ops, published
from .base import Profile

SAGA_2007 = published("saga-2007")
FERRARESI_2001 = published("ferraresi-2001")


class Segment(NamedTuple):
    """One segment of the muscle at a contraction. x: axial position; r: radius; s: arc length; r_0:
    end radius.

    length               chord l [m]
    arc                  Int ds [m]; equal to the fibre length except for approximate meridians
    max_radius           radius in the middle [m]
    end_sine, end_cosine of the end slope angle phi_0; the cosine is negative beyond a right angle
    excess               Int (r - r_0) dx [m2]
    arc_excess, arc_excess_squared    G = Int (r - r_0) ds [m2], Q = Int (r - r_0)^2 ds [m3]
    volume               enclosed volume [m3]
    """

    end_radius: Value
    length: Value
    arc: Value
    max_radius: Value
    end_sine: Value
    end_cosine: Value
    excess: Value
    arc_excess: Value
    arc_excess_squared: Value
    volume: Value

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
    """Above 50 % every meridian is beyond its maximum volume or, for the parabola (3), beyond its
    maximum radius.
    """

    @abc.abstractmethod
    def segment(self, contraction: Value, fibre_length: Value, end_radius: Value) -> Segment:
        """Shape and integrals of the segment at a contraction [1]; lengths in [m]; arrays
        broadcast.
        """

    @abc.abstractmethod
    def profile(
        self, contraction: float, fibre_length: float, end_radius: float, position: Array
    ) -> Profile:
        """Axial positions from the middle [m] and radii [m] at normalised positions from -1 to 1
        along the outline.
        """


def segment_volume(end_radius: Value, length: Value, excess: Value, excess_squared: Value) -> Value:
    """pi Int r^2 dx from Int (r - r_0) dx and Int (r - r_0)^2 dx."""
    return ops.pi * (end_radius**2 * length + 2 * end_radius * excess + excess_squared)


TERMS = 18
"""Number of terms; the first omitted term is below 1e-18 of the sum for |w| <= 45, the range of the
meridians.
"""
_COEFFICIENTS = tuple(
    tuple(1.0 / math.factorial(m + 2 * n) for n in range(TERMS)) for m in range(6)
)


def stumpff(order: int, w: Value) -> Value:
    """Stumpff function S_m(w) = Sum_n w^n / (m + 2 n)! of an order m from 0 to 5.

    S_0 = cosh u, S_1 = sinh(u)/u, S_2 = (cosh u - 1)/u^2, S_3 = (sinh u - u)/u^3 with w = u^2, and
    accordingly for cos and sin with w = -psi^2, without the cancellation of sines and cosines in
    the formulas of a flat arc.
    """
    return ops.polynomial(_COEFFICIENTS[order], w)


def double_angle_term(w: Value) -> Value:
    """(u (cosh 2u + 2) - (3/2) sinh 2u)/u^5 with w = u^2, or with cos and sin of psi for w =
    -psi^2; 8/15 at zero.
    """
    return 16 * (stumpff(4, 4 * w) - 3 * stumpff(5, 4 * w))


def triple_angle_term(w: Value) -> Value:
    """(sinh(3u)/6 + (3/2) sinh u - 2 u cosh u)/u^5, or with cos and sin of psi for w = -psi^2; 4/15
    at zero.
    """
    return 40.5 * stumpff(5, 9 * w) + 1.5 * stumpff(5, w) - 2 * stumpff(4, w)


_nodes, _weights = np.polynomial.legendre.leggauss(24)
_RULE = list(zip((0.5 * (_nodes + 1)).tolist(), (0.5 * _weights).tolist(), strict=True))
"""Nodes and weights of Gauss quadrature over 0 <= t <= 1."""


def _arc_element(slope_squared: Value, t: float) -> Value:
    """ds/dx = sqrt(1 + u^2 t^2) at the fraction t of the half length; u is the end slope."""
    return ops.sqrt(1.0 + slope_squared * t * t)


def arc_surplus(slope_squared: Value) -> Value:
    """arc/chord - 1 = (sqrt(1 + u^2) + asinh(u)/u)/2 - 1 of a parabola with end slope u, accurate
    down to u = 0.

    This and the related integrals use Gauss quadrature with 24 points, whose error is below
    rounding for u < 4. All terms are positive, so that there is no cancellation, unlike in the
    closed forms.
    """
    return slope_squared * sum(w * t * t / (1.0 + _arc_element(slope_squared, t)) for t, w in _RULE)


def _arc_moment(slope_squared: Value, power: int) -> Value:
    """Int_0^1 (1 - t^2)^power sqrt(1 + u^2 t^2) dt."""
    return sum(w * (1.0 - t * t) ** power * _arc_element(slope_squared, t) for t, w in _RULE)


class ParabolicMeridian(Meridian):
    """Parabola with a chord of the contracted length and an end slope u (base class)."""

    @abc.abstractmethod
    def slope_squared(self, contraction: Value) -> Value:
        """Square of the end slope at a contraction [1]."""

    def segment(self, contraction: Value, fibre_length: Value, end_radius: Value) -> Segment:
        z = self.slope_squared(contraction)
        length = fibre_length * (1.0 - contraction)
        slope = ops.sqrt(z)
        rise = length * slope / 4
        rise_squared = (
            length**2 * z / 16
        )  # not rise**2, whose derivative is 0 times infinity at rest
        excess = 2 * length * rise / 3
        steepness = ops.sqrt(1.0 + z)
        return Segment(
            end_radius=end_radius,
            length=length,
            arc=length * (1.0 + arc_surplus(z)),
            max_radius=end_radius + rise,
            end_sine=slope / steepness,
            end_cosine=1.0 / steepness,
            excess=excess,
            arc_excess=length * rise * _arc_moment(z, 1),
            arc_excess_squared=length * rise_squared * _arc_moment(z, 2),
            volume=segment_volume(end_radius, length, excess, 8 * length * rise_squared / 15),
        )

    def profile(
        self, contraction: float, fibre_length: float, end_radius: float, position: Array
    ) -> Profile:
        segment = self.segment(contraction, fibre_length, end_radius)
        rise = segment.max_radius - end_radius
        return segment.length / 2 * position, end_radius + rise * (1.0 - position * position)


@model
class Parabola(ParabolicMeridian):
    """Parabola: f(x) = -x^2/(2 a) + l^2/(8 a) + r_0,   a = sqrt(l^3/(24 (l_0 - l))).

    With this a [m] the arc equals l_0 to second order in the slope only: it is 0.3 % too short at
    10 % contraction and 11 % at 40 %. The end slope is l/(2 a). Reference: Saga et al. 2007,
    equations (2), (3).
    """

    def slope_squared(self, contraction: Value) -> Value:
        return 6.0 * contraction / (1.0 - contraction)


@model
class TrueArcParabola(ParabolicMeridian):
    """Parabola whose arc equals the fibre length: (sqrt(1 + u^2) + asinh(u)/u)/2 = 1/(1 - eps), u:
    end slope.

    u^2 is computed by five Newton steps from u = sqrt(6 eps)(1 + 0.95 eps), which converge to
    rounding precision for eps <= 0.5.
    """

    def slope_squared(self, contraction: Value) -> Value:
        target = contraction / (1.0 - contraction)
        z = 6.0 * contraction * (1.0 + 0.95 * contraction) ** 2
        for _ in range(5):
            derivative = sum(0.5 * w * t * t / _arc_element(z, t) for t, w in _RULE)
            z = z - (arc_surplus(z) - target) / derivative
        return z


@model
class Catenary(Meridian):
    """Catenary: r = r_0 + a (cosh u - cosh(x/a)),   sinh(u)/u = 1/(1 - eps),   a = l/(2 u).

    a: catenary parameter [m]; l: chord [m]; sinh u: end slope. u^2 is computed by Newton steps from
    u = sqrt(6 eps)(1 + 0.35 eps); four steps converge to rounding precision for eps <= 0.5.
    Reference: Saga et al. 2007, equation (1), with the arc equal to the fibre length.
    """

    def segment(self, contraction: Value, fibre_length: Value, end_radius: Value) -> Segment:
        w = self.shape_squared(contraction)
        u = ops.sqrt(w)
        half = fibre_length * (1.0 - contraction) / 2
        excess = 2 * half**2 * u * (stumpff(2, w) - stumpff(3, w))
        return Segment(
            end_radius=end_radius,
            length=2 * half,
            arc=fibre_length,
            max_radius=end_radius + half * u * stumpff(2, w),
            end_sine=u * stumpff(1, w) / stumpff(0, w),
            end_cosine=1.0 / stumpff(0, w),
            excess=excess,
            arc_excess=4 * half**2 * u * stumpff(3, 4 * w),
            arc_excess_squared=half**3 * w * triple_angle_term(w),
            volume=segment_volume(end_radius, 2 * half, excess, half**3 * w * double_angle_term(w)),
        )

    def shape_squared(self, contraction: Value) -> Value:
        """u^2 at a contraction [1]."""
        target = contraction / (1.0 - contraction)
        w = 6.0 * contraction * (1.0 + 0.35 * contraction) ** 2
        for _ in range(4):
            w = w - 2 * (w * stumpff(3, w) - target) / (stumpff(2, w) - stumpff(3, w))
        return w

    def profile(
        self, contraction: float, fibre_length: float, end_radius: float, position: Array
    ) -> Profile:
        w = self.shape_squared(contraction)
        half = fibre_length * (1.0 - contraction) / 2
        t = position
        # cosh u - cosh(u t) as a product of hyperbolic sines, without cancellation for a flat arc
        product = stumpff(1, w * (1 + t) ** 2 / 4) * stumpff(1, w * (1 - t) ** 2 / 4)
        return half * t, end_radius + half * ops.sqrt(w) * product * (1 - t * t) / 2


class SegmentDerivatives(NamedTuple):
    """Derivatives of the integrals of one segment by contraction: dV/deps [m3], dG/deps [m2] and
    dQ/deps [m3].
    """

    volume: Value
    arc_excess: Value
    arc_excess_squared: Value


@model
class CircularArc(Meridian):
    """Circular arc: r = r_0 + rho (cos t - cos psi), |t| <= psi,   sin(psi)/psi = 1 - eps,   rho =
    l_0/(2 psi).

    rho: radius of the arc [m]; psi: half angle [rad], a right angle at eps = 1 - 2/pi = 36.3 %.
    psi^2 is computed by Newton steps from psi = sqrt(6 eps)(1 + 0.15 eps); four steps converge to
    rounding precision for eps <= 0.5. Reference: Ferraresi et al. 2001.
    """

    references: ClassVar[tuple[Reference, ...]] = (FERRARESI_2001,)

    def segment(self, contraction: Value, fibre_length: Value, end_radius: Value) -> Segment:
        z = self.angle_squared(contraction)
        psi = ops.sqrt(z)
        length = fibre_length * (1.0 - contraction)
        excess = fibre_length**2 * psi * stumpff(3, -4 * z)
        return Segment(
            end_radius=end_radius,
            length=length,
            arc=fibre_length,
            max_radius=end_radius + fibre_length * psi * stumpff(2, -z) / 2,
            end_sine=ops.sin(psi),
            end_cosine=ops.cos(psi),
            excess=excess,
            arc_excess=fibre_length**2 * psi * (stumpff(2, -z) - stumpff(3, -z)) / 2,
            arc_excess_squared=fibre_length**3 * z * double_angle_term(-z) / 8,
            volume=segment_volume(
                end_radius, length, excess, fibre_length**3 * z * triple_angle_term(-z) / 8
            ),
        )

    def angle_squared(self, contraction: Value) -> Value:
        """psi^2 at a contraction [1]."""
        z = 6.0 * contraction * (1.0 + 0.15 * contraction) ** 2
        for _ in range(4):
            z = z - 2 * (z * stumpff(3, -z) - contraction) / (stumpff(2, -z) - stumpff(3, -z))
        return z

    def derivatives_times_angle(
        self, angle_squared: Value, fibre_length: Value, end_radius: Value
    ) -> SegmentDerivatives:
        """psi times the derivatives of the integrals; finite at psi = 0, where the derivatives are
        infinite.

        From d eps/d psi = psi (S_2 - S_3) and the derivatives of the closed forms with respect to
        psi, w = -psi^2.
        """
        z = angle_squared
        angle_derivative = stumpff(2, -z) - stumpff(3, -z)
        excess = fibre_length**2 * (stumpff(2, -4 * z) - 2 * stumpff(3, -4 * z))
        squared = fibre_length**3 * (
            stumpff(1, -z) * stumpff(3, -4 * z) - 0.375 * triple_angle_term(-z)
        )
        psi = ops.sqrt(z)
        rise = 2 * end_radius * excess + squared * psi
        moment = stumpff(3, -4 * z) - 5 * stumpff(4, -4 * z) + 9 * stumpff(5, -4 * z)
        return SegmentDerivatives(
            volume=ops.pi * (rise / angle_derivative - end_radius**2 * fibre_length * psi),
            arc_excess=fibre_length**2 * (stumpff(1, -z) / 2 / angle_derivative - 1.0),
            arc_excess_squared=2 * fibre_length**3 * psi * moment / angle_derivative,
        )

    def profile(
        self, contraction: float, fibre_length: float, end_radius: float, position: Array
    ) -> Profile:
        z = self.angle_squared(contraction)
        t = position
        # cos(psi t) - cos psi as a product of sines, without cancellation for a flat arc
        product = stumpff(1, -z * (1 + t) ** 2 / 4) * stumpff(1, -z * (1 - t) ** 2 / 4)
        rise = fibre_length * ops.sqrt(z) * product * (1 - t * t) / 4
        return fibre_length / 2 * t * stumpff(1, -z * t * t), end_radius + rise

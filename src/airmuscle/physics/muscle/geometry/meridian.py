"""Meridian (interface): outline of one segment between two rings, its integrals, and functions for these."""

import abc
import functools
import math
from typing import ClassVar, NamedTuple

import numpy as np

from ....core import Array, Reference, Value, ops, published
from .base import Profile

SAGA_2007 = published("saga-2007")


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


TERMS = 18
"""Number of terms; the first omitted term is below 1e-18 of the sum for |w| <= 45, the range of the meridians."""

_COEFFICIENTS = tuple(tuple(1.0 / math.factorial(m + 2 * n) for n in range(TERMS)) for m in range(6))


def stumpff(order: int, w: Value) -> Value:
    """Stumpff function S_m(w) = Sum_n w^n / (m + 2 n)! of an order m from 0 to 5.

    S_0 = cosh u, S_1 = sinh(u)/u, S_2 = (cosh u - 1)/u^2, S_3 = (sinh u - u)/u^3 with w = u^2, and accordingly for cos
    and sin with w = -psi^2, without the cancellation of sines and cosines in the formulas of a flat arc.
    """
    return ops.polynomial(_COEFFICIENTS[order], w)


def double_angle_term(w: Value) -> Value:
    """(u (cosh 2u + 2) - (3/2) sinh 2u)/u^5 with w = u^2, or with cos and sin of psi for w = -psi^2; 8/15 at zero."""
    return 16 * (stumpff(4, 4 * w) - 3 * stumpff(5, 4 * w))


def triple_angle_term(w: Value) -> Value:
    """(sinh(3u)/6 + (3/2) sinh u - 2 u cosh u)/u^5, or with cos and sin of psi for w = -psi^2; 4/15 at zero."""
    return 40.5 * stumpff(5, 9 * w) + 1.5 * stumpff(5, w) - 2 * stumpff(4, w)


@functools.cache
def graded_quadrature(nodes: int) -> tuple[Array, Array]:
    """Nodes v and weights, shape (nodes,) each, for integrals over 0 <= v <= 1 with a factor like 1/sqrt(1 - v).

    The nodes are Gauss points y in v = y (2 - y), so that 1 - v = (1 - y)^2 removes the singularity at v = 1. The
    integral is sum(weights f(nodes)).
    """
    points, weights = np.polynomial.legendre.leggauss(nodes)
    y = (points + 1) / 2
    return y * (2 - y), weights * (1 - y)

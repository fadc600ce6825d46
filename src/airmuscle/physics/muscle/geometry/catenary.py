"""Catenary meridian: equation (1) of Saga et al. 2007 without its second-order approximation."""

from __future__ import annotations

from ....core import ops
from ....core.arrays import Array
from ....core.declaration import model
from ....core.ops import Value
from .meridian import Meridian, Profile, Segment, segment_volume
from .stumpff import double_angle_term, stumpff, triple_angle_term


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

    def profile(self, contraction: float, fibre_length: float, end_radius: float, position: Array) -> Profile:
        w = self.shape_squared(contraction)
        half = fibre_length * (1.0 - contraction) / 2
        t = position
        # cosh u - cosh(u t) as a product of hyperbolic sines, without cancellation for a flat arc
        product = stumpff(1, w * (1 + t) ** 2 / 4) * stumpff(1, w * (1 - t) ** 2 / 4)
        return half * t, end_radius + half * ops.sqrt(w) * product * (1 - t * t) / 2

"""Circular-arc meridian (Ferraresi et al. 2001), the most accurate simple meridian under virtual work."""

from __future__ import annotations

from typing import ClassVar, NamedTuple

from ....core import ops
from ....core.arrays import Array
from ....core.declaration import model
from ....core.ops import Value
from ....core.reference import Reference
from .meridian import Meridian, Profile, Segment, segment_volume
from .stumpff import double_angle_term, stumpff, triple_angle_term

FERRARESI_2001 = Reference(
    "ferraresi-2001",
    "Ferraresi, C., Franco, W., Manuello Bertetto, A.",
    "Flexible Pneumatic Actuators: A Comparison between the McKibben and the Straight Fibres Muscles",
    "Journal of Robotics and Mechatronics 13(1), 56 ff.",
    2001,
    note="circular meridian, balance at the middle section; secondary source: Saga et al. 2007, with errors",
)


class SegmentDerivatives(NamedTuple):
    """Derivatives of the integrals of one segment with respect to contraction."""

    volume: Value
    """dV/deps [m3]."""
    arc_excess: Value
    """dG/deps [m2]."""
    arc_excess_squared: Value
    """dQ/deps [m3]."""


@model
class CircularArc(Meridian):
    """Circular arc: r = r_0 + rho (cos t - cos psi), |t| <= psi,   sin(psi)/psi = 1 - eps,   rho = l_0/(2 psi).

    rho: radius of the arc [m]; psi: half angle [rad], a right angle at eps = 1 - 2/pi = 36.3 %. psi^2 is computed by
    Newton steps from psi = sqrt(6 eps)(1 + 0.15 eps); four steps converge to rounding precision for eps <= 0.5.
    Reference: Ferraresi et al. 2001.
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
            volume=segment_volume(end_radius, length, excess, fibre_length**3 * z * triple_angle_term(-z) / 8),
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
        """psi times the derivatives of the integrals; finite at psi = 0, where the derivatives are infinite.

        From d eps/d psi = psi (S_2 - S_3) and the derivatives of the closed forms with respect to psi, w = -psi^2.
        """
        z = angle_squared
        angle_derivative = stumpff(2, -z) - stumpff(3, -z)
        excess = fibre_length**2 * (stumpff(2, -4 * z) - 2 * stumpff(3, -4 * z))
        squared = fibre_length**3 * (stumpff(1, -z) * stumpff(3, -4 * z) - 0.375 * triple_angle_term(-z))
        psi = ops.sqrt(z)
        rise = 2 * end_radius * excess + squared * psi
        moment = stumpff(3, -4 * z) - 5 * stumpff(4, -4 * z) + 9 * stumpff(5, -4 * z)
        return SegmentDerivatives(
            volume=ops.pi * (rise / angle_derivative - end_radius**2 * fibre_length * psi),
            arc_excess=fibre_length**2 * (stumpff(1, -z) / 2 / angle_derivative - 1.0),
            arc_excess_squared=2 * fibre_length**3 * psi * moment / angle_derivative,
        )

    def profile(self, contraction: float, fibre_length: float, end_radius: float, position: Array) -> Profile:
        z = self.angle_squared(contraction)
        t = position
        # cos(psi t) - cos psi as a product of sines, without cancellation for a flat arc
        product = stumpff(1, -z * (1 + t) ** 2 / 4) * stumpff(1, -z * (1 - t) ** 2 / 4)
        rise = fibre_length * ops.sqrt(z) * product * (1 - t * t) / 4
        return fibre_length / 2 * t * stumpff(1, -z * t * t), end_radius + rise

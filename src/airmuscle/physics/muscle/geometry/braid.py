"""Inextensible cylindrical braid of McKibben, Shadow and Festo fluidic muscles."""

from typing import ClassVar

from ....core import Reference, Value, model, ops, parameter, published
from .base import LENGTHS, RESTING_LENGTH, Geometry

CHOU_HANNAFORD_1996 = published("chou-hannaford-1996")


@model
class Braid(Geometry):
    """Cylindrical braid of inextensible threads of length b, each wound n times around the
    cylinder.

        cos(theta) = (1 - eps) cos(theta_0),   r = r_0 sin(theta)/sin(theta_0),   V = pi r^2 L

    theta: angle between threads and axis; r_0, theta_0: radius and angle at rest; L = L_0 (1 -
    eps): length. Identical to the formula of Chou and Hannaford (1996) with b = L_0/cos(theta_0)
    and n = b sin(theta_0)/(2 pi r_0).
    """

    references: ClassVar[tuple[Reference, ...]] = (CHOU_HANNAFORD_1996,)

    radius: float = parameter("m", "r_0", "radius of the braid at rest", bounds=(1e-4, 0.2))
    braid_angle: float = parameter(
        "rad", "theta_0", "angle between the threads and the axis at rest", bounds=(0.05, 1.5)
    )
    resting_length: float = parameter(*RESTING_LENGTH, bounds=LENGTHS, fitted=False)

    @property
    def contraction_range(self) -> tuple[float, float]:
        """From straight threads to zero length."""
        return (1.0 - 1.0 / ops.cos(self.braid_angle), 1.0)

    def volume(self, contraction: Value) -> Value:
        stretch = 1.0 - contraction
        sine_squared = 1.0 - (stretch * ops.cos(self.braid_angle)) ** 2
        return (
            ops.pi
            * self.radius**2
            * self.resting_length
            * stretch
            * sine_squared
            / ops.sin(self.braid_angle) ** 2
        )

    def radius_at(self, contraction: Value) -> Value:
        sine = ops.sqrt(1.0 - ((1.0 - contraction) * ops.cos(self.braid_angle)) ** 2)
        return self.radius * sine / ops.sin(self.braid_angle)

"""Rubber tube of stated wall inside a braid, as one that is made by hand."""

from typing import ClassVar

from ....core import ParameterError, Reference, Value, model, ops, parameter, published
from .base import LENGTHS, RESTING_LENGTH, Geometry
from .braid import CHOU_HANNAFORD_1996

KLUTE_HANNAFORD_2000 = published("klute-hannaford-2000")


@model
class BraidedTube(Geometry):
    """Incompressible rubber tube that fills a braid of inextensible threads.

        lambda = (L - l_e)/(L_0 - l_e),   cos(theta) = lambda cos(theta_0)
        r = r_0 sin(theta)/sin(theta_0),  r_o = r - d,   r_0 = R_i + h + g + d
        V = pi r_o^2 (L - l_e) - V_w + pi R_i^2 l_e
        V_w = pi ((R_i + h)^2 - R_i^2) (L_0 - l_e)

    lambda: length of the part between the ends, relative to rest; theta, r: angle and radius of the
    threads; r_o: outer radius of the tube, on which the braid lies; V_w: volume of its wall, which
    is constant; d: distance of the threads from the tube; g: gap between tube and braid at rest;
    l_e: length at the ends, which does not contract. Without wall, distance and ends it is `Braid`.
    Reference: the braid is that of Chou and Hannaford (1996), the wall of constant volume that of
    Klute and Hannaford (2000).
    """

    references: ClassVar[tuple[Reference, ...]] = (CHOU_HANNAFORD_1996, KLUTE_HANNAFORD_2000)

    bore_radius: float = parameter(
        "m", "R_i", "inner radius of the tube, free of load", bounds=(1e-4, 0.2), fitted=False
    )
    wall_thickness: float = parameter(
        "m",
        "h",
        "thickness of the wall of the tube, free of load",
        bounds=(1e-5, 0.05),
        fitted=False,
    )
    braid_angle: float = parameter(
        "rad", "theta_0", "angle between the threads and the axis at rest", bounds=(0.05, 1.5)
    )
    resting_length: float = parameter(*RESTING_LENGTH, bounds=LENGTHS, fitted=False)
    thread_distance: float = parameter(
        "m",
        "d",
        "distance between the tube and the middle of the braid: one diameter of a thread",
        bounds=(0.0, 0.01),
        default=0.0,
        fitted=False,
    )
    clearance: float = parameter(
        "m",
        "g",
        "gap between tube and braid at rest, at each side",
        bounds=(0.0, 0.1),
        default=0.0,
        fitted=False,
    )
    inactive_length: float = parameter(
        "m",
        "l_e",
        "length at both ends together that does not contract",
        bounds=(0.0, 1.0),
        default=0.0,
    )

    def check(self) -> None:
        """Raise ParameterError for ends without a middle."""
        if self.inactive_length >= 0.9 * self.resting_length:
            raise ParameterError(
                f"BraidedTube: inactive_length is {1e3 * self.inactive_length:.4g} mm of a muscle"
                f" of {1e3 * self.resting_length:.4g} mm; it must be less than nine tenths."
            )

    @property
    def radius(self) -> Value:
        """Radius [m] of the threads at rest, r_0 = R_i + h + g + d."""
        return self.outer_radius + self.clearance + self.thread_distance

    @property
    def contraction_range(self) -> tuple[float, float]:
        """From the tube at rest to zero length of the part between the ends."""
        return (0.0, 1.0 - self.inactive_length / self.resting_length)

    @property
    def outer_radius(self) -> Value:
        """Outer radius [m] of the tube, free of load."""
        return self.bore_radius + self.wall_thickness

    @property
    def active_length(self) -> Value:
        """Length [m] at rest of the part that contracts."""
        return self.resting_length - self.inactive_length

    @property
    def wall_area(self) -> Value:
        """Cross-sectional area [m2] of the wall, free of load."""
        return ops.pi * (self.outer_radius**2 - self.bore_radius**2)

    def stretch(self, contraction: Value) -> Value:
        """Length of the part between the ends relative to rest [1] at a contraction [1]."""
        return 1.0 - contraction * self.resting_length / self.active_length

    def thread_radius(self, stretch: Value) -> Value:
        """Radius of the threads [m] at a stretch [1] of the part between the ends."""
        sine = ops.sqrt(1.0 - (stretch * ops.cos(self.braid_angle)) ** 2)
        return self.radius * sine / ops.sin(self.braid_angle)

    def radius_at(self, contraction: Value) -> Value:
        return self.thread_radius(self.stretch(contraction))

    def volume(self, contraction: Value) -> Value:
        stretch = self.stretch(contraction)
        outer = self.thread_radius(stretch) - self.thread_distance
        middle = self.active_length * (ops.pi * outer**2 * stretch - self.wall_area)
        return middle + ops.pi * self.bore_radius**2 * self.inactive_length

"""Braided muscle with a thick wall of Mooney-Rivlin rubber, known before it is made."""

from typing import ClassVar

from ....core import Reference, Value, model, ops, parameter, published
from ..geometry.braided_tube import KLUTE_HANNAFORD_2000, BraidedTube
from .base import ForceLaw

_FLATTEST_THREADS = 3.0**-0.5
"""Cosine of the angle between threads and axis at the greatest volume of a braid."""


@model
class MooneyRivlinTube(ForceLaw):
    """Tube of incompressible Mooney-Rivlin rubber in a braid: F = max(0, dU/dL - p dV/dL).

        U = 2 pi (L_0 - l_e) (C_1 A + C_2 B),   S = R_o^2 - R_i^2,   R_o = R_i + h
        A = J + (lambda^2 - 3) S/2,   B = lambda^2 J + (lambda^-2 - 3) S/2
        J = c ln(R_o r_i/(R_i r_o)) + S/lambda
        c = r_o^2 - R_o^2/lambda,   r_i^2 = r_o^2 - S/lambda

    U: energy of the wall, the integral of C_1 (I_1 - 3) + C_2 (I_2 - 3) over its thickness; r_i,
    r_o: inner and outer radius of the tube; lambda, V and the other symbols are those of
    `BraidedTube`. The wall is thick and incompressible, its ends slide without shear. C_2 = 0 is
    neo-Hookean rubber of Young's modulus 6 C_1. A braid that is wider than the tube at rest gives a
    dead zone: below the pressure that presses the tube against the braid the muscle is slack.
    Friction of the threads is not contained. Reference: method of Klute and Hannaford (2000), who
    take one mean stretch for the wall; here it is integrated.
    """

    references: ClassVar[tuple[Reference, ...]] = (
        KLUTE_HANNAFORD_2000,
        published("rivlin-1949"),
    )

    geometry: BraidedTube
    c1: float = parameter(
        "Pa", "C_1", "first constant of the rubber; a sixth of Young's modulus", bounds=(0.0, 1e8)
    )
    c2: float = parameter(
        "Pa", "C_2", "second constant of the rubber", bounds=(0.0, 1e8), default=0.0, fitted=False
    )

    @property
    def contraction_range(self) -> tuple[float, float]:
        """From the tube at rest to the greatest volume of the braid."""
        stretch = _FLATTEST_THREADS / ops.cos(self.geometry.braid_angle)
        active = self.geometry.active_length / self.geometry.resting_length
        return (0.0, (1.0 - stretch) * active)

    @property
    def threshold_pressure(self) -> float:
        """Least gauge pressure [Pa] at which the muscle pulls at rest: the dead zone of a braid
        that is wider than the tube; 0 if the tube fills it.
        """
        if self.geometry.clearance == 0.0:
            return 0.0
        without = float(self.unclamped_force(0.0, 0.0))
        by_pressure = float(self.unclamped_force(1.0, 0.0)) - without
        return max(0.0, -without / by_pressure)

    def force(self, pressure: Value, contraction: Value) -> Value:
        return ops.maximum(self.unclamped_force(pressure, contraction), 0.0)

    def unclamped_force(self, pressure: Value, contraction: Value) -> Value:
        geometry = self.geometry
        stretch = geometry.stretch(contraction)
        radius = geometry.thread_radius(stretch)
        pitch = geometry.radius / ops.tan(geometry.braid_angle)
        widening = -(pitch**2) * stretch / radius
        outer = radius - geometry.thread_distance
        volume_by_length = ops.pi * outer * (outer + 2.0 * stretch * widening)
        wall = self._wall_force(stretch, outer, widening)
        return wall - pressure * volume_by_length

    def _wall_force(self, stretch: Value, outer: Value, widening: Value) -> Value:
        """Tension of the wall dU/dL [N], at a stretch [1] and an outer radius [m] that changes with
        it by `widening` [m].
        """
        section = self.geometry.wall_area / ops.pi
        free_squared = self.geometry.outer_radius**2
        inner_squared = outer**2 - section / stretch
        excess = outer**2 - free_squared / stretch
        free_ratio = free_squared / self.geometry.bore_radius**2
        ratio = outer**2 / inner_squared
        logarithm = 0.5 * ops.log(free_ratio / ratio)
        integral = excess * logarithm + section / stretch
        thinning = excess * section / inner_squared
        by_stretch = free_squared * logarithm + 0.5 * thinning - section
        by_radius = 2.0 * outer * logarithm + thinning / (stretch * outer)
        slope = by_stretch / stretch**2
        slope = slope + by_radius * widening
        first = slope + stretch * section
        second = 2.0 * stretch * integral + stretch**2 * slope - section / stretch**3
        energy_slope = self.c1 * first + self.c2 * second
        return 2.0 * ops.pi * energy_slope

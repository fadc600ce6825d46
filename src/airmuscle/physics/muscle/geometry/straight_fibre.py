"""Straight-fibre geometry: a tube with axial fibres between rings; force resultant of the fibres."""

import abc

import numpy as np

from ....core import Array, Value, model, ops, parameter, within
from .base import LENGTHS, RESTING_LENGTH, Geometry, Profile, check_contraction_range
from .meridian import CircularArc, Meridian, Segment


class FibreSum(abc.ABC):
    """M = Sum sin(theta_n) over the half section, theta_n = (pi/m)(2 n + 1): Saga et al. 2007, (13), (15)."""

    @abc.abstractmethod
    def sum_of_sines(self, fibres: int) -> Value:
        """M [1] for m = `fibres`."""


@model
class PrintedFibreSum(FibreSum):
    """Sum over n = 0..m/2, as (15) is printed: one fibre lies beyond pi and is subtracted; 4.93074 for 16 fibres."""

    def sum_of_sines(self, fibres: int) -> Value:
        return 1.0 / ops.sin(ops.pi / fibres) - ops.sin(ops.pi / fibres)


@model
class HalfShellFibreSum(FibreSum):
    """Sum over n = 0..m/2 - 1, the fibres of the half section: 1/sin(pi/m); 5.12583 for 16 fibres."""

    def sum_of_sines(self, fibres: int) -> Value:
        return 1.0 / ops.sin(ops.pi / fibres)


@model
class UniformFibreSum(FibreSum):
    """Continuous distribution of fibres: m/pi, as axial symmetry requires; 5.09296 for 16 fibres."""

    def sum_of_sines(self, fibres: int) -> Value:
        return fibres / ops.pi


@model
class UserDefinedFibreSum(FibreSum):
    """User-defined value, for sensitivity studies."""

    value: float = parameter("1", "M", "sum of the sines of the fibre angles", bounds=(0.1, 1e3), fitted=False)

    def sum_of_sines(self, fibres: int) -> Value:
        return self.value


@model
class FibreTube(Geometry):
    """Straight inextensible fibres between rings of equal diameter: n rings form n + 1 equal segments in series.

    Each segment has the fibre length l_0 = L_0/(n + 1) and the contraction of the whole muscle. The width of a ring is
    neglected. Equal division by the rings is inferred; Saga et al. 2007 do not state it.
    """

    resting_length: float = parameter(*RESTING_LENGTH, bounds=LENGTHS, fitted=False)
    end_diameter: float = parameter("m", "d_0", "diameter at the ends and rings", bounds=(1e-4, 0.5), fitted=False)
    rings: int = within(0, 1_000_000, default=0)

    @property
    def end_radius(self) -> Value:
        """r_0 = d_0/2 [m]."""
        return self.end_diameter / 2

    @property
    def segments(self) -> int:
        """Number of segments n + 1 for n rings."""
        return self.rings + 1

    @property
    def fibre_length(self) -> Value:
        """Fibre length l_0 [m] of one segment."""
        return self.resting_length / self.segments

    @abc.abstractmethod
    def segment(self, contraction: Value) -> Segment:
        """Shape and integrals of one segment at a contraction [1]. Raises GeometryLimitError outside the range."""

    @abc.abstractmethod
    def profile(self, contraction: float, position: Array) -> Profile:
        """Axial positions from the middle of a segment [m] and radii [m] at normalised positions from -1 to 1."""

    def volume(self, contraction: Value) -> Value:
        return self.segments * self.segment(contraction).volume

    def outline(self, contraction: float, points: int = 201) -> Profile:
        self.check_contraction(contraction)
        coordinate = np.linspace(0.0, self.segments, points)
        number = np.minimum(np.floor(coordinate), self.rings)
        axial, radius = self.profile(contraction, 2 * (coordinate - number) - 1)
        chord = self.fibre_length * (1.0 - contraction)
        return axial + (number - self.rings / 2) * chord, radius


@model
class StraightFibre(FibreTube):
    """Straight-fibre tube with an assumed meridian: CircularArc, Catenary, TrueArcParabola, or Parabola (Saga et al.).

    The default is the circular arc: it preserves the fibre length and has the smallest error under virtual work.
    """

    meridian: Meridian = CircularArc()

    @property
    def contraction_range(self) -> tuple[float, float]:
        """From straight fibres to the maximum contraction of the meridian."""
        return (0.0, self.meridian.max_contraction)

    def segment(self, contraction: Value) -> Segment:
        check_contraction_range(contraction, self.contraction_range, "StraightFibre")
        return self.meridian.segment(contraction, self.fibre_length, self.end_radius)

    def volume_derivative(self, contraction: Value) -> Value:
        check_contraction_range(contraction, self.contraction_range, "StraightFibre")
        return super().volume_derivative(contraction)

    def profile(self, contraction: float, position: Array) -> Profile:
        return self.meridian.profile(contraction, self.fibre_length, self.end_radius, position)

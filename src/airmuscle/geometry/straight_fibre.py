"""A tube reinforced by straight fibres along its axis, which bulges between its end rings as it contracts."""

from __future__ import annotations

import abc

import numpy as np

from ..core.arrays import Array
from ..core.declaration import model, parameter
from ..core.errors import GeometryLimitError, ParameterError
from ..core.ops import Value
from .base import Geometry
from .circular_arc import CircularArc
from .meridian import Meridian, Profile, Segment


def check_contraction_range(contraction: Value, reach: tuple[float, float], owner: str, why: str = "") -> None:
    """Raise OutOfReach, naming what is possible, for numbers outside `reach`; a traced contraction passes."""
    if not isinstance(contraction, float | int | np.ndarray | np.generic):
        return
    values = np.asarray(contraction, dtype=float)
    outside = ~((values >= reach[0]) & (values <= reach[1]))
    if outside.any():
        raise GeometryLimitError(
            f"{owner} cannot take a contraction of {values[outside].flat[0]:.2%}; "
            f"it reaches from {reach[0]:.2%} to {reach[1]:.2%}{why}."
        )


@model
class FibreTube(Geometry):
    """Straight inextensible fibres between rings of one diameter: n rings make n + 1 equal segments in series.

    Each segment has the fibre length l_0 = L_0/(n + 1) and contracts by the same ratio as the whole. The width of a
    ring is taken as zero; that rings divide the tube equally is inferred, Saga et al. 2007 do not say it.
    """

    resting_length: float = parameter(
        "m", "L_0", "length between the fittings, unpressurised and unloaded", bounds=(1e-3, 20.0), fitted=False
    )
    end_diameter: float = parameter("m", "d_0", "diameter at the ends and rings", bounds=(1e-4, 0.5), fitted=False)
    rings: int = 0

    def check(self) -> None:
        if isinstance(self.rings, bool) or not isinstance(self.rings, int) or self.rings < 0:
            raise ParameterError(
                f"{type(self).__name__}.rings is {self.rings!r}; it must be a whole number, 0 or more."
            )

    @property
    def end_radius(self) -> Value:
        """r_0 = d_0/2 [m]."""
        return self.end_diameter / 2

    @property
    def segments(self) -> int:
        """n + 1 segments between n rings."""
        return self.rings + 1

    @property
    def fibre_length(self) -> Value:
        """l_0 [m] of one segment."""
        return self.resting_length / self.segments

    @abc.abstractmethod
    def segment(self, contraction: Value) -> Segment:
        """Everything about one segment at a contraction [1]. Raises OutOfReach."""

    @abc.abstractmethod
    def profile(self, contraction: float, along: Array) -> Profile:
        """Positions from the middle of a segment [m] and radii [m] at places `along` it, -1 to 1 from end to end."""

    def volume(self, contraction: Value) -> Value:
        return self.segments * self.segment(contraction).volume

    def outline(self, contraction: float, points: int = 201) -> Profile:
        self.check_contraction(contraction)
        place = np.linspace(0.0, self.segments, points)
        number = np.minimum(np.floor(place), self.rings)
        axial, radius = self.profile(contraction, 2 * (place - number) - 1)
        chord = self.fibre_length * (1.0 - contraction)
        return axial + (number - self.rings / 2) * chord, radius


@model
class StraightFibre(FibreTube):
    """A straight-fibre tube with an assumed meridian: CircularArc, Catenary, TrueArcParabola or Saga's Parabola.

    The circular arc is the default: it keeps the fibre's length and errs least under virtual work.
    """

    meridian: Meridian = CircularArc()

    @property
    def contraction_range(self) -> tuple[float, float]:
        """From straight fibres to where the outline means nothing any more."""
        return (0.0, self.meridian.max_contraction)

    def segment(self, contraction: Value) -> Segment:
        check_contraction_range(contraction, self.contraction_range, "StraightFibre")
        return self.meridian.segment(contraction, self.fibre_length, self.end_radius)

    def profile(self, contraction: float, along: Array) -> Profile:
        return self.meridian.profile(contraction, self.fibre_length, self.end_radius, along)

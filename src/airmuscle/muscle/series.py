"""The series element of Hill's muscle: what gives way between the contractile element and the load."""

from __future__ import annotations

from ..core import ops
from ..core.declaration import model, parameter
from ..core.ops import Value


class Series:
    """An element in series with the contractile one."""


@model
class RigidSeries(Series):
    """Nothing gives way: the contractile element is as contracted as the muscle. The third paper leaves it out too."""


@model
class SeriesSpring(Series):
    """F = k s for a stretch s > 0, and slack below: fittings, rope or sensor that stretch under tension."""

    stiffness: float = parameter("N/m", "k_SE", "stiffness of the series element", bounds=(1.0, 1e9))

    def force(self, stretch: Value) -> Value:
        """Tension [N] at a stretch [m]."""
        return self.stiffness * ops.maximum(stretch, 0.0)

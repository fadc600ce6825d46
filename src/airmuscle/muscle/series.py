"""Series elements of the Hill-type muscle: compliance between the contractile element and the load."""

from __future__ import annotations

from ..core import ops
from ..core.declaration import model, parameter
from ..core.ops import Value


class SeriesElement:
    """Element in series with the contractile element (base class)."""


@model
class RigidSeriesElement(SeriesElement):
    """Rigid connection: contractile element and muscle have the same contraction, as in Hošovský et al."""


@model
class SeriesSpring(SeriesElement):
    """Tension-only spring: F = k max(s, 0) with stretch s, for compliant fittings, ropes or sensors."""

    stiffness: float = parameter("N/m", "k_SE", "stiffness of the series element", bounds=(1.0, 1e9))

    def force(self, stretch: Value) -> Value:
        """Tension [N] at a stretch [m]."""
        return self.stiffness * ops.maximum(stretch, 0.0)

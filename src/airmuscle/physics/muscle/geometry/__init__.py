"""Geometries: enclosed volume and outline of a muscle as functions of contraction."""

from .base import Geometry
from .braid import Braid
from .catenary import Catenary
from .chebyshev import ChebyshevGeometry
from .circular_arc import CircularArc
from .fibre_sum import HalfShellFibreSum, PrintedFibreSum, UniformFibreSum, UserDefinedFibreSum
from .parabola import Parabola, TrueArcParabola
from .pleated import PleatedTube
from .straight_fibre import StraightFibre
from .tabulated import TabulatedGeometry
from .vessel import Vessel

__all__ = [
    "Braid",
    "Catenary",
    "ChebyshevGeometry",
    "CircularArc",
    "Geometry",
    "HalfShellFibreSum",
    "Parabola",
    "PleatedTube",
    "PrintedFibreSum",
    "StraightFibre",
    "TabulatedGeometry",
    "TrueArcParabola",
    "UniformFibreSum",
    "UserDefinedFibreSum",
    "Vessel",
]

"""Geometries: volume and outline of a muscle from its contraction."""

from .base import Geometry
from .braid import Braid
from .catenary import Catenary
from .chebyshev import ChebyshevGeometry
from .circular_arc import CircularArc
from .fibre_sum import UniformFibreSum, UserDefinedFibreSum, HalfShellFibreSum, PrintedFibreSum
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
    "UniformFibreSum",
    "Geometry",
    "UserDefinedFibreSum",
    "Parabola",
    "PleatedTube",
    "StraightFibre",
    "HalfShellFibreSum",
    "PrintedFibreSum",
    "TabulatedGeometry",
    "TrueArcParabola",
    "Vessel",
]

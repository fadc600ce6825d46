"""Geometries: enclosed volume and outline of a muscle as functions of contraction."""

from .base import Geometry
from .braid import Braid
from .chebyshev import ChebyshevGeometry, as_polynomial
from .meridian_shapes import Catenary, CircularArc, Parabola, TrueArcParabola
from .pleated import PleatedTube
from .straight_fibre import HalfShellFibreSum, PrintedFibreSum, StraightFibre, UniformFibreSum, UserDefinedFibreSum
from .tabulated import TabulatedGeometry, Vessel

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
    "as_polynomial",
]

"""Enclosed volume and outline of a muscle, from its contraction."""

from .base import Geometry
from .braid import Braid
from .chebyshev import ChebyshevGeometry
from .pleated import PleatedTube
from .straight_fibre import StraightFibre
from .tabulated import TabulatedGeometry
from .vessel import Vessel

__all__ = [
    "Braid",
    "ChebyshevGeometry",
    "Geometry",
    "PleatedTube",
    "StraightFibre",
    "TabulatedGeometry",
    "Vessel",
]

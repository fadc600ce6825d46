"""Enclosed volume and outline of a muscle, from its contraction."""

from .base import Geometry as Geometry
from .braid import Braid as Braid
from .chebyshev import ChebyshevGeometry as ChebyshevGeometry
from .pleated import PleatedTube as PleatedTube
from .straight_fibre import StraightFibre as StraightFibre
from .tabulated import TabulatedGeometry as TabulatedGeometry
from .vessel import Vessel as Vessel

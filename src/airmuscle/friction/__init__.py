"""Force with memory, against the motion of a muscle."""

from .base import Friction as Friction
from .base import NoFriction as NoFriction
from .bouc_wen import BoucWen as BoucWen
from .dahl import Dahl as Dahl
from .lugre import LuGre as LuGre
from .maxwell_slip import MaxwellSlip as MaxwellSlip
from .prandtl_ishlinskii import PrandtlIshlinskii as PrandtlIshlinskii

"""Friction: hysteresis models of the force that opposes the motion of a muscle."""

from .base import Friction, NoFriction
from .bouc_wen import BoucWen
from .dahl import Dahl
from .lugre import LuGre
from .maxwell_slip import MaxwellSlip
from .prandtl_ishlinskii import PrandtlIshlinskii
from .wrapper import IdentifiedFriction, PressureScaledFriction

__all__ = [
    "BoucWen",
    "Dahl",
    "Friction",
    "IdentifiedFriction",
    "LuGre",
    "MaxwellSlip",
    "NoFriction",
    "PrandtlIshlinskii",
    "PressureScaledFriction",
]

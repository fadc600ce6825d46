"""Mechanisms: the mechanical loads on which muscles act."""

from .antagonistic_joint import AntagonisticJoint
from .base import Coordinate, Mechanism
from .contact import HuntCrossley
from .end_stops import JointWithEndStops, WithEndStops
from .hanging_mass import HangingMass
from .isometric import Isometric
from .isotonic import Isotonic
from .latch import WithLatch
from .lever import Lever
from .muscles_in_series import MusclesInSeries
from .offsets import WithOffsets
from .prescribed_motion import PrescribedMotion
from .pulley import Pulley
from .spring_load import SpringLoad
from .wrapper import MechanismWrapper

__all__ = [
    "AntagonisticJoint",
    "Coordinate",
    "HangingMass",
    "HuntCrossley",
    "Isometric",
    "Isotonic",
    "JointWithEndStops",
    "Lever",
    "Mechanism",
    "MechanismWrapper",
    "MusclesInSeries",
    "PrescribedMotion",
    "Pulley",
    "SpringLoad",
    "WithEndStops",
    "WithLatch",
    "WithOffsets",
]

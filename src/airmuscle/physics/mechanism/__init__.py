"""Mechanisms: the mechanical loads on which muscles act."""

from .antagonistic_joint import AntagonisticJoint
from .base import Coordinate, Mechanism
from .contact import HuntCrossley
from .end_stops import JointWithEndStops, WithEndStops
from .external_load import SHORTENING, SHORTENING_SPEED, ExternalLoad
from .external_torque import JointWithExternalTorque
from .hanging_mass import HangingMass
from .isometric import Isometric
from .isotonic import Isotonic
from .joint_friction import JointWithFriction
from .latch import WithLatch
from .lever import Lever
from .muscles_in_series import MusclesInSeries
from .offsets import WithOffsets
from .planar_arm import ArmLink, MuscleRoute, PlanarArm
from .prescribed_motion import PrescribedMotion
from .pulley import Pulley
from .pulley_profile import ConstantRadius, CrankProfile, PolynomialProfile, PulleyProfile
from .spring_load import SpringLoad
from .wrapper import MechanismWrapper

__all__ = [
    "SHORTENING",
    "SHORTENING_SPEED",
    "AntagonisticJoint",
    "ArmLink",
    "ConstantRadius",
    "Coordinate",
    "CrankProfile",
    "ExternalLoad",
    "HangingMass",
    "HuntCrossley",
    "Isometric",
    "Isotonic",
    "JointWithEndStops",
    "JointWithExternalTorque",
    "JointWithFriction",
    "Lever",
    "Mechanism",
    "MechanismWrapper",
    "MuscleRoute",
    "MusclesInSeries",
    "PlanarArm",
    "PolynomialProfile",
    "PrescribedMotion",
    "Pulley",
    "PulleyProfile",
    "SpringLoad",
    "WithEndStops",
    "WithLatch",
    "WithOffsets",
]

"""Mechanisms: the mechanical loads on which muscles act."""

from .antagonistic_joint import AntagonisticJoint
from .base import Coordinate, Mechanism
from .end_stops import HuntCrossley, JointWithEndStops, WithEndStops
from .external_load import SHORTENING, SHORTENING_SPEED, ExternalLoad
from .lever import Lever
from .loads import HangingMass, Isometric, Isotonic, PrescribedMotion, Pulley, SpringLoad
from .muscles_in_series import MusclesInSeries
from .planar_arm import ArmLink, MuscleRoute, PlanarArm
from .pulley_profile import ConstantRadius, CrankProfile, PolynomialProfile, PulleyProfile
from .wrapper import JointWithExternalTorque, JointWithFriction, MechanismWrapper, WithLatch, WithOffsets

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

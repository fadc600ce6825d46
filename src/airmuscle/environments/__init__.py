"""Learning environments: plants with a task as Gymnasium environments, single and as vectors of thousands."""

from .arm import ArmReaching
from .joint import JointTracking
from .lift import LoadLifting
from .randomisation import FactorRange, FitUncertainty, Randomisation, ValueRange
from .registration import register_environments
from .task import EnvironmentTask, Observation

__all__ = [
    "ArmReaching",
    "EnvironmentTask",
    "FactorRange",
    "FitUncertainty",
    "JointTracking",
    "LoadLifting",
    "Observation",
    "Randomisation",
    "ValueRange",
    "register_environments",
]

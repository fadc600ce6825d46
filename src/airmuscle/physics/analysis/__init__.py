"""Analysis of a plant: stiffness, linearisation, statics of joints."""

from .joint_plot import plot_reachable_region
from .linear_model import LinearModel, Pole, linearise
from .static_stiffness import Stiffness, StiffnessPair, stiffness
from .statics_of_joint import JointPoints, JointStatics, joint_statics

__all__ = [
    "JointPoints",
    "JointStatics",
    "LinearModel",
    "Pole",
    "Stiffness",
    "StiffnessPair",
    "joint_statics",
    "linearise",
    "plot_reachable_region",
    "stiffness",
]

"""Analysis of a plant: equilibria and their stability, stiffness, linearisation, energy consistency."""

from .equilibrium import Equilibrium, find_equilibria, find_equilibrium
from .joint_plot import plot_reachable_region
from .linear_model import LinearModel, Pole, linearise
from .static_stiffness import Stiffness, StiffnessPair, stiffness
from .statics_of_joint import JointPoints, JointStatics, joint_statics

__all__ = [
    "Equilibrium",
    "JointPoints",
    "JointStatics",
    "LinearModel",
    "Pole",
    "Stiffness",
    "StiffnessPair",
    "find_equilibria",
    "find_equilibrium",
    "joint_statics",
    "linearise",
    "plot_reachable_region",
    "stiffness",
]

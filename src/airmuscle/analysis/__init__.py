"""Analysis of a plant: equilibria and their stability, stiffness, linearisation, energy consistency."""

from .equilibrium import Equilibrium, find_equilibria, find_equilibrium
from .linear_model import LinearModel, Pole, linearise
from .static_stiffness import Stiffness, StiffnessPair, stiffness

__all__ = [
    "Equilibrium",
    "LinearModel",
    "Pole",
    "Stiffness",
    "StiffnessPair",
    "find_equilibria",
    "find_equilibrium",
    "linearise",
    "stiffness",
]

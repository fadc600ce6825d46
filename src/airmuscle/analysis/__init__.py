"""Analysis of a plant: equilibria and their stability, stiffness, linearisation, energy consistency."""

from .equilibrium import Equilibrium, find_equilibria, find_equilibrium
from .extended_kalman_filter import (
    ExtendedKalmanFilter,
    Innovation,
    StateEstimate,
    consistency_band,
    normalised_error_squared,
)
from .linear_model import LinearModel, Pole, linearise
from .lqg import design_lqg
from .static_stiffness import Stiffness, StiffnessPair, stiffness

__all__ = [
    "Equilibrium",
    "ExtendedKalmanFilter",
    "Innovation",
    "LinearModel",
    "Pole",
    "StateEstimate",
    "Stiffness",
    "StiffnessPair",
    "consistency_band",
    "design_lqg",
    "find_equilibria",
    "find_equilibrium",
    "linearise",
    "normalised_error_squared",
    "stiffness",
]

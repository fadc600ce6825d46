"""Simulation: integrators, open-loop and closed-loop runs, forward sensitivities."""

from .integrators import DormandPrince8, Method, Rodas4, RungeKutta4
from .sensitivity import Sensitive, sensitivity

__all__ = ["DormandPrince8", "Method", "Rodas4", "RungeKutta4", "Sensitive", "sensitivity"]

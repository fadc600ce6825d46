"""Simulation: integrators, open-loop and closed-loop runs, forward sensitivities."""

from .integrators import DormandPrince8, Integrator, Rodas4, RungeKutta4
from .sensitivity import WithSensitivities, sensitivity

__all__ = ["DormandPrince8", "Integrator", "Rodas4", "RungeKutta4", "WithSensitivities", "sensitivity"]

"""Simulation: problems and their solutions, integrators, open-loop and closed-loop runs, forward sensitivities."""

from .integrators import DormandPrince8, ExplicitRungeKutta, Integrator, Rodas4, RungeKutta4
from .problem import Problem
from .run import CompiledPlant, advance, compiled, simulate, solve
from .solution import Solution, Statistics
from .with_sensitivities import WithSensitivities, sensitivity

__all__ = [
    "CompiledPlant",
    "DormandPrince8",
    "ExplicitRungeKutta",
    "Integrator",
    "Problem",
    "Rodas4",
    "RungeKutta4",
    "Solution",
    "Statistics",
    "WithSensitivities",
    "advance",
    "compiled",
    "sensitivity",
    "simulate",
    "solve",
]

"""Simulation: problems and their solutions, integrators, open-loop and closed-loop runs, forward sensitivities."""

from .integrators import DormandPrince8, ExplicitRungeKutta, Integrator, Rodas4, RungeKutta4
from .problem import Problem
from .run import CompiledPlant, advance, compiled, simulate, solve
from .sensitivity import WithSensitivities, sensitivity
from .solution import Solution, Statistics

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

"""Runs: problems and their solutions, integrators, open and closed loop, forward sensitivities."""

from .integrators import DormandPrince8, ExplicitRungeKutta, Integrator, Rodas4, RungeKutta4
from .jax_loop import loop_in_jax
from .law_with_sensitivities import LawWithSensitivities
from .loop_sensitivities import LoopWithSensitivities, TrackingSensitivity, differentiate_loop, tracking_sensitivity
from .problem import Problem
from .run import advance, simulate, solve
from .solution import Solution, Statistics
from .stepper import Snapshot, Stepper
from .with_sensitivities import WithSensitivities, sensitivity

__all__ = [
    "DormandPrince8",
    "ExplicitRungeKutta",
    "Integrator",
    "LawWithSensitivities",
    "LoopWithSensitivities",
    "Problem",
    "Rodas4",
    "RungeKutta4",
    "Snapshot",
    "Solution",
    "Statistics",
    "Stepper",
    "TrackingSensitivity",
    "WithSensitivities",
    "advance",
    "differentiate_loop",
    "loop_in_jax",
    "sensitivity",
    "simulate",
    "solve",
    "tracking_sensitivity",
]

"""Runs: problems and their solutions, integrators, open and closed loop, forward sensitivities."""

from .bound_integrator import BoundIntegrator
from .compiled_law import LawSample
from .integrators import DormandPrince8, ExplicitRungeKutta, Integrator, Rodas4, RungeKutta4
from .jax_loop import loop_in_jax
from .loop_sensitivities import (
    LawWithSensitivities,
    LoopWithSensitivities,
    TrackingSensitivity,
    differentiate_loop,
    tracking_sensitivity,
)
from .problem import Problem
from .run import advance, simulate, solve
from .sampled_loop import prepare_loop
from .solution import Solution, Statistics
from .stepper import Snapshot, Stepper
from .with_sensitivities import WithSensitivities, sensitivity

__all__ = [
    "BoundIntegrator",
    "DormandPrince8",
    "ExplicitRungeKutta",
    "Integrator",
    "LawSample",
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
    "prepare_loop",
    "sensitivity",
    "simulate",
    "solve",
    "tracking_sensitivity",
]

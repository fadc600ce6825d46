"""Batches: thousands of plants of one structure with different parameters, initial states and inputs, on all cores."""

from .lanes import Double, Precision, Single
from .run import simulate_batch
from .solution import BatchSolution
from .stepper import BatchStepper

__all__ = [
    "BatchSolution",
    "BatchStepper",
    "Double",
    "Precision",
    "Single",
    "simulate_batch",
]

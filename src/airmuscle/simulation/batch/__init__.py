"""Thousands of plants at once: other parameters, other starts, other commands, one pass over all cores."""

from .precision import Double, Precision, Single
from .result import BatchSolution
from .simulate_batch import simulate_batch

__all__ = [
    "BatchSolution",
    "Double",
    "Precision",
    "Single",
    "simulate_batch",
]

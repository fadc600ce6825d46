"""Consistency of a state estimator: the normalised estimation error squared (NEES) and its band."""

from __future__ import annotations

from typing import Any

import numpy as np

from .state_estimator import StateEstimate


def normalised_error_squared(estimate: StateEstimate, state: Any) -> float:
    """NEES (x - x_true)^T P^-1 (x - x_true) [1] of an estimate for the true state (n,); n on average if consistent."""
    scale = np.sqrt(np.diag(estimate.covariance))
    error = (estimate.mean - np.asarray(state, dtype=float)) / scale
    return float(error @ np.linalg.solve(estimate.covariance / np.outer(scale, scale), error))


def consistency_band(dimension: int, runs: int, probability: float = 0.95) -> tuple[float, float]:
    """Band [1] of the average NEES of independent runs that a consistent filter keeps with this probability."""
    from scipy.stats import chi2

    tails = ((1.0 - probability) / 2.0, (1.0 + probability) / 2.0)
    low, high = (float(chi2.ppf(tail, dimension * runs)) / runs for tail in tails)
    return low, high

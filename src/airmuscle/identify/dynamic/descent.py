"""Levenberg-Marquardt within bounds, for residuals whose slopes come with them at little cost.

    (N + lambda D^2) s = -g,   N = J^T J, g = J^T r,   D the greatest norms of J's columns so far

An unknown on its bound, which the descent would push beyond, is held for that step; one that the step would carry
beyond goes to its bound, and the others are found anew. The damping follows the ratio of actual to promised descent.

Reference: Moré, J. J., The Levenberg-Marquardt algorithm: implementation and theory, Lecture Notes in Mathematics 630,
Springer 1978 (scaling by D); Nielsen, H. B., Damping parameter in Marquardt's method, IMM-REP-1999-05, DTU 1999.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Residuals = Callable[[Array], tuple[Array, Array] | None]
"""Residuals (R,) and slopes (R, P) at unknowns (P,); None where they cannot be had."""
FIRST_DAMPING, LEAST_DAMPING = 1e-3, 1e-12
FAR, LEAST_FAR = 0.7, 0.25
"""How far an unknown may go in one step: by this share of itself, or of its scale or bounds where that is more. Chosen:
far from the optimum a step that promises much leads to plants that cannot be run, or only in tiny steps of time."""
ENOUGH = 1e-10
"""A promised relative descent below which the search ends, and likewise a step."""


class Descent(NamedTuple):
    """Where a search stands: unknowns, the sum of squares there, and whether it came to its end."""

    x: Array
    cost: float
    ended: bool


def descended(residuals: Residuals, begin: Array, low: Array, high: Array, most: int) -> Descent:
    """The search for a least sum of squares near `begin`; that sum is infinite where `begin` itself cannot be run.

    `most` is how often the residuals may be asked for.
    """
    x = np.clip(begin, low, high)
    found = residuals(x)
    if found is None:
        return Descent(x, np.inf, True)
    r, j = found
    cost, scale, damping, growth = float(r @ r), np.zeros(x.size), FIRST_DAMPING, 2.0
    for _ in range(most - 1):
        normal, gradient = j.T @ j, j.T @ r
        scale = np.maximum(scale, np.sqrt(normal.diagonal()))
        step = step_within(normal, gradient, damping * np.where(scale > 0, scale, 1.0) ** 2, x, low, high)
        reach = np.maximum(FAR * np.abs(x), LEAST_FAR * np.minimum(high - low, 1.0))
        step = step / max(1.0, float((np.abs(step) / reach).max()))
        promised = -float(step @ (2 * gradient + normal @ step))
        if _small(step, x, scale) or (0 <= promised <= ENOUGH * cost and damping < 1):
            return Descent(x, cost, True)
        tried = residuals(x + step) if promised > 0 else None
        ratio = (cost - float(tried[0] @ tried[0])) / promised if tried is not None else -1.0
        if tried is not None and ratio > 0:
            x, (r, j), cost = x + step, tried, float(tried[0] @ tried[0])
            damping, growth = max(damping * max(1 / 3, 1 - (2 * ratio - 1) ** 3), LEAST_DAMPING), 2.0
        else:
            damping, growth = damping * growth, 2 * growth
    return Descent(x, cost, False)


def _small(step: Array, x: Array, scale: Array) -> bool:
    return bool(np.linalg.norm(scale * step) <= ENOUGH * np.linalg.norm(scale * x))


def step_within(normal: Array, gradient: Array, damping: Array, x: Array, low: Array, high: Array) -> Array:
    """The damped step; unknowns that it would carry beyond a bound go to that bound, and the others are found anew."""
    loose = ~(((x <= low) & (gradient > 0)) | ((x >= high) & (gradient < 0)))
    step = np.zeros(x.size)
    while loose.any():
        matrix, right = normal + np.diag(damping), -gradient - normal @ np.where(loose, 0.0, step)
        step[loose] = np.linalg.solve(matrix[loose][:, loose], right[loose])
        ends = np.clip(x + step, low, high)
        beyond = loose & (ends != x + step)
        if not beyond.any():
            break
        step[beyond] = (ends - x)[beyond]
        loose &= ~beyond
    return step

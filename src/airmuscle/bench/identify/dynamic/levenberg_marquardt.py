"""Levenberg-Marquardt method with bounds, for residuals that are computed together with their Jacobian.

    (N + lambda D^2) s = -g,   N = J^T J, g = J^T r,   D the maximum norms of the columns of J so far

An unknown on its bound, with a gradient that points beyond it, is fixed for that step. An unknown that the step would
move beyond a bound is set to that bound, and the step of the others is computed again. The same holds for the maximum
change of an unknown in one step: an unknown with little effect so far, and thus a large step, does not shorten the
steps of the others. The damping follows the ratio of the actual to the predicted reduction.

Reference: Moré, J. J., The Levenberg-Marquardt algorithm: implementation and theory, Lecture Notes in Mathematics 630,
Springer 1978 (scaling by D); Nielsen, H. B., Damping parameter in Marquardt's method, IMM-REP-1999-05, DTU 1999.
"""

from collections.abc import Callable
from typing import NamedTuple, Self

import numpy as np

from ....core import Array

Residuals = Callable[[Array], tuple[Array, Array] | None]
"""Residuals (R,) and Jacobian (R, P) at unknowns (P,); None where they cannot be computed."""
INITIAL_DAMPING, MIN_DAMPING, MAX_DAMPING = 1e-3, 1e-12, 1e30
RELATIVE_STEP_LIMIT, MIN_STEP_LIMIT = 0.7, 0.25
"""Maximum change of an unknown in one step: this fraction of its value, or of its scale or bounds if that is larger.
Chosen: far from the optimum a long step leads to plants that cannot be simulated, or only with tiny time steps."""
TOLERANCE = 1e-10
"""Predicted relative reduction below which the search ends, and relative step likewise."""
COST_NOISE = 1e-5
"""Relative jump of the sum of squares that is caused by the step-size control of the simulation; chosen. A step with a
predicted reduction below a tenth of it is accepted if the sum of squares increases by no more than it: the Jacobian
still gives the direction, the sum no longer does. Such a step ends the search unless its predicted reduction is less
than half of the last one."""


class _NormalEquations(NamedTuple):
    """Sum of squares, normal matrix (P, P) and half the gradient (P,)."""

    cost: float
    normal: Array
    gradient: Array


def _normal_equations(evaluated: tuple[Array, Array] | None) -> _NormalEquations | None:
    """The normal equations; None where residuals or Jacobian are missing, not finite, or overflow when squared."""
    if evaluated is None:
        return None
    r, j = evaluated
    with np.errstate(over="ignore", invalid="ignore"):
        equations = _NormalEquations(float(r @ r), j.T @ j, j.T @ r)
    return equations if equations.cost < np.inf and np.isfinite(equations.normal).all() else None


class LevenbergMarquardt:
    """A search from one initial guess, which can be interrupted and continued: unknowns `x` (P,), sum of squares there,
    `cost`, and whether it is `finished`.

    The sum of squares is infinite where the residuals cannot be computed at the initial guess.
    """

    def __init__(self, residuals: Residuals, start: Array, low: Array, high: Array) -> None:
        self._residuals, self._low, self._high = residuals, low, high
        self._scale, self._damping, self._growth = np.zeros(start.size), INITIAL_DAMPING, 2.0
        self._rejected_step, self._predicted, self._evaluations = np.full(start.size, np.nan), np.inf, 1
        self.x = np.clip(start, low, high)
        equations = _normal_equations(residuals(self.x))
        self.finished = equations is None
        self._accept(
            self.x, equations or _NormalEquations(np.inf, np.zeros((start.size, start.size)), np.zeros(start.size))
        )

    def run(self, max_evaluations: int) -> Self:
        """Search until convergence, or until the residuals were evaluated `max_evaluations` times in total."""
        while not self.finished and self._evaluations < max_evaluations:
            self._step()
        return self

    def _accept(self, x: Array, equations: _NormalEquations) -> None:
        self.x, (self.cost, self._normal, self._gradient) = x, equations
        self._scale = np.maximum(self._scale, np.sqrt(self._normal.diagonal()))

    def _step(self) -> None:
        step, predicted = self._propose_step()
        while not (converged := self._is_converged(step, predicted)) and (
            not predicted > 0 or (step == self._rejected_step).all()
        ):
            self._reject(step)
            step, predicted = self._propose_step()
        self.finished = converged
        if not converged:
            self._try_step(step, predicted)

    def _try_step(self, step: Array, predicted: float) -> None:
        """Evaluate a step, and accept or reject it."""
        tried, self._evaluations = _normal_equations(self._residuals(self.x + step)), self._evaluations + 1
        cost = np.inf if tried is None else tried.cost
        within_noise = (
            predicted <= COST_NOISE / 10 * self.cost and self._damping < 1 and cost <= (1 + COST_NOISE) * self.cost
        )
        if within_noise and cost >= self.cost and predicted > self._predicted / 2:
            self.finished = True
        elif tried is not None and (within_noise or cost < self.cost):
            ratio = (self.cost - cost) / predicted if cost < self.cost else 1.0
            self._accept(self.x + step, tried)
            self._damping = max(self._damping * max(1 / 3, 1 - (2 * ratio - 1) ** 3), MIN_DAMPING)
            self._growth, self._predicted = 2.0, predicted
        else:
            self._reject(step)

    def _reject(self, step: Array) -> None:
        """Increase the damping, and remember the rejected step."""
        self._damping, self._growth, self._rejected_step = self._damping * self._growth, 2 * self._growth, step

    def _propose_step(self) -> tuple[Array, float]:
        """A step, and the predicted reduction of the sum of squares."""
        x, scale = self.x, self._scale
        limit = np.maximum(RELATIVE_STEP_LIMIT * np.abs(x), MIN_STEP_LIMIT * np.minimum(self._high - self._low, 1.0))
        low, high = np.maximum(self._low, x - limit), np.minimum(self._high, x + limit)
        damping = self._damping * np.where(scale > 0, scale, 1.0) ** 2
        step = bounded_step(self._normal, self._gradient, damping, x, low, high)
        return step, -float(step @ (2 * self._gradient + self._normal @ step))

    def _is_converged(self, step: Array, predicted: float) -> bool:
        """Whether the step or its predicted reduction is negligible, or the damping exceeds its maximum."""
        if (0 <= predicted <= TOLERANCE * self.cost and self._damping < 1) or not self._damping < MAX_DAMPING:
            return True
        scaled_step, scaled_x = self._scale * step, self._scale * self.x
        return bool(scaled_step @ scaled_step <= TOLERANCE**2 * (scaled_x @ scaled_x))


def bounded_step(normal: Array, gradient: Array, damping: Array, x: Array, low: Array, high: Array) -> Array:
    """The damped step (P,) from x; unknowns that it would move beyond a bound are set to it, the others recomputed."""
    free = ~(((x <= low) & (gradient > 0)) | ((x >= high) & (gradient < 0)))
    step, matrix = np.zeros(x.size), normal + np.diag(damping)
    while free.any():
        if free.all():
            step[:] = np.linalg.solve(matrix, -gradient)
        else:
            right, indices = gradient + normal @ np.where(free, 0.0, step), np.flatnonzero(free)
            step[indices] = np.linalg.solve(matrix[indices[:, None], indices], -right[indices])
        target = x + step
        beyond = free & ((target < low) | (target > high))
        if not beyond.any():
            break
        step[beyond] = (np.clip(target, low, high) - x)[beyond]
        free &= ~beyond
    return step

"""Levenberg-Marquardt method with bounds, as a search that can be interrupted and continued.

    (N + lambda D^2) s = -g,   N = J^T J, g = J^T r,   D the maximum norms of the columns of J so
                               far

An unknown on its bound, with a gradient that points beyond it, is fixed for that step. An unknown
that the step would move beyond a bound is set to that bound, and the step of the others is computed
again. The same holds for the maximum change of an unknown in one step: an unknown with little
effect so far, and thus a large step, does not shorten the steps of the others. The damping follows
the ratio of the actual to the predicted reduction.

Reference: Moré, J. J., The Levenberg-Marquardt algorithm: implementation and theory, Lecture Notes
in Mathematics 630, Springer 1978 (scaling by D); Nielsen, H. B., Damping parameter in Marquardt's
method, IMM-REP-1999-05, DTU 1999.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, Self

import numpy as np

from ...core import Array
from .search import Checkpoint, goes_on

Residuals = Callable[[Array], tuple[Array, Array] | None]
"""Residuals (R,) and Jacobian (R, P) at unknowns (P,); None where they cannot be computed. What
they remember of earlier calls is in their attribute `memory`, numbers that a checkpoint keeps."""
INITIAL_DAMPING = 1e-3
MIN_DAMPING = 1e-12
MAX_DAMPING = 1e30
RELATIVE_STEP_LIMIT = 0.7
MIN_STEP_LIMIT = 0.25
"""Maximum change of an unknown in one step: this fraction of its value, or of its scale or bounds
if that is larger. Chosen: far from the optimum a long step leads to plants that cannot be
simulated, or only with tiny time steps."""
TOLERANCE = 1e-10
"""Predicted relative reduction below which the search ends, and relative step likewise."""
COST_NOISE = 1e-5
"""Relative jump of the sum of squares that is caused by the step-size control of the simulation;
chosen. A step with a predicted reduction below a tenth of it is accepted if the sum of squares
increases by no more than it: the Jacobian still gives the direction, the sum no longer does. Such a
step ends the search unless its predicted reduction is less than half of the last one."""


class _NormalEquations(NamedTuple):
    """Sum of squares, normal matrix (P, P) and half the gradient (P,)."""

    cost: float
    normal: Array
    gradient: Array


def _normal_equations(evaluated: tuple[Array, Array] | None, count: int) -> _NormalEquations:
    """The normal equations; an infinite sum where residuals or Jacobian are missing, not finite, or
    overflow when squared.
    """
    if evaluated is not None:
        r, j = evaluated
        with np.errstate(over="ignore", invalid="ignore"):
            cost = float(r @ r)
            normal = j.T @ j
            gradient = j.T @ r
        if cost < np.inf and np.isfinite(normal).all():
            return _NormalEquations(cost, normal, gradient)
    return _NormalEquations(np.inf, np.zeros((count, count)), np.zeros(count))


class SearchState(NamedTuple):
    """All that determines how a search goes on."""

    x: Array
    cost: float
    normal: Array
    gradient: Array
    scale: Array
    damping: float
    growth: float
    rejected_step: Array
    predicted: float
    evaluations: int
    is_finished: bool
    memory: tuple[float, ...]


class LevenbergMarquardt:
    """A search from one initial guess, which can be interrupted and continued: unknowns `x` (P,),
    sum of squares there, `cost`, and whether it is `finished`. The sum of squares is infinite where
    the residuals cannot be computed at the initial guess. With a checkpoint it goes on from the
    state that an earlier call has kept."""

    def __init__(
        self,
        residuals: Residuals,
        start: Array,
        low: Array,
        high: Array,
        *,
        name: str = "search",
        checkpoint: Checkpoint | None = None,
    ) -> None:
        self._residuals: Any = residuals
        self._low = low
        self._high = high
        self._name = name
        self._checkpoint = checkpoint
        state = None if checkpoint is None else checkpoint.load()
        if state is not None:
            self._restore(SearchState(*state))
            return
        self._scale = np.zeros(start.size)
        self._damping = INITIAL_DAMPING
        self._growth = 2.0
        self._rejected_step = np.full(start.size, np.nan)
        self._predicted = np.inf
        self._evaluations = 1
        x = np.clip(start, low, high)
        self._accept(x, _normal_equations(residuals(x), x.size))
        self.finished = not self.cost < np.inf

    def run(self, max_evaluations: int) -> Self:
        """Search until convergence, or until the residuals were evaluated `max_evaluations` times
        in total.
        """
        while not self.finished and self._evaluations < max_evaluations:
            if not goes_on(self._name, self._evaluations / max_evaluations):
                break
            self._step()
            if self._checkpoint is not None:
                self._checkpoint.save(self._state(), last=self.finished)
        return self

    def _state(self) -> SearchState:
        return SearchState(
            self.x,
            self.cost,
            self._normal,
            self._gradient,
            self._scale,
            self._damping,
            self._growth,
            self._rejected_step,
            self._predicted,
            self._evaluations,
            self.finished,
            tuple(getattr(self._residuals, "memory", ())),
        )

    def _restore(self, state: SearchState) -> None:
        self.x = state.x
        self.cost = state.cost
        self._normal = state.normal
        self._gradient = state.gradient
        self._scale = state.scale
        self._damping = state.damping
        self._growth = state.growth
        self._rejected_step = state.rejected_step
        self._predicted = state.predicted
        self._evaluations = state.evaluations
        self.finished = state.is_finished
        if state.memory:
            self._residuals.memory = state.memory

    def _accept(self, x: Array, equations: tuple[float, Array, Array]) -> None:
        self.x = x
        self.cost, self._normal, self._gradient = equations
        self._scale = np.maximum(self._scale, np.sqrt(self._normal.diagonal()))

    def _step(self) -> None:
        """Propose steps until one is no repetition, evaluate it, and accept or reject it."""
        step, predicted = self._propose_step()
        while not (converged := self._is_converged(step, predicted)) and (
            not predicted > 0 or (step == self._rejected_step).all()
        ):
            self._reject(step)
            step, predicted = self._propose_step()
        if converged:
            self.finished = True
            return
        tried = _normal_equations(self._residuals(self.x + step), step.size)
        self._evaluations = self._evaluations + 1
        cost = tried[0]
        small = predicted <= COST_NOISE / 10 * self.cost and self._damping < 1
        within_noise = small and cost <= (1 + COST_NOISE) * self.cost
        if within_noise and cost >= self.cost and predicted > self._predicted / 2:
            self.finished = True
        elif within_noise or cost < self.cost:
            ratio = (self.cost - cost) / predicted if cost < self.cost else 1.0
            self._accept(self.x + step, tried)
            self._damping = max(self._damping * max(1 / 3, 1 - (2 * ratio - 1) ** 3), MIN_DAMPING)
            self._growth = 2.0
            self._predicted = predicted
        else:
            self._reject(step)

    def _reject(self, step: Array) -> None:
        """Increase the damping, and remember the rejected step."""
        self._damping = self._damping * self._growth
        self._growth = 2 * self._growth
        self._rejected_step = step

    def _propose_step(self) -> tuple[Array, float]:
        """A step, and the predicted reduction of the sum of squares."""
        x = self.x
        scale = self._scale
        limit = np.maximum(
            RELATIVE_STEP_LIMIT * np.abs(x),
            MIN_STEP_LIMIT * np.minimum(self._high - self._low, 1.0),
        )
        low = np.maximum(self._low, x - limit)
        high = np.minimum(self._high, x + limit)
        damping = self._damping * np.where(scale > 0, scale, 1.0) ** 2
        step = bounded_step(self._normal, self._gradient, damping, x, low, high)
        return step, -float(step @ (2 * self._gradient + self._normal @ step))

    def _is_converged(self, step: Array, predicted: float) -> bool:
        """Whether the step or its predicted reduction is negligible, or the damping exceeds its
        maximum.
        """
        if (
            0 <= predicted <= TOLERANCE * self.cost and self._damping < 1
        ) or not self._damping < MAX_DAMPING:
            return True
        scaled_step = self._scale * step
        scaled_x = self._scale * self.x
        return bool(scaled_step @ scaled_step <= TOLERANCE**2 * (scaled_x @ scaled_x))


def bounded_step(
    normal: Array, gradient: Array, damping: Array, x: Array, low: Array, high: Array
) -> Array:
    """The damped step (P,) from x; unknowns that it would move beyond a bound are set to it, the
    others recomputed.
    """
    free = ~(((x <= low) & (gradient > 0)) | ((x >= high) & (gradient < 0)))
    step = np.zeros(x.size)
    matrix = normal + np.diag(damping)
    while free.any():
        if free.all():
            step[:] = np.linalg.solve(matrix, -gradient)
        else:
            right = gradient + normal @ np.where(free, 0.0, step)
            indices = np.flatnonzero(free)
            step[indices] = np.linalg.solve(matrix[indices[:, None], indices], -right[indices])
        target = x + step
        beyond = free & ((target < low) | (target > high))
        if not beyond.any():
            break
        step[beyond] = (np.clip(target, low, high) - x)[beyond]
        free &= ~beyond
    return step

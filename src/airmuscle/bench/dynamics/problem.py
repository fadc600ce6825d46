"""Least squares of the residuals of all records: Levenberg-Marquardt method with bounds, and the
problem it solves.

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

import dataclasses
import functools
from collections.abc import Callable, Sequence
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from ...core import AirmuscleError, Array
from .experiment import Unknown
from .record_model import MAX_STEPS, RecordModel

Residuals = Callable[[Array], tuple[Array, Array] | None]
"""Residuals (R,) and Jacobian (R, P) at unknowns (P,); None where they cannot be computed."""
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


class LevenbergMarquardt:
    """A search from one initial guess, which can be interrupted and continued: unknowns `x` (P,),
    sum of squares there, `cost`, and whether it is `finished`. The sum of squares is infinite where
    the residuals cannot be computed at the initial guess."""

    def __init__(self, residuals: Residuals, start: Array, low: Array, high: Array) -> None:
        self._residuals = residuals
        self._low = low
        self._high = high
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
            self._step()
        return self

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


MAX_RUNS = 200
"""Maximum number of simulations of all records in one search."""
MIN_STEP_BUDGET = 10_000
STEP_BUDGET_FACTOR = 20
"""A simulation is aborted after this many steps, or after this many times the steps of the best
simulation of its search if that is more; chosen."""

MIN_RATIO = 1e-9
"""Least ratio of an unknown with a prior to its prior value (chosen): a bound may be zero."""


@dataclasses.dataclass(frozen=True, eq=False)
class DynamicFitProblem:
    """Residuals as a function of the scaled unknowns (P,), counted from their origins in units of
    their magnitudes.
    """

    record_models: tuple[RecordModel, ...]
    unknowns: tuple[Unknown, ...]
    sensor_deviations: Array
    """Standard deviation of the sensor of every observed quantity [SI]."""

    @functools.cached_property
    def scales(self) -> Array:
        """Magnitude of every unknown [SI], shape (P,)."""
        return np.array([u.scale for u in self.unknowns])

    @functools.cached_property
    def origins(self) -> Array:
        """Values from which the unknowns are counted [SI], shape (P,)."""
        return np.array([u.origin for u in self.unknowns])

    @functools.cached_property
    def margins(self) -> Array:
        """Margins of start times and initial values [SI], whose zero is arbitrary; NaN of
        parameters, shape (P,).
        """
        return np.array([np.nan if u.paths else u.scale for u in self.unknowns])

    def scaled(self, values: Array) -> Array:
        """The scaled unknowns for values [SI], shape (..., P)."""
        return np.asarray((values - self.origins) / self.scales)

    def values(self, scaled: Array) -> Array:
        """The values [SI] of scaled unknowns, within their bounds whatever the rounding, shape
        (..., P).
        """
        low = [u.low for u in self.unknowns]
        high = [u.high for u in self.unknowns]
        return np.clip(self.origins + scaled * self.scales, low, high)

    @functools.cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the scaled unknowns, shape (P,) each."""
        low = np.array([u.low for u in self.unknowns])
        high = np.array([u.high for u in self.unknowns])
        return self.scaled(low), self.scaled(high)

    def residuals(self, scaled: Array) -> tuple[Array, Array]:
        """Residuals (R,) in standard deviations of the sensors, and their Jacobian (R, P) by the
        scaled unknowns.
        """
        residuals, jacobian, _ = self.run(scaled)
        return residuals, jacobian

    def run(self, scaled: Array, max_steps: int = MAX_STEPS) -> tuple[Array, Array, int]:
        """Residuals and Jacobian as in `residuals`, missing values omitted, and the steps of the
        longest simulation. Raises SimulationError or IdentificationError where one fails or exceeds
        `max_steps`."""
        residuals = []
        jacobians = []
        longest = 0
        values = self.values(scaled)
        factors = self.scales / self.sensor_deviations[:, None]
        for model in self.record_models:
            modelled, jacobian, steps = model.evaluate(values, max_steps)
            residual = (modelled - model.measured) / self.sensor_deviations
            jacobian = jacobian * factors
            longest = max(longest, steps)
            residuals.append(residual.ravel() if model.all_valid else residual[model.valid])
            jacobians.append(
                jacobian.reshape(-1, values.size) if model.all_valid else jacobian[model.valid]
            )
        if len(residuals) == 1:
            return residuals[0], jacobians[0], longest
        return np.concatenate(residuals), np.concatenate(jacobians), longest

    @functools.cached_property
    def has_prior(self) -> npt.NDArray[np.bool_]:
        """Which unknowns have a prior, a mask (P,)."""
        return np.array([u.prior is not None for u in self.unknowns], dtype=bool)

    def prior_residuals(self, scaled: Array) -> tuple[Array, Array]:
        """ln(value/prior value) of the unknowns with a prior (K,) in its standard deviations, and
        the Jacobian (K, P) by the scaled unknowns.
        """
        indices = np.flatnonzero(self.has_prior)
        priors = [unknown.prior for unknown in self.unknowns if unknown.prior is not None]
        values, deviations = np.array(priors).reshape(-1, 2).T
        relative = self.scales[indices] / values
        ratios = np.maximum(scaled[indices] * relative, MIN_RATIO)
        jacobian = np.zeros((indices.size, scaled.size))
        jacobian[np.arange(indices.size), indices] = relative / ratios / deviations
        return np.log(ratios) / deviations, jacobian

    def solve(self, scaled: Array, fixed: Sequence[int] = ()) -> tuple[Array, float]:
        """Least squares from an initial guess (P,) with some unknowns fixed, given by index: the
        scaled unknowns, and the sum of squares, which is infinite where the guess cannot be
        simulated."""
        free, solution = [k for k in range(scaled.size) if k not in fixed], scaled.copy()
        search = self.search(scaled, free).run(MAX_RUNS)
        solution[free] = search.x
        return solution, search.cost

    def search(self, scaled: Array, free: Sequence[int]) -> LevenbergMarquardt:
        """The search over the free unknowns from an initial guess (P,), which can be interrupted
        and continued. Simulations with far more steps than the best one so far, which occur far
        from physical parameters, are aborted."""
        min_cost, max_steps, tried = np.inf, MAX_STEPS, scaled.copy()

        def guarded(x: Array) -> tuple[Array, Array] | None:
            nonlocal min_cost, max_steps
            tried[free] = x
            try:
                residuals, jacobian, steps = self.run(tried, max_steps)
            except AirmuscleError:
                return None
            if self.has_prior.any():
                known, slopes = self.prior_residuals(tried)
                residuals = np.concatenate([residuals, known])
                jacobian = np.concatenate([jacobian, slopes])
            cost = float(residuals @ residuals)
            if cost < min_cost:
                min_cost = cost
                max_steps = int(min(MAX_STEPS, max(MIN_STEP_BUDGET, STEP_BUDGET_FACTOR * steps)))
            return residuals, jacobian if len(free) == scaled.size else jacobian[:, free]

        low, high = self.bounds
        return LevenbergMarquardt(guarded, scaled[free], low[free], high[free])

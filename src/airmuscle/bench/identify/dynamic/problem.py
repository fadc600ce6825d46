"""DynamicFitProblem: residuals of all records as a function of the unknowns, their minimisation, and their profile."""

import dataclasses
import functools
from collections.abc import Sequence

import numpy as np

from ....core import AirmuscleError, Array
from ..result import Estimate
from .experiment import Unknown
from .levenberg_marquardt import LevenbergMarquardt
from .record_model import MAX_STEPS, RecordModel

MAX_RUNS = 200
"""Maximum number of simulations of all records in one search."""
MIN_STEP_BUDGET, STEP_BUDGET_FACTOR = 10_000, 20
"""A simulation is aborted after this many steps, or after this many times the steps of the best simulation of its
search if that is more; chosen."""


@dataclasses.dataclass(frozen=True, eq=False)
class DynamicFitProblem:
    """Residuals as a function of the scaled unknowns (P,), counted from their origins in units of their magnitudes."""

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
        """Margins of start times and initial values [SI], whose zero is arbitrary; NaN of parameters, shape (P,)."""
        return np.array([np.nan if u.paths else u.scale for u in self.unknowns])

    def scaled(self, values: Array) -> Array:
        """The scaled unknowns for values [SI], shape (..., P)."""
        return np.asarray((values - self.origins) / self.scales)

    def values(self, scaled: Array) -> Array:
        """The values [SI] of scaled unknowns, within their bounds whatever the rounding, shape (..., P)."""
        low, high = [u.low for u in self.unknowns], [u.high for u in self.unknowns]
        return np.clip(self.origins + scaled * self.scales, low, high)

    @functools.cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the scaled unknowns, shape (P,) each."""
        low, high = np.array([u.low for u in self.unknowns]), np.array([u.high for u in self.unknowns])
        return self.scaled(low), self.scaled(high)

    def residuals(self, scaled: Array) -> tuple[Array, Array]:
        """Residuals (R,) in standard deviations of the sensors, and their Jacobian (R, P) by the scaled unknowns."""
        residuals, jacobian, _ = self.run(scaled)
        return residuals, jacobian

    def run(self, scaled: Array, max_steps: int = MAX_STEPS) -> tuple[Array, Array, int]:
        """Residuals and Jacobian as in `residuals`, missing values omitted, and the steps of the longest simulation.

        Raises SimulationError or IdentificationError where a simulation fails or exceeds `max_steps`.
        """
        residuals, jacobians, longest = [], [], 0
        values, factors = self.values(scaled), self.scales / self.sensor_deviations[:, None]
        for model in self.record_models:
            modelled, jacobian, steps = model.evaluate(values, max_steps)
            residual = (modelled - model.measured) / self.sensor_deviations
            jacobian = jacobian * factors
            longest = max(longest, steps)
            residuals.append(residual.ravel() if model.all_valid else residual[model.valid])
            jacobians.append(jacobian.reshape(-1, values.size) if model.all_valid else jacobian[model.valid])
        if len(residuals) == 1:
            return residuals[0], jacobians[0], longest
        return np.concatenate(residuals), np.concatenate(jacobians), longest

    def solve(self, scaled: Array, fixed: Sequence[int] = ()) -> tuple[Array, float]:
        """Least squares from an initial guess (P,) with some unknowns fixed, given by index.

        Returns the scaled unknowns and the sum of squares, which is infinite where the initial guess cannot be
        simulated.
        """
        free, solution = [k for k in range(scaled.size) if k not in fixed], scaled.copy()
        search = self.search(scaled, free).run(MAX_RUNS)
        solution[free] = search.x
        return solution, search.cost

    def search(self, scaled: Array, free: Sequence[int]) -> LevenbergMarquardt:
        """The search over the free unknowns from an initial guess (P,), which can be interrupted and continued.

        Simulations with far more steps than the best one so far, which occur far from physical parameters, are aborted.
        """
        min_cost, max_steps, tried = np.inf, MAX_STEPS, scaled.copy()

        def guarded(x: Array) -> tuple[Array, Array] | None:
            nonlocal min_cost, max_steps
            tried[free] = x
            try:
                residuals, jacobian, steps = self.run(tried, max_steps)
            except AirmuscleError:
                return None
            cost = float(residuals @ residuals)
            if cost < min_cost:
                min_cost = cost
                max_steps = int(min(MAX_STEPS, max(MIN_STEP_BUDGET, STEP_BUDGET_FACTOR * steps)))
            return residuals, jacobian if len(free) == scaled.size else jacobian[:, free]

        low, high = self.bounds
        return LevenbergMarquardt(guarded, scaled[free], low[free], high[free])


NORMAL_95 = 1.96
"""Square root of the cost increase, in residual variances, at the limits of a 95 % confidence interval."""
MAX_STANDARD_ERRORS = 4.0
"""Range of a profile in standard errors to either side, at most twice the estimate of a parameter."""
MIN_IMPROVEMENT = 0.1
"""Reduction of the sum of squares, in residual variances, that shows that the fit was not converged; chosen."""


@dataclasses.dataclass(frozen=True, eq=False)
class DynamicProfile:
    """Values of one estimate in increasing order, and the increase of the sum of squares in residual variances."""

    name: str
    unit: str
    values: Array
    cost_increase: Array
    estimates: Array
    """All estimates at every value [SI], shape (M, P)."""

    @property
    def interval(self) -> tuple[float, float]:
        """Limits of the 95 % interval, where the cost increase is 1.96 squared; NaN where it stays below, or where
        the plant cannot be simulated before it is reached."""
        best = int(np.argmin(self.cost_increase))
        distance = np.sqrt(np.maximum(self.cost_increase - self.cost_increase[best], 0.0))
        below = self._find_crossing(self.values[: best + 1][::-1], distance[: best + 1][::-1])
        return below, self._find_crossing(self.values[best:], distance[best:])

    @staticmethod
    def _find_crossing(values: Array, distance: Array) -> float:
        above = np.flatnonzero(distance > NORMAL_95)
        if not above.size or not np.isfinite(distance[above[0]]):
            return float("nan")
        i = int(above[0])
        fraction = (NORMAL_95 - distance[i - 1]) / (distance[i] - distance[i - 1])
        return float(values[i - 1] + fraction * (values[i] - values[i - 1]))

    def __str__(self) -> str:
        low, high = (f"{end:.4g}" if np.isfinite(end) else "unbounded" for end in self.interval)
        rows = [f"\n  {v:.4g}: {c:.3g}" for v, c in zip(self.values, self.cost_increase, strict=True)]
        if self.cost_increase.min() < -MIN_IMPROVEMENT:
            rows.append("\n  a better fit was found on the profile: fit again from there")
        unit = "" if self.unit == "1" else f" [{self.unit}]"
        text = "increase of the sum of squares in residual variances"
        return f"{self.name}{unit}, 95 % confidence interval {low} to {high}; {text}:{''.join(rows)}"


def compute_profile(
    problem: DynamicFitProblem, estimates: Sequence[Estimate], index: int, cost: float, variance: float, points: int
) -> DynamicProfile:
    """The profile of one estimate at `points` values to either side, from the optimum outwards.

    estimates  of the fit, whose sum of squares is `cost` and whose residual variance is `variance`
    index      of the profiled estimate
    """
    best = problem.scaled(np.array([e.value for e in estimates]))
    low, high = (bound[index] for bound in problem.bounds)
    stderr = estimates[index].stderr / problem.scales[index]
    span = high - low
    if problem.unknowns[index].paths:  # the zero of a clock or of an initial value gives no range
        span = min(span, 2.0 * abs(best[index]) or 1.0)
    distance = min(MAX_STANDARD_ERRORS * stderr, span) if np.isfinite(stderr) else span
    rows = [(best[index], cost, best)]
    for side in (-1.0, 1.0):
        scaled = best.copy()
        for step in range(1, points + 1):
            value = best[index] + side * distance * step / points
            if not low <= value <= high:
                break
            scaled = scaled.copy()
            scaled[index] = value
            scaled, constrained_cost = problem.solve(scaled, fixed=(index,))
            rows.append((value, constrained_cost, scaled))
    rows.sort(key=lambda row: row[0])
    cost_increase = np.array([(constrained_cost - cost) / variance for _, constrained_cost, _ in rows])
    values = problem.origins[index] + np.array([value for value, _, _ in rows]) * problem.scales[index]
    all_estimates = problem.values(np.array([scaled for _, _, scaled in rows]))
    return DynamicProfile(estimates[index].name, estimates[index].unit, values, cost_increase, all_estimates)

"""Problem of a dynamic fit: the residuals of all records as a function of the unknowns."""

import dataclasses
import functools
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ...core import AirmuscleError, Array
from ..estimation import Checkpoint, LevenbergMarquardt
from .experiment import Unknown
from .record_model import MAX_STEPS, RecordModel

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

    def search(
        self, scaled: Array, free: Sequence[int], name: str = "search"
    ) -> LevenbergMarquardt:
        """The search over the free unknowns from an initial guess (P,), which can be interrupted
        and continued. Simulations with far more steps than the best one so far, which occur far
        from physical parameters, are aborted."""
        low, high = self.bounds
        records = tuple((model.plant, model.experiment) for model in self.record_models)
        content = records, self.unknowns, self.sensor_deviations, scaled, tuple(free)
        return LevenbergMarquardt(
            _GuardedRuns(self, scaled, free),
            scaled[free],
            low[free],
            high[free],
            name=name,
            checkpoint=Checkpoint(__name__, content),
        )


class _GuardedRuns:
    """Residuals and Jacobian by the free unknowns, with the priors; None where a simulation fails
    or has far more steps than the best one so far."""

    def __init__(self, problem: DynamicFitProblem, scaled: Array, free: Sequence[int]) -> None:
        self._problem = problem
        self._tried = scaled.copy()
        self._free = free
        self._min_cost = np.inf
        self._max_steps = MAX_STEPS

    @property
    def memory(self) -> tuple[float, float]:
        """The least sum of squares so far, and the limit of the steps of a simulation."""
        return self._min_cost, float(self._max_steps)

    @memory.setter
    def memory(self, known: tuple[float, float]) -> None:
        self._min_cost = known[0]
        self._max_steps = int(known[1])

    def __call__(self, x: Array) -> tuple[Array, Array] | None:
        problem = self._problem
        self._tried[self._free] = x
        try:
            residuals, jacobian, steps = problem.run(self._tried, self._max_steps)
        except AirmuscleError:
            return None
        if problem.has_prior.any():
            known, slopes = problem.prior_residuals(self._tried)
            residuals = np.concatenate([residuals, known])
            jacobian = np.concatenate([jacobian, slopes])
        cost = float(residuals @ residuals)
        if cost < self._min_cost:
            self._min_cost = cost
            budget = max(MIN_STEP_BUDGET, STEP_BUDGET_FACTOR * steps)
            self._max_steps = int(min(MAX_STEPS, budget))
        is_complete = len(self._free) == self._tried.size
        return residuals, jacobian if is_complete else jacobian[:, self._free]

"""Problem of a dynamic fit: the readings of all records, and the unknowns that they are simulated
with.
"""

import dataclasses
import functools
from collections.abc import Sequence

import numpy as np

from ...core import Array
from ..estimation import (
    FreeParameter,
    Guard,
    LeastSquares,
    LeastSquaresProblem,
    Modelled,
    Prior,
    ProblemSearch,
    Runs,
    SimulatedProblem,
)
from .experiment import Unknown
from .record_model import MAX_STEPS, RecordModel

MAX_RUNS = 200
"""Maximum number of simulations of all records in one search."""
MIN_STEP_BUDGET = 10_000
STEP_BUDGET_FACTOR = 20
"""A simulation is aborted after this many steps, or after this many times the steps of the best
simulation of its search if that is more; chosen."""


class StepLimit(Guard):
    """The limit of the steps of a simulation in one search: simulations with far more steps than
    the best one so far, which occur far from physical parameters, are aborted."""

    def __init__(self) -> None:
        self.max_steps = MAX_STEPS
        self.steps = 0
        """Steps of the longest simulation of the last evaluation."""
        self._min_cost = np.inf

    @property
    def memory(self) -> tuple[float, ...]:
        return self._min_cost, float(self.max_steps)

    def restore(self, memory: tuple[float, ...]) -> None:
        self._min_cost = memory[0]
        self.max_steps = int(memory[1])

    def learn(self, cost: float) -> None:
        if cost < self._min_cost:
            self._min_cost = cost
            budget = max(MIN_STEP_BUDGET, STEP_BUDGET_FACTOR * self.steps)
            self.max_steps = int(min(MAX_STEPS, budget))


@dataclasses.dataclass(frozen=True, eq=False)
class DynamicFitProblem(SimulatedProblem):
    """The readings of all records, one quantity after the other at each row, missing values
    omitted, and their unknowns (P,) [SI].
    """

    record_models: tuple[RecordModel, ...]
    unknowns: tuple[Unknown, ...]
    sensor_deviations: Array
    """Standard deviation of the sensor of every observed quantity [SI]."""

    @property
    def name(self) -> str:
        return "the plant"

    @property
    def origin(self) -> str:
        return " + ".join(model.experiment.recording.origin for model in self.record_models)

    @property
    def quantity(self) -> str:
        return " or ".join(self.record_models[0].names)

    @functools.cached_property
    def parameters(self) -> tuple[FreeParameter, ...]:
        return tuple(
            FreeParameter(
                unknown.name,
                unknown.symbol,
                unknown.value,
                (unknown.low, unknown.high),
                unknown.unit,
                unknown.meaning,
                size=unknown.scale,
                origin=unknown.origin,
                prior=None if unknown.prior is None else Prior(*unknown.prior, True),
            )
            for unknown in self.unknowns
        )

    @functools.cached_property
    def target(self) -> Array:  # type: ignore[override]
        return np.concatenate([model.measured[model.valid] for model in self.record_models])

    @functools.cached_property
    def weights(self) -> Array:  # type: ignore[override]
        """1/standard deviation of the sensor of every reading."""
        every = [
            np.broadcast_to(1.0 / self.sensor_deviations, model.valid.shape)[model.valid]
            for model in self.record_models
        ]
        return np.concatenate(every)

    @functools.cached_property
    def runs(self) -> Runs:
        """The record of every reading."""
        counts = [int(np.count_nonzero(model.valid)) for model in self.record_models]
        record = np.repeat(np.arange(len(counts)), counts)
        return Runs(record, np.zeros(record.size, dtype=np.intp), in_time=True)

    @functools.cached_property
    def margins(self) -> Array:
        """Margins of start times and initial values [SI], whose zero is arbitrary; NaN of
        parameters, shape (P,).
        """
        return np.array([np.nan if u.paths else u.scale for u in self.unknowns])

    def describe_row(self, row: int) -> str:
        model = self.record_models[int(self.runs.run[row])]
        first = int(np.argmax(self.runs.run == self.runs.run[row]))
        samples, quantities = np.nonzero(model.valid)
        sample = int(samples[row - first])
        quantity = int(quantities[row - first])
        origin = model.experiment.recording.origin
        return f"{model.names[quantity]} of {origin} at {model.times[sample]:.4g} s"

    def guard(self) -> StepLimit:
        return StepLimit()

    def evaluate(self, values: Array, guard: Guard | None = None) -> Modelled:
        """The modelled readings (N,) and their Jacobian (N, P). Raises SimulationError or
        IdentificationError where a simulation fails, or exceeds the steps of its `guard`."""
        limit = guard if isinstance(guard, StepLimit) else StepLimit()
        modelled = []
        jacobians = []
        longest = 0
        for model in self.record_models:
            outputs, jacobian, steps = model.evaluate(values, limit.max_steps)
            longest = max(longest, steps)
            modelled.append(outputs.ravel() if model.all_valid else outputs[model.valid])
            jacobians.append(
                jacobian.reshape(-1, values.size) if model.all_valid else jacobian[model.valid]
            )
        limit.steps = longest
        if len(modelled) == 1:
            return Modelled(modelled[0], jacobians[0])
        return Modelled(np.concatenate(modelled), np.concatenate(jacobians))

    def solve(self, values: Array, fixed: Sequence[int] = ()) -> tuple[Array, float]:
        """Least squares from an initial guess (P,) with some unknowns fixed, given by index: the
        values, and the sum of squares, which is infinite where the guess cannot be simulated."""
        solution = values.copy()
        free = [i for i in range(values.size) if i not in fixed]
        problem: LeastSquaresProblem = self
        for index in sorted(fixed, reverse=True):
            problem = problem.with_known(index, float(values[index]))
        search = ProblemSearch(problem, LeastSquares(), values[free]).run(MAX_RUNS)
        solution[free] = search.values
        return solution, search.cost

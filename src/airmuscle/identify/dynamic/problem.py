"""DynamicProblem: residuals of all records over the unknowns, and their least squares."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence

import numpy as np

from ...core.arrays import Array
from ...core.errors import AirmuscleError
from .experiment import Unknown
from .levenberg_marquardt import LevenbergMarquardt, minimise
from .record_model import MAX_STEPS, RecordModel, stack_residuals

MAX_RUNS = 200
"""RunSplit after which any start is left where it stands."""


MIN_STEP_BUDGET, STEP_BUDGET_FACTOR = 10_000, 20
"""A run is left after so many steps, or so many times those of its search's best run where that is more; chosen."""


@dataclasses.dataclass(frozen=True, eq=False)
class DynamicFitProblem:
    """Residuals over unknowns in units of their scales."""

    record_models: tuple[RecordModel, ...]
    unknowns: tuple[Unknown, ...]
    sensor_deviations: Array

    @functools.cached_property
    def scales(self) -> Array:
        """The size of a change of each unknown."""
        return np.array([u.scale for u in self.unknowns])

    @functools.cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds in units of the scales."""
        low, high = np.array([u.low for u in self.unknowns]), np.array([u.high for u in self.unknowns])
        return low / self.scales, high / self.scales

    def residuals(self, scaled: Array) -> tuple[Array, Array]:
        """Residuals (R,) in sensor deviations and their slopes (R, P) by the scaled unknowns."""
        errors, slopes, _ = self.run(scaled)
        return errors, slopes

    def run(self, scaled: Array, most_steps: int = MAX_STEPS) -> tuple[Array, Array, int]:
        """The same, and the steps of the longest run, which fails beyond `most_steps`."""
        return stack_residuals(
            self.record_models, scaled * self.scales, self.sensor_deviations, self.scales, most_steps
        )

    def solve(self, scaled: Array, held: Sequence[int] = (), most: int = MAX_RUNS) -> tuple[Array, float]:
        """The least squares from a start, some unknowns held: unknowns and sum of squares, infinite where it fails."""
        loose, whole = [k for k in range(scaled.size) if k not in held], scaled.copy()
        found = minimise(*self._restrict(scaled, loose), most)
        whole[loose] = found.x
        return whole, found.cost

    def search(self, scaled: Array) -> LevenbergMarquardt:
        """The search from a start, which can be left and taken up again."""
        return LevenbergMarquardt(*self._restrict(scaled, range(scaled.size)))

    def _restrict(self, scaled: Array, loose: Sequence[int]) -> tuple[_GuardedResiduals, Array, Array, Array]:
        """Residuals over the loose unknowns, their start and their bounds."""
        (low, high), places = self.bounds, list(loose)
        return _GuardedResiduals(self, scaled, places), scaled[places], low[places], high[places]


class _GuardedResiduals:
    """Residuals of a problem over some of its unknowns, None where they cannot be had.

    Nor where a run takes far more steps than the best one so far, which comes of plants far from anything physical.
    """

    def __init__(self, problem: DynamicFitProblem, scaled: Array, loose: Sequence[int]) -> None:
        self._problem, self._scaled, self._loose = problem, scaled, loose
        self._least, self._most_steps = np.inf, MAX_STEPS

    def __call__(self, x: Array) -> tuple[Array, Array] | None:
        problem, at = self._problem, self._scaled.copy()
        at[self._loose] = x
        try:
            errors, slopes, steps = problem.run(at, self._most_steps)
        except AirmuscleError:
            return None
        cost = float(errors @ errors)
        if cost < self._least:
            self._least, self._most_steps = cost, min(MAX_STEPS, max(MIN_STEP_BUDGET, STEP_BUDGET_FACTOR * steps))
        return errors, slopes if len(self._loose) == at.size else slopes[:, self._loose]

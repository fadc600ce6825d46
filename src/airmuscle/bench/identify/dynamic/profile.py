"""Profile likelihood of a dynamic fit: minimum sum of squares with one estimate fixed at other values."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from ....core.arrays import Array
from ..result import Estimate
from .problem import DynamicFitProblem

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
        rows = "".join(f"\n  {v:.4g}: {c:.3g}" for v, c in zip(self.values, self.cost_increase, strict=True))
        better = (
            "\n  a better fit was found on the profile: fit again from there"
            if self.cost_increase.min() < -MIN_IMPROVEMENT
            else ""
        )
        unit = "" if self.unit == "1" else f" [{self.unit}]"
        return (
            f"{self.name}{unit}, 95 % confidence interval {low} to {high}; increase of the sum of squares in residual "
            f"variances:{rows}{better}"
        )


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

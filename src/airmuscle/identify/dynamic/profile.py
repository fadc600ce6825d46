"""Profile likelihood: an estimate held at other values, all others found anew, and how much worse that fits."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...core.arrays import Array
from .result import DynamicFit

NORMAL_95 = 1.96
"""Root of the growth of the sum of squares, in variances of the residuals, at the ends of a 95 % interval."""
MAX_STANDARD_ERRORS = 4.0
"""Standard deviations that a profile looks to either side, at most twice its value."""

MIN_IMPROVEMENT = 0.1
"""A sum of squares that is less by this says that the fit had not come to its end; chosen."""


@dataclasses.dataclass(frozen=True, eq=False)
class DynamicProfile:
    """One estimate's values, rising, and the growth of the sum of squares there, in variances of the residuals."""

    name: str
    unit: str
    values: Array
    cost_increase: Array
    estimates: Array
    """The estimates at every value, (M, P)."""

    @property
    def interval(self) -> tuple[float, float]:
        """Where the growth passes 1.96 squared; NaN at an end where it does not within the values looked at."""
        best = int(np.argmin(self.cost_increase))
        distance = np.sqrt(np.maximum(self.cost_increase - self.cost_increase[best], 0.0))
        below = self._find_crossing(self.values[: best + 1][::-1], distance[: best + 1][::-1])
        return below, self._find_crossing(self.values[best:], distance[best:])

    @staticmethod
    def _find_crossing(values: Array, distance: Array) -> float:
        over = np.flatnonzero(distance > NORMAL_95)
        if not over.size:
            return float("nan")
        i = int(over[0])
        share = (NORMAL_95 - distance[i - 1]) / (distance[i] - distance[i - 1])
        return float(values[i - 1] + share * (values[i] - values[i - 1]))

    def __str__(self) -> str:
        low, high = (f"{end:.4g}" if np.isfinite(end) else "open" for end in self.interval)
        rows = "".join(f"\n  {v:.5g}: {g:.3g}" for v, g in zip(self.values, self.cost_increase, strict=True))
        better = (
            "\n  a better fit lies on the way: fit again from there"
            if self.cost_increase.min() < -MIN_IMPROVEMENT
            else ""
        )
        return f"{self.name} [{self.unit}], 95 % from {low} to {high}; growth of the sum of squares:{rows}{better}"


def compute_profile(fit: DynamicFit, name: str, points: int) -> DynamicProfile:
    """The profile of one estimate at `points` values to either side, from the optimum outwards."""
    problem = fit.problem
    k = [e.name for e in fit.estimates].index(fit[name].name)
    best = fit.values / problem.scales
    (low, high), variance = (bound[k] for bound in problem.bounds), max(fit.residual_std, 1e-300) ** 2
    deviation = fit.estimates[k].stderr / problem.scales[k]
    span = min(high - low, 2.0 * abs(best[k]) or 1.0)
    reach = min(MAX_STANDARD_ERRORS * deviation, span) if np.isfinite(deviation) else span
    rows = [(best[k], fit.costs[0], best)]
    for side in (-1.0, 1.0):
        at = best.copy()
        for step in range(1, points + 1):
            place = best[k] + side * reach * step / points
            if not low <= place <= high:
                break
            at = at.copy()
            at[k] = place
            at, cost = problem.solve(at, held=(k,))
            rows.append((place, cost, at))
    rows.sort(key=lambda row: row[0])
    growth = np.array([(cost - fit.costs[0]) / variance for _, cost, _ in rows])
    values = np.array([place for place, _, _ in rows]) * problem.scales[k]
    others = np.array([at for _, _, at in rows]) * problem.scales
    return DynamicProfile(fit.estimates[k].name, fit.estimates[k].unit, values, growth, others)

"""Tuning: the gains that were found, and every set of gains that was simulated."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array
from ...core.errors import ColumnError, suggestion
from ...core.reference import Reference, cite
from ...core.short_repr import ShortRepr
from ...engine.loop.control_loop import ControlLoop
from .case import LoopCase, loop_with_gains
from .evolution import HANSEN2016
from .gain_ranges import GainRange
from .objective import CaseMetrics, Objective
from .tracking import TrackingIndex


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class TuningHistory(ShortRepr):
    """Every set of gains that was simulated, in order: gains (E, D) [SI], objective (E,) and metrics (E, M)."""

    paths: tuple[str, ...]
    gains: Array
    objective: Array
    metrics: CaseMetrics

    def __len__(self) -> int:
        return len(self.objective)

    @property
    def best_so_far(self) -> Array:
        """The smallest objective (E,) up to each set of gains."""
        return np.asarray(np.minimum.accumulate(self.objective))

    def means(self, metric: str) -> Array:
        """The mean (E,) of a metric over the cases: `index`, `air` or `travel`."""
        names = ("index", "air", "travel")
        if metric not in names:
            raise ColumnError(
                f"history: no metric '{metric}'; there are {', '.join(names)}.{suggestion(metric, names)}"
            )
        return np.asarray(getattr(self.metrics, metric).mean(axis=1))

    def pareto(self, metric: str) -> npt.NDArray[np.intp]:
        """The sets of gains that no other one surpasses in both the mean index and another mean metric, by index."""
        error, cost = self.means("index"), self.means(metric)
        order = np.lexsort((cost, error))
        order = order[np.isfinite(error[order]) & np.isfinite(cost[order])]
        lowest = np.minimum.accumulate(np.append(np.inf, cost[order]))[:-1]
        return np.asarray(order[cost[order] < lowest], dtype=np.intp)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Tuning(ShortRepr):
    """The result of tuning: the gains with the smallest objective.

    cases, ranges    for which and within which the gains were sought
    index, scales    tracking index, and the controlled columns of the nominal case with their scales
    criterion        the objective, a function of CaseMetrics
    history          every set of gains that was simulated
    start            1 if the history begins with the present gains of the controller, otherwise 0
    converged        whether the two best descents of the search agree
    interrupted      whether the user stopped the search
    """

    cases: tuple[LoopCase, ...]
    ranges: tuple[GainRange, ...]
    index: TrackingIndex
    scales: Mapping[str, float]
    criterion: Objective
    duration: float
    start_time: float
    seed: int
    budget: int
    history: TuningHistory
    start: int
    converged: bool
    interrupted: bool = False

    @property
    def best(self) -> int:
        """The place of the best set of gains in the history."""
        return int(np.argmin(self.history.objective))

    @property
    def gains(self) -> dict[str, float]:
        """The best gains [SI] by path."""
        return dict(zip(self.history.paths, self.history.gains[self.best].tolist(), strict=True))

    @property
    def objective(self) -> float:
        """The objective of the best gains."""
        return float(self.history.objective[self.best])

    @property
    def present_objective(self) -> float | None:
        """The objective of the loop's own gains; None if one of them is outside its range."""
        return float(self.history.objective[0]) if self.start else None

    @property
    def loop(self) -> ControlLoop:
        """The loop of the first case with the best gains."""
        return loop_with_gains(self.cases[0], self.gains)

    @property
    def simulated_loops(self) -> int:
        """The number of loops that were simulated."""
        return len(self.history) * len(self.cases)

    @property
    def on_bound(self) -> Mapping[str, float]:
        """The best gains that lie on a bound of their range, within 1 % of it."""
        near = {}
        for each in self.ranges:
            place = float(each.to_unit(np.array(self.gains[each.path])))
            if not 0.01 <= place <= 0.99:
                near[each.path] = self.gains[each.path]
        return near

    @property
    def references(self) -> list[Reference]:
        """Sources of the optimiser, of the index, the controller and the plants."""
        return [HANSEN2016, *cite((self.index, *((case.loop.controller, case.plant) for case in self.cases)))]

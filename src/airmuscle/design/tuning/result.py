"""Result of a tuning: gains, history of the search, and the objective that was minimised."""

import dataclasses
import math
from collections.abc import Callable, Mapping

import numpy as np
import numpy.typing as npt

from ...core import Array, ColumnError, ParameterError, Reference, ShortRepr, check_field_types, cite, published, within
from ...core.errors import check_known
from ...engine.loop.control_loop import ControlLoop
from .case import GainRange, LoopCase, loop_with_gains
from .tracking import TrackingIndex

HANSEN2016 = published("hansen-2016")


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class CaseMetrics(ShortRepr):
    """Metrics (E, M) of E sets of gains in M cases.

    index        tracking index; infinite where a run failed
    air          air drawn by the muscles [kg/s]: sum of the increments of their air masses from sample to sample,
                 divided by the duration. Air that passes through a leak is not in it
    travel       travel of the commands in strokes, the ranges of their inputs, summed over the inputs [strokes/s]; an
                 on/off valve makes one stroke at each opening and each closing
    completed    whether the run reached its end with finite columns
    """

    index: Array
    air: Array
    travel: Array
    completed: npt.NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.index)


Objective = Callable[[CaseMetrics], npt.ArrayLike]


@dataclasses.dataclass(frozen=True)
class RobustObjective:
    """J = mean_i I_i + w Q_q(I_i) + w_a mean_i A_i + w_s mean_i S_i over the cases i; smaller is better.

    I tracking index, Q_q its q-quantile over the cases (linear interpolation; q = 1 is the worst case), A air drawn
    [kg/s], S travel [strokes/s]. The mean judges the usual plant, the quantile protects against the worst; the defaults
    w = 1 and q = 0.9 are chosen, and w_a = w_s = 0. J is infinite if a run of any case fails.
    """

    quantile: float = within(0, 1, default=0.9)
    quantile_weight: float = 1.0
    air_weight: float = 0.0
    travel_weight: float = 0.0

    def __post_init__(self) -> None:
        check_field_types(self)
        for name in ("quantile_weight", "air_weight", "travel_weight"):
            if not 0 <= getattr(self, name) < math.inf:
                raise ParameterError(f"RobustObjective: {name} is {getattr(self, name)}; it must be 0 or positive.")

    def __str__(self) -> str:
        weights = ((self.air_weight, "mean air drawn [kg/s]"), (self.travel_weight, "mean travel [strokes/s]"))
        parts = [f" + {weight:.4g} x {what}" for weight, what in weights if weight]
        return f"mean + {self.quantile_weight:.4g} x {self.quantile:.4g} quantile of the index{''.join(parts)}"

    def __call__(self, metrics: CaseMetrics) -> Array:
        """The objective (E,) of E sets of gains."""
        values = np.full(len(metrics), np.inf)
        complete = np.flatnonzero(np.isfinite(metrics.index).all(axis=1))
        if complete.size:
            index, air, travel = (each[complete] for each in (metrics.index, metrics.air, metrics.travel))
            worst = np.quantile(index, self.quantile, axis=1)
            values[complete] = index.mean(axis=1) + self.quantile_weight * worst
            values[complete] += self.air_weight * air.mean(axis=1)
            values[complete] += self.travel_weight * travel.mean(axis=1)
        return values


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
        check_known("history: no metric", metric, ("index", "air", "travel"), error=ColumnError)
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
        gains = self.gains
        places = {each.path: float(each.to_unit(np.array(gains[each.path]))) for each in self.ranges}
        return {path: gains[path] for path, place in places.items() if not 0.01 <= place <= 0.99}

    @property
    def references(self) -> list[Reference]:
        """Sources of the optimiser, of the index, the controller and the plants."""
        return [HANSEN2016, *cite((self.index, *((case.loop.controller, case.plant) for case in self.cases)))]

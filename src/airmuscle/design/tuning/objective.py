"""Tracking index, metrics and objective of a tuning, and the history of its search."""

import abc
import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from ...core import (
    Array,
    ColumnError,
    ParameterError,
    Reference,
    ShortRepr,
    check_field_types,
    published,
    within,
)
from ...core.errors import check_known, suggestion
from ...engine.loop import SETPOINT
from ...report.chapter import Table


@dataclasses.dataclass(frozen=True)
class TrackingIndex(abc.ABC):
    """An index of the control error e = r - y of a run, with set point r and controlled column y of
    the plant.

    scales  column and the size [SI] by which its error is divided. Without scales the only set
            point that is a column of the plant is used, and the index has its unit
    begin   the error before this time [s] from the start of the run is not counted

    With several columns, the magnitude of the error at one instant is sqrt(sum (e/scale)^2). The
    column y is the true one, not that which a sensor delivers.
    """

    references: ClassVar[tuple[Reference, ...]] = ()

    time_unit: ClassVar[str] = ""
    """What an integral over time adds to the unit of the error."""
    scales: Mapping[str, float] = dataclasses.field(default_factory=dict)
    begin: float = 0.0

    def __post_init__(self) -> None:
        check_field_types(self)
        for name, scale in self.scales.items():
            if not 0 < scale < math.inf:
                raise ParameterError(
                    f"{type(self).__name__}: scale of '{name}' is {scale}; it must be positive."
                )
        if not 0 <= self.begin < math.inf:
            raise ParameterError(
                f"{type(self).__name__}: begin is {self.begin} s; it must be 0 or positive."
            )

    def __str__(self) -> str:
        scales = [f"{name} divided by {scale:.4g} (SI)" for name, scale in self.scales.items()]
        begin = [f"from {self.begin:.4g} s"] if self.begin else []
        return ", ".join([type(self).__name__, *scales, *begin])

    def scales_for(self, setpoints: Sequence[str], columns: Sequence[str]) -> dict[str, float]:
        """The controlled columns with their scales, for the set points of a loop and the columns of
        a plant.
        """
        controlled = [name for name in setpoints if name in columns]
        for name in self.scales:
            if name not in controlled:
                raise ParameterError(
                    f"{type(self).__name__}: '{name}' is not both a set point and a column of the"
                    f" plant; {', '.join(controlled) or 'none'} is.{suggestion(name, controlled)}"
                )
        if not self.scales and len(controlled) != 1:
            what = " and ".join(controlled) or "no set point"
            raise ParameterError(
                f"{type(self).__name__}: {what} can be compared with columns of the plant; state"
                ' scales, the columns and the sizes by which their errors are divided: {"angle":'
                " 0.1}."
            )
        return dict(self.scales) or {controlled[0]: 1.0}

    def values(
        self, time: Array, columns: Mapping[str, Array], scales: Mapping[str, float]
    ) -> Array:
        """The index (N,) of N runs with rows at `time` (T,) [s] from the start; columns (N, T),
        with those of the set points. NaN for a run that ended early."""
        rows = time >= self.begin - 1e-12
        if np.count_nonzero(rows) < 2:
            raise ParameterError(
                f"{type(self).__name__}: fewer than two samples follow begin, {self.begin:g} s; the"
                f" run ends at {time[-1]:g} s."
            )
        squares = [
            ((columns[f"{SETPOINT}{name}"] - columns[name])[:, rows] / scale) ** 2
            for name, scale in scales.items()
        ]
        with np.errstate(over="ignore", invalid="ignore"):
            return self.of_magnitude(time[rows], np.sqrt(np.sum(squares, axis=0)))

    @abc.abstractmethod
    def of_magnitude(self, time: Array, magnitude: Array) -> Array:
        """The index (N,) of the magnitude (N, T) of the error at times (T,) [s]."""

    def unit(self, column_unit: str) -> str:
        """The unit of the index, given that of the error."""
        return f"{column_unit} {self.time_unit}".strip().removeprefix("1 ")


class RootMeanSquareError(TrackingIndex):
    """Root mean square error (RMSE): sqrt((1/T) integral e^2 dt), trapezoidal rule between the
    samples.
    """

    def of_magnitude(self, time: Array, magnitude: Array) -> Array:
        return np.asarray(np.sqrt(np.trapezoid(magnitude**2, time, axis=1) / (time[-1] - time[0])))


class IntegralAbsoluteError(TrackingIndex):
    """Integral of the absolute error (IAE): integral |e| dt, trapezoidal rule between the
    samples.
    """

    time_unit: ClassVar[str] = "s"

    def of_magnitude(self, time: Array, magnitude: Array) -> Array:
        return np.asarray(np.trapezoid(magnitude, time, axis=1))


class IntegralTimeAbsoluteError(TrackingIndex):
    """Integral of time-multiplied absolute error (ITAE): integral (t - t_begin) |e| dt; Graham and
    Lathrop (1953).
    """

    references: ClassVar[tuple[Reference, ...]] = (published("graham-lathrop-1953"),)
    time_unit: ClassVar[str] = "s^2"

    def of_magnitude(self, time: Array, magnitude: Array) -> Array:
        return np.asarray(np.trapezoid((time - time[0]) * magnitude, time, axis=1))


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class CaseMetrics(ShortRepr):
    """Metrics (E, M) of E sets of gains in M cases.

    index        tracking index; infinite where a run failed
    air          air drawn by the muscles [kg/s]: sum of the increments of their air masses from
                 sample to sample, divided by the duration. Air that passes through a leak is not in
                 it
    travel       travel of the commands in strokes, the ranges of their inputs, summed over the
                 inputs [strokes/s]; an on/off valve makes one stroke at each opening and each
                 closing
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
    """J = mean_i I_i + w Q_q(I_i) + w_a mean_i A_i + w_s mean_i S_i over the cases i; smaller is
    better.

    I tracking index, Q_q its q-quantile over the cases (linear interpolation; q = 1 is the worst
    case), A air drawn [kg/s], S travel [strokes/s]. The mean judges the usual plant, the quantile
    protects against the worst; the defaults w = 1 and q = 0.9 are chosen, and w_a = w_s = 0. J is
    infinite if a run of any case fails.
    """

    quantile: float = within(0, 1, default=0.9)
    quantile_weight: float = 1.0
    air_weight: float = 0.0
    travel_weight: float = 0.0

    def __post_init__(self) -> None:
        check_field_types(self)
        for name in ("quantile_weight", "air_weight", "travel_weight"):
            if not 0 <= getattr(self, name) < math.inf:
                raise ParameterError(
                    f"RobustObjective: {name} is {getattr(self, name)}; it must be 0 or positive."
                )

    def __str__(self) -> str:
        weights = (
            (self.air_weight, "mean air drawn [kg/s]"),
            (self.travel_weight, "mean travel [strokes/s]"),
        )
        parts = [f" + {weight:.4g} x {what}" for weight, what in weights if weight]
        return (
            f"mean + {self.quantile_weight:.4g} x {self.quantile:.4g} quantile of the"
            f" index{''.join(parts)}"
        )

    def __call__(self, metrics: CaseMetrics) -> Array:
        """The objective (E,) of E sets of gains."""
        values = np.full(len(metrics), np.inf)
        complete = np.flatnonzero(np.isfinite(metrics.index).all(axis=1))
        if complete.size:
            index, air, travel = (
                metric[complete] for metric in (metrics.index, metrics.air, metrics.travel)
            )
            worst = np.quantile(index, self.quantile, axis=1)
            values[complete] = index.mean(axis=1) + self.quantile_weight * worst
            values[complete] += self.air_weight * air.mean(axis=1)
            values[complete] += self.travel_weight * travel.mean(axis=1)
        return values


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class TuningHistory(ShortRepr):
    """Every set of gains that was simulated, in order: gains (E, D) [SI], objective (E,) and
    metrics (E, M).
    """

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
        """The sets of gains that no other one surpasses in both the mean index and another mean
        metric, by index.
        """
        error = self.means("index")
        cost = self.means(metric)
        order = np.lexsort((cost, error))
        order = order[np.isfinite(error[order]) & np.isfinite(cost[order])]
        lowest = np.minimum.accumulate(np.append(np.inf, cost[order]))[:-1]
        return np.asarray(order[cost[order] < lowest], dtype=np.intp)

    def table(self) -> Table:
        """Every set of gains with its objective and mean metrics [SI]."""
        columns: dict[str, Any] = {"set": list(range(len(self)))}
        for path, gains in zip(self.paths, self.gains.T, strict=True):
            columns[path] = gains
        columns["objective"] = self.objective
        for name in ("index", "air", "travel"):
            columns[f"mean {name}"] = self.means(name)
        return Table("history", "Sets of gains", columns, series=True)

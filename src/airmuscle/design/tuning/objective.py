"""Robust objective: one number for the indices of a set of gains in all cases."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from ...core.annotation import check_field_types
from ...core.arrays import Array
from ...core.errors import ParameterError
from ...core.short_repr import ShortRepr


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

    def part(self, rows: npt.NDArray[np.intp]) -> CaseMetrics:
        """The metrics of some of the sets of gains."""
        return CaseMetrics(self.index[rows], self.air[rows], self.travel[rows], self.completed[rows])


Objective = Callable[[CaseMetrics], npt.ArrayLike]


@dataclasses.dataclass(frozen=True)
class RobustObjective:
    """J = mean_i I_i + w Q_q(I_i) + w_a mean_i A_i + w_s mean_i S_i over the cases i; smaller is better.

    I tracking index, Q_q its q-quantile over the cases (linear interpolation; q = 1 is the worst case), A air drawn
    [kg/s], S travel [strokes/s]. The mean judges the usual plant, the quantile protects against the worst; the defaults
    w = 1 and q = 0.9 are chosen, and w_a = w_s = 0. J is infinite if a run of any case fails.
    """

    quantile: float = 0.9
    quantile_weight: float = 1.0
    air_weight: float = 0.0
    travel_weight: float = 0.0

    def __post_init__(self) -> None:
        check_field_types(self)
        if not 0 <= self.quantile <= 1:
            raise ParameterError(f"RobustObjective: quantile is {self.quantile}; allowed range: 0 to 1.")
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
            part = metrics.part(complete)
            worst = np.quantile(part.index, self.quantile, axis=1)
            values[complete] = part.index.mean(axis=1) + self.quantile_weight * worst
            values[complete] += self.air_weight * part.air.mean(axis=1)
            values[complete] += self.travel_weight * part.travel.mean(axis=1)
        return values

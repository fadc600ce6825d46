"""Tracking indices: one number for the control error of a run, over many runs at once."""

from __future__ import annotations

import abc
import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from ...core.annotation import check_field_types
from ...core.arrays import Array
from ...core.errors import ParameterError, suggestion
from ...core.reference import Reference
from ...engine.loop.control_loop import SETPOINT

GRAHAM_LATHROP1953 = Reference(
    key="graham-lathrop-1953",
    authors="Graham, D., Lathrop, R. C.",
    title="The synthesis of “optimum” transient response: criteria and standard forms",
    where="Transactions of the AIEE, Part II: Applications and Industry 72(5), 273-288",
    year=1953,
    note="integral of time-multiplied absolute error (ITAE)",
)


@dataclasses.dataclass(frozen=True)
class TrackingIndex(abc.ABC):
    """An index of the control error e = r - y of a run, with set point r and controlled column y of the plant.

    scales  column and the size [SI] by which its error is divided. Without scales the only set point that is a column
            of the plant is used, and the index has its unit
    begin   the error before this time [s] from the start of the run is not counted

    With several columns, the magnitude of the error at one instant is sqrt(sum (e/scale)^2). The column y is the true
    one, not that which a sensor delivers.
    """

    references: ClassVar[tuple[Reference, ...]] = ()

    scales: Mapping[str, float] = dataclasses.field(default_factory=dict)
    begin: float = 0.0

    def __post_init__(self) -> None:
        check_field_types(self)
        for name, scale in self.scales.items():
            if not 0 < scale < math.inf:
                raise ParameterError(f"{type(self).__name__}: scale of '{name}' is {scale}; it must be positive.")
        if not 0 <= self.begin < math.inf:
            raise ParameterError(f"{type(self).__name__}: begin is {self.begin} s; it must be 0 or positive.")

    def __str__(self) -> str:
        scales = [f"{name} divided by {scale:.4g} (SI)" for name, scale in self.scales.items()]
        begin = [f"from {self.begin:.4g} s"] if self.begin else []
        return ", ".join([type(self).__name__, *scales, *begin])

    def scales_for(self, setpoints: Sequence[str], columns: Sequence[str]) -> dict[str, float]:
        """The controlled columns with their scales, for the set points of a loop and the columns of a plant."""
        controlled = [name for name in setpoints if name in columns]
        for name in self.scales:
            if name not in controlled:
                raise ParameterError(
                    f"{type(self).__name__}: '{name}' is not both a set point and a column of the plant; "
                    f"{', '.join(controlled) or 'none'} is.{suggestion(name, controlled)}"
                )
        if not self.scales and len(controlled) != 1:
            what = " and ".join(controlled) or "no set point"
            raise ParameterError(
                f"{type(self).__name__}: {what} can be compared with columns of the plant; state scales, the columns "
                'and the sizes by which their errors are divided: {"angle": 0.1}.'
            )
        return dict(self.scales) or {controlled[0]: 1.0}

    def values(self, time: Array, columns: Mapping[str, Array], scales: Mapping[str, float]) -> Array:
        """The index (N,) of N runs with rows at `time` (T,) [s] from the start; columns (N, T), with those of the set
        points. NaN for a run that ended early."""
        rows = time >= self.begin - 1e-12
        if np.count_nonzero(rows) < 2:
            raise ParameterError(
                f"{type(self).__name__}: fewer than two samples follow begin, {self.begin:g} s; the run ends at "
                f"{time[-1]:g} s."
            )
        squares = [
            ((columns[f"{SETPOINT}{name}"] - columns[name])[:, rows] / scale) ** 2 for name, scale in scales.items()
        ]
        with np.errstate(over="ignore", invalid="ignore"):
            return self.of_magnitude(time[rows], np.sqrt(np.sum(squares, axis=0)))

    @abc.abstractmethod
    def of_magnitude(self, time: Array, magnitude: Array) -> Array:
        """The index (N,) of the magnitude (N, T) of the error at times (T,) [s]."""

    @abc.abstractmethod
    def unit(self, column_unit: str) -> str:
        """The unit of the index, given that of the error."""


class RootMeanSquareError(TrackingIndex):
    """Root mean square error (RMSE): sqrt((1/T) integral e^2 dt), trapezoidal rule between the samples."""

    def of_magnitude(self, time: Array, magnitude: Array) -> Array:
        return np.asarray(np.sqrt(np.trapezoid(magnitude**2, time, axis=1) / (time[-1] - time[0])))

    def unit(self, column_unit: str) -> str:
        return column_unit


class IntegralAbsoluteError(TrackingIndex):
    """Integral of the absolute error (IAE): integral |e| dt, trapezoidal rule between the samples."""

    def of_magnitude(self, time: Array, magnitude: Array) -> Array:
        return np.asarray(np.trapezoid(magnitude, time, axis=1))

    def unit(self, column_unit: str) -> str:
        return "s" if column_unit == "1" else f"{column_unit} s"


class IntegralTimeAbsoluteError(TrackingIndex):
    """Integral of time-multiplied absolute error (ITAE): integral (t - t_begin) |e| dt; Graham and Lathrop (1953)."""

    references: ClassVar[tuple[Reference, ...]] = (GRAHAM_LATHROP1953,)

    def of_magnitude(self, time: Array, magnitude: Array) -> Array:
        return np.asarray(np.trapezoid((time - time[0]) * magnitude, time, axis=1))

    def unit(self, column_unit: str) -> str:
        return "s^2" if column_unit == "1" else f"{column_unit} s^2"

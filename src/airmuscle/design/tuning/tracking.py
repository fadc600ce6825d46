"""Measures of runs: tracking indices, and the amplitude of a periodic waveform."""

import abc
import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from ...core import Array, ParameterError, Reference, check_field_types, published, suggestion
from ...engine.loop.control_loop import SETPOINT

MAX_HARMONICS, ROWS_PER_HARMONIC, SURE_HARMONICS = 15, 4, 5
"""Maximum number of harmonics of the waveform of an oscillation, rows of a period for each of them, and number of
harmonics for which two rows of a period are enough (chosen)."""
START_STEP = 0.02
"""Change of the phases of the extrema [periods] with which their search starts (chosen)."""
ARC_DEGREE, ROWS_PER_ARC, BETTER = 6, 25, 0.8
"""Degree of the polynomials from one extremum to the other, rows of half a period that they need, and largest ratio of
their residual variance to that of the series with which they replace it (chosen)."""


def waveform_amplitude(time: Array, values: Array, period: float, periods: int) -> float:
    """Half the range of the periodic waveform through the rows (N,), by least squares.

    The waveform is a Fourier series, or two polynomials of degree 6 in the phase between two extrema where these have a
    clearly smaller residual variance. The series rounds off the corners at the extrema of a relay oscillation of a
    first-order process, by 2.4 % of the amplitude with 15 harmonics; polynomials need 50 rows a period.
    """
    phase, wave, variance = _harmonic_wave(time, values, period, values.size // periods)
    amplitude = 0.5 * float(np.ptp(wave))
    if values.size < 2 * ROWS_PER_ARC * periods:
        return amplitude
    from scipy.optimize import minimize

    rows, start = time / period, np.array([phase[wave.argmin()], phase[wave.argmax()]])
    simplex = start + START_STEP * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    options = {"initial_simplex": simplex, "xatol": 1e-5, "fatol": 0.0, "maxiter": 80}
    found = minimize(lambda at: _two_arcs(rows, values, at)[0], start, method="Nelder-Mead", options=options).x
    residual, of_arcs = _two_arcs(rows, values, found)
    return of_arcs if residual / (values.size - 2 * (ARC_DEGREE + 2)) < BETTER * variance else amplitude


def _harmonic_wave(time: Array, values: Array, period: float, rows: int) -> tuple[Array, Array, float]:
    """Phases [periods] and values of the Fourier series through the rows, over one period, and residual variance."""
    count = max(1, min(MAX_HARMONICS, max(rows // ROWS_PER_HARMONIC, min(SURE_HARMONICS, (rows - 1) // 2))))
    order = np.arange(1, count + 1)
    phases = 2 * math.pi / period * np.outer(time, order)
    matrix = np.column_stack([np.ones(time.size), np.cos(phases), np.sin(phases)])
    coefficients = np.linalg.lstsq(matrix, values, rcond=None)[0]
    residual = float(np.sum((values - matrix @ coefficients) ** 2))
    phase = np.arange(32 * count) / (32 * count)
    fine = 2 * math.pi * np.outer(phase, order)
    wave = np.column_stack([np.cos(fine), np.sin(fine)]) @ coefficients[1:]
    return phase, np.asarray(wave), residual / max(values.size - 2 * count - 1, 1)


def _two_arcs(phase: Array, values: Array, extrema: Array) -> tuple[float, float]:
    """Residual sum of squares and half range of polynomials from minimum to maximum and back, by least squares.

    `phase` [periods] of the rows, `extrema` phases of the minimum and of the maximum. The ends of both polynomials
    need not meet; each extremum is the mean of the two ends.
    """
    residual, ends = 0.0, []
    for first, last in (extrema, extrema[::-1]):
        width = (last - first) % 1.0
        position = (phase - first) % 1.0
        on_arc = position <= width
        if np.count_nonzero(on_arc) <= ARC_DEGREE:
            return math.inf, math.nan
        x, y = 2.0 * position[on_arc] / width - 1.0, values[on_arc]
        basis = np.polynomial.chebyshev.chebvander(x, ARC_DEGREE)
        coefficients = np.linalg.lstsq(basis, y, rcond=None)[0]
        residual += float(np.sum((y - basis @ coefficients) ** 2))
        ends.append(np.polynomial.chebyshev.chebval([-1.0, 1.0], coefficients))
    (low, high), (back_high, back_low) = ends
    return residual, 0.25 * float(high + back_high - low - back_low)


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

    time_unit: ClassVar[str] = ""
    """What an integral over time adds to the unit of the error."""
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

    def unit(self, column_unit: str) -> str:
        """The unit of the index, given that of the error."""
        return f"{column_unit} {self.time_unit}".strip().removeprefix("1 ")


class RootMeanSquareError(TrackingIndex):
    """Root mean square error (RMSE): sqrt((1/T) integral e^2 dt), trapezoidal rule between the samples."""

    def of_magnitude(self, time: Array, magnitude: Array) -> Array:
        return np.asarray(np.sqrt(np.trapezoid(magnitude**2, time, axis=1) / (time[-1] - time[0])))


class IntegralAbsoluteError(TrackingIndex):
    """Integral of the absolute error (IAE): integral |e| dt, trapezoidal rule between the samples."""

    time_unit: ClassVar[str] = "s"

    def of_magnitude(self, time: Array, magnitude: Array) -> Array:
        return np.asarray(np.trapezoid(magnitude, time, axis=1))


class IntegralTimeAbsoluteError(TrackingIndex):
    """Integral of time-multiplied absolute error (ITAE): integral (t - t_begin) |e| dt; Graham and Lathrop (1953)."""

    references: ClassVar[tuple[Reference, ...]] = (published("graham-lathrop-1953"),)
    time_unit: ClassVar[str] = "s^2"

    def of_magnitude(self, time: Array, magnitude: Array) -> Array:
        return np.asarray(np.trapezoid((time - time[0]) * magnitude, time, axis=1))

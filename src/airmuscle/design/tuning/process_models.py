"""Process models with dead time, first order or integrator, and the ultimate point: identified from
experiments.
"""

import dataclasses
import math
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from ...core import Array, ParameterError, Reference, check_field_types, published

UNSETTLED = 0.05
"""Relative change in the last tenth of a step response from which on it is not settled (chosen)."""
DEAD_BAND = 0.25
"""Part of the amplitude that an oscillation exceeds on both sides of its middle in each period
(chosen).
"""
NOTE = (
    "The gain is that of the describing function, which supposes a sine: for first order with dead"
    " time, it differs by -19 % to +27 % from the exact ultimate gain."
)
MIN_ROWS = 10
"""Smallest number of rows of an experiment (chosen)."""
MAX_HARMONICS = 15
ROWS_PER_HARMONIC = 4
SURE_HARMONICS = 5
"""Maximum number of harmonics of the waveform of an oscillation, rows of a period for each of them,
and number of harmonics for which two rows of a period are enough (chosen)."""
START_STEP = 0.02
"""Change of the phases of the extrema [periods] with which their search starts (chosen)."""
ARC_DEGREE = 6
ROWS_PER_ARC = 25
BETTER = 0.8
"""Degree of the polynomials from one extremum to the other, rows of half a period that they need,
and largest ratio of their residual variance to that of the series with which they replace it
(chosen)."""


class _Process:
    """Base of what an experiment identifies: a gain or rate is not 0, a time is positive, and a
    dead time may be 0.
    """

    def __post_init__(self) -> None:
        check_field_types(self)
        for name in ("gain", "rate", "time_constant", "period", "dead_time"):
            value = getattr(self, name, 1.0)
            size = abs(value) if name in ("gain", "rate") else value
            if not (0.0 < size < math.inf or (size == 0.0 and name == "dead_time")):
                raise ParameterError(
                    f"{type(self).__name__}: {name} is {value}; no step response has that."
                )


@dataclasses.dataclass(frozen=True)
class FirstOrderDeadTime(_Process):
    """G(s) = K exp(-L s)/(T s + 1): gain K [y/u], time constant T [s], dead time L [s]."""

    gain: float
    time_constant: float
    dead_time: float

    def step_response(self, time: Array) -> Array:
        """The response (N,) to a unit step at time 0, at times (N,) [s]."""
        late = np.maximum(time - self.dead_time, 0.0)
        return np.asarray(-self.gain * np.expm1(-late / self.time_constant))


@dataclasses.dataclass(frozen=True)
class IntegratorDeadTime(_Process):
    """G(s) = K_v exp(-L s)/s: rate K_v [y/(u s)], dead time L [s]."""

    rate: float
    dead_time: float

    def step_response(self, time: Array) -> Array:
        """The response (N,) to a unit step at time 0, at times (N,) [s]."""
        return np.asarray(self.rate * np.maximum(time - self.dead_time, 0.0))


ProcessModel = FirstOrderDeadTime | IntegratorDeadTime


@dataclasses.dataclass(frozen=True)
class UltimatePoint(_Process):
    """The point of the frequency response at a phase of -180 degrees: ultimate gain K_u [u/y] and
    period T_u [s].
    """

    references: ClassVar[tuple[Reference, ...]] = (published("astrom-hagglund-1984"),)

    gain: float
    period: float
    note: str = ""
    """How the point was found, with the error of the method."""

    def first_order(self, static_gain: float) -> FirstOrderDeadTime:
        """The first-order model with dead time of this static gain [y/u] that passes through the
        point:

            T = T_u/(2 pi) sqrt((K K_u)^2 - 1),    L = T_u/(2 pi) (pi - atan(2 pi T/T_u))

        Raises ParameterError for K K_u of 1 or less, where there is none.
        """
        product = static_gain * self.gain
        if not product > 1:
            raise ParameterError(
                f"UltimatePoint: static gain times ultimate gain is {product:.4g}; it must be above"
                " 1 for a model of first order with dead time."
            )
        frequency = 2 * math.pi / self.period
        constant = math.sqrt(product**2 - 1) / frequency
        return FirstOrderDeadTime(
            static_gain, constant, (math.pi - math.atan(frequency * constant)) / frequency
        )


def first_order_of_step(
    time: npt.ArrayLike, output: npt.ArrayLike, step: float, step_time: float | None = None
) -> FirstOrderDeadTime:
    """The first-order model with dead time of a step response, by the times at 28.3 % and 63.2 %
    (Smith 1972).

    time, output  rows (N,); the last tenth of the output is its final value
    step          size of the step [u]
    step_time     time of the step [s]; the mean of the rows until then is the initial value. By
                  default the first row is that of the step, and the initial value is this row alone

    T = 1.5 (t_63 - t_28), L = t_63 - T. Raises ParameterError for an output that does not settle or
    does not change.
    """
    t, y, initial = _rows(time, output, step, step_time)
    change = float(y[-max(1, y.size // 10) :].mean() - initial)
    spread = float(np.ptp(y[-max(1, y.size // 10) :]))
    if change == 0.0 or spread > UNSETTLED * abs(change):
        raise ParameterError(
            f"step response: the output changes by {change:.4g} and still by {spread:.4g} in its"
            " last tenth; record until it settles, or identify an integrator."
        )
    part = (y - initial) / change
    early, late = (
        _time_of_level(t, part, level) for level in (1 - math.exp(-1 / 3), 1 - math.exp(-1))
    )
    constant = 1.5 * (late - early)
    return FirstOrderDeadTime(change / step, max(constant, 1e-12), max(late - constant, 0.0))


def integrator_of_step(
    time: npt.ArrayLike, output: npt.ArrayLike, step: float, step_time: float | None = None
) -> IntegratorDeadTime:
    """The integrator with dead time of a step response: the straight line through the second half
    of the rows.

    The dead time is where the line passes through the initial output. Arguments as in
    `first_order_of_step`.
    """
    t, y, initial = _rows(time, output, step, step_time)
    half = t >= t[-1] / 2
    slope, offset = np.polyfit(t[half], y[half], 1)
    if slope == 0.0:
        raise ParameterError(
            "step response: the output does not move in its second half; it is no integrator."
        )
    return IntegratorDeadTime(float(slope) / step, max(float((initial - offset) / slope), 0.0))


def ultimate_point(
    time: npt.ArrayLike, output: npt.ArrayLike, amplitude: float, hysteresis: float = 0.0
) -> UltimatePoint:
    """The ultimate point of a relay experiment: K_u = 4 d/(pi sqrt(a^2 - e^2)) by the describing
    function.

    time, output  rows (N,) of the oscillation; its last half counts, which must contain two periods
                  or more
    amplitude     d, half the difference between both commands of the relay [u]
    hysteresis    e, half the width of the relay's hysteresis [y]

    a is half the range of the periodic waveform, so that the noise of the rows does not enlarge it.
    The describing function supposes a sine. For first order with dead time L and time constant T,
    the rule gives an ultimate gain that differs from the exact one by -19 % at L/T = 0 (an
    integrator), -17 % at 0.3, -11 % at 1, +4 % at 3, and up to +27 % for dead time alone; the
    `note` of the result says so. Reference: Åström and Hägglund (1984). Raises ParameterError for
    an output that does not oscillate.
    """
    t, y, _ = _rows(time, output, amplitude)
    late = t >= t[-1] / 2
    t = t[late]
    y = y[late]
    extent = float(np.ptp(y)) / 2
    around = y - (y.max() + y.min()) / 2
    # rows before the first rising crossing of zero between each row below the dead band and the
    # next row above it
    decided = np.flatnonzero(np.abs(around) > DEAD_BAND * extent)
    lows = decided[:-1][(around[decided[:-1]] < 0) & (around[decided[1:]] > 0)]
    zeros = np.flatnonzero((around[:-1] < 0) & (around[1:] >= 0))
    rising = zeros[np.searchsorted(zeros, lows)]
    a = extent
    if rising.size >= 3:
        crossings = t[rising] - around[rising] * (t[rising + 1] - t[rising]) / (
            around[rising + 1] - around[rising]
        )
        period = float(crossings[-1] - crossings[0]) / (rising.size - 1)
        complete = (t >= crossings[0]) & (t < crossings[-1])
        a = waveform_amplitude(t[complete], y[complete], period, rising.size - 1)
    if rising.size < 3 or a <= abs(hysteresis):
        raise ParameterError(
            f"relay experiment: {rising.size} rising crossings and an amplitude of {a:.4g} in the"
            " second half; at least three crossings and an amplitude above the hysteresis are"
            " needed. Record for longer."
        )
    return UltimatePoint(4 * amplitude / (math.pi * math.sqrt(a**2 - hysteresis**2)), period, NOTE)


def waveform_amplitude(time: Array, values: Array, period: float, periods: int) -> float:
    """Half the range of the periodic waveform through the rows (N,), by least squares.

    The waveform is a Fourier series, or two polynomials of degree 6 in the phase between two
    extrema where these have a clearly smaller residual variance. The series rounds off the corners
    at the extrema of a relay oscillation of a first-order process, by 2.4 % of the amplitude with
    15 harmonics; polynomials need 50 rows a period.
    """
    rows = values.size // periods
    count = max(
        1, min(MAX_HARMONICS, max(rows // ROWS_PER_HARMONIC, min(SURE_HARMONICS, (rows - 1) // 2)))
    )
    order = np.arange(1, count + 1)
    phase = np.arange(32 * count) / (32 * count)
    phases = 2 * math.pi / period * np.outer(time, order)
    fine = 2 * math.pi * np.outer(phase, order)
    matrix = np.column_stack([np.ones(time.size), np.cos(phases), np.sin(phases)])
    coefficients = np.linalg.lstsq(matrix, values, rcond=None)[0]
    variance = float(np.sum((values - matrix @ coefficients) ** 2)) / max(
        values.size - 2 * count - 1, 1
    )
    wave = np.column_stack([np.cos(fine), np.sin(fine)]) @ coefficients[1:]
    amplitude = 0.5 * float(np.ptp(wave))
    if values.size < 2 * ROWS_PER_ARC * periods:
        return amplitude
    from scipy.optimize import minimize

    place, start = time / period, np.array([phase[wave.argmin()], phase[wave.argmax()]])
    simplex = start + START_STEP * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    options = {"initial_simplex": simplex, "xatol": 1e-5, "fatol": 0.0, "maxiter": 80}
    turning_points = minimize(
        lambda at: _two_arcs(place, values, at)[0], start, method="Nelder-Mead", options=options
    ).x
    residual, of_arcs = _two_arcs(place, values, turning_points)
    return (
        of_arcs
        if residual / (values.size - 2 * (ARC_DEGREE + 2)) < BETTER * variance
        else amplitude
    )


def _two_arcs(phase: Array, values: Array, extrema: Array) -> tuple[float, float]:
    """Residual sum of squares and half range of polynomials from minimum to maximum and back, by
    least squares.

    `phase` [periods] of the rows, `extrema` phases of the minimum and of the maximum. The ends of
    both polynomials need not meet; each extremum is the mean of the two ends.
    """
    residual = 0.0
    ends = []
    for first, last in (extrema, extrema[::-1]):
        width = (last - first) % 1.0
        position = (phase - first) % 1.0
        on_arc = position <= width
        if np.count_nonzero(on_arc) <= ARC_DEGREE:
            return math.inf, math.nan
        x = 2.0 * position[on_arc] / width - 1.0
        y = values[on_arc]
        basis = np.polynomial.chebyshev.chebvander(x, ARC_DEGREE)
        coefficients = np.linalg.lstsq(basis, y, rcond=None)[0]
        residual += float(np.sum((y - basis @ coefficients) ** 2))
        ends.append(np.polynomial.chebyshev.chebval([-1.0, 1.0], coefficients))
    (low, high), (back_high, back_low) = ends
    return residual, 0.25 * float(high + back_high - low - back_low)


def _rows(
    time: npt.ArrayLike, output: npt.ArrayLike, size: float, step_time: float | None = None
) -> tuple[Array, Array, float]:
    """The rows from a step on, or all, with times counted from it or from the first row, and the
    initial value.
    """
    t = np.asarray(time, dtype=float)
    y = np.asarray(output, dtype=float)
    if t.ndim != 1 or t.shape != y.shape or t.size < MIN_ROWS or not (np.diff(t) > 0).all():
        raise ParameterError(
            f"experiment: times of shape {t.shape} and outputs of shape {y.shape}; at least"
            f" {MIN_ROWS} rows at rising times are needed."
        )
    if not (np.isfinite(y).all() and math.isfinite(size) and size != 0.0):
        raise ParameterError(
            f"experiment: the output must be finite and the step, {size}, finite and not 0."
        )
    if step_time is None:
        return t - t[0], y, float(y[0])
    t = (t - t[0]) + float(t[0] - step_time)
    after = t >= 0.0
    if not (t <= 0.0).any() or np.count_nonzero(after) < MIN_ROWS:
        raise ParameterError(
            f"step response: the step is at {step_time:g} s; one row or more must be until then and"
            f" {MIN_ROWS} or more from then on."
        )
    return t[after], y[after], float(y[t <= 0.0].mean())


def _time_of_level(time: Array, part: Array, level: float) -> float:
    """The time at which the lines between the rows reach a level: the time below it until they are
    halfway from the level to the final value, so that neither noise about the level nor a later
    swing below it counts.
    """
    if part[0] >= level:
        return float(time[0])
    beyond = np.flatnonzero(part >= (1.0 + level) / 2)
    if not beyond.size:
        raise ParameterError(
            f"step response: it does not reach {50 * (1 + level):.3g} % of its change."
        )
    below = level - part[: int(beyond[0]) + 1]
    low = np.minimum(below[:-1], below[1:])
    high = np.maximum(below[:-1], below[1:])
    shares = np.clip(high / np.where(high > low, high - low, 1.0), 0.0, 1.0)
    shares = np.where(high > low, shares, high > 0.0)
    return float(time[0] + shares @ np.diff(time[: below.size]))

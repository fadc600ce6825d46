"""Creep of a muscle: holds in recordings, their fit by one or two time constants, and conversion to
Maxwell elements.

A hold at constant length relaxes: F(t) = F_inf + Sum k_i z_0 exp(-t/tau_i) after a change of length
z_0, so that the amplitudes give the stiffnesses directly. A hold under constant load retards: the
operational compliance is D(s) = J_0 + Sum J_i/(1 + s lambda_i), and the operational stiffness of
the muscle with its Maxwell elements is its reciprocal, K + Sum k_i s tau_i/(1 + s tau_i); the
relaxation times belong to the zeros of D. Reference: Tschoegl, N. W., The Phenomenological Theory
of Linear Viscoelastic Behavior, Springer, 1989.
"""

import abc
import dataclasses
import functools
import math
from typing import Any, NamedTuple

import numpy as np

from ...core import Array, IdentificationError, ParameterError, model, one_line, parameter
from ...physics.muscle import CreepElements
from ...recording import Recording
from ..estimation import (
    Accuracy,
    FreeParameter,
    LeastSquares,
    MeasuredProblem,
    SolvedProblem,
    effective_sample_size,
    f_test_p_value,
    solve_iteratively,
)
from ..inspection import (
    RELATIVE_BAND,
    SAME_READING,
    Interval,
    constant_band,
    estimate_noise,
    estimate_resolution,
    find_plateaus,
    level_intervals,
    rounding,
)
from .result import SIGNIFICANCE_LEVEL

MIN_ROWS = 12
"""Minimum number of rows for a fit of creep."""
GRID_SIZE = 40
"""Grid of initial time constants, evenly spaced in their logarithm over the observable range
(chosen).
"""
MIN_RATIO = 3.0
"""Minimum ratio of two time constants (chosen): closer ones cannot be separated, and their
amplitudes diverge.
"""
LENGTH_TOLERANCE = 5e-4
"""Range of contraction within which the length counts as constant (chosen)."""
DRIFT = 2.0
"""Change of the level of a quantity that creeps, in standard deviations of its noise (chosen)."""


@dataclasses.dataclass(frozen=True)
class Hold:
    """The rows of a hold, and the quantity that creeps: contraction under a load, force at a
    constant length.
    """

    interval: Interval
    quantity: str


def find_holds(recording: Recording) -> tuple[Hold, ...]:
    """The holds among the pressure plateaus of a recording; none without a time column."""
    force = recording["force"]
    contraction = recording["contraction"]
    holds = list[Hold]()
    for plateau in find_plateaus(recording, columns=("pressure",)):
        rows = plateau.interval.rows
        is_long = len(plateau.interval) >= MIN_ROWS
        has_constant_force = np.ptp(force[rows]) <= RELATIVE_BAND * np.abs(force).max()
        relaxes = _drifts(force[rows]) and not _drifts(contraction[rows])
        if is_long and has_constant_force and not relaxes:
            holds.append(Hold(plateau.interval, "contraction"))
        else:
            levels = level_intervals(contraction, LENGTH_TOLERANCE, within=plateau.interval)
            holds += [Hold(_trim_to_level(contraction, level), "force") for level in levels]
    return tuple(hold for hold in holds if len(hold.interval) >= MIN_ROWS)


def _drifts(values: Array) -> bool:
    """Whether the level of the values changes beyond their noise from the first to the last quarter
    of the rows.
    """
    quarter = max(values.size // 4, 1)
    return bool(
        abs(np.median(values[-quarter:]) - np.median(values[:quarter]))
        > max(DRIFT * estimate_noise(values), _jitter(values))
    )


def _jitter(values: Array) -> float:
    """The difference up to which readings of a held quantity (N,) may be of one value: one count,
    or rounding.
    """
    count = estimate_resolution(values, constant_band("", values))
    return max((1.0 + SAME_READING) * count, rounding("", values))


def _trim_to_level(values: Array, level: Interval) -> Interval:
    """The interval without the transitions to and from its level."""
    inside = values[level.rows]
    band = max(LENGTH_TOLERANCE / 10.0, 4.0 * estimate_noise(inside), _jitter(inside))
    near = np.flatnonzero(np.abs(inside - np.median(inside)) <= band)
    return (
        Interval(level.start + int(near[0]), level.start + int(near[-1]) + 1)
        if near.size
        else Interval(0, 0)
    )


@model
class Creep:
    """y(t) = y_0 + Sum a_i (1 - exp(-t/tau_i)): Kelvin-Voigt elements in series, t from the start
    of the hold.

    y contraction [1] or force [N], y_0 its initial value, a_i and tau_i amplitude and time constant
    of each element.
    """

    initial: float = parameter("1 or N", "y_0", "value at the start of the hold")
    amplitudes: tuple[float, ...] = parameter(
        "1 or N", "a_i", "amplitude of each element", default=()
    )
    time_constants: tuple[float, ...] = parameter(
        "s", "tau_i", "time constant of each element", bounds=(1e-6, 1e9), default=()
    )

    def check(self) -> None:
        if len(self.amplitudes) != len(self.time_constants):
            raise ParameterError(
                f"Creep: there are {len(self.amplitudes)} amplitudes and {len(self.time_constants)}"
                " time constants; give one of each for every element."
            )

    def value_at(self, time: Any) -> Any:
        """The value at times [s] from the start of the hold."""
        elapsed = np.asarray(time, dtype=float)
        value = self.initial + 0.0 * elapsed
        for amplitude, constant in zip(self.amplitudes, self.time_constants, strict=True):
            value = value + amplitude * (1.0 - np.exp(-elapsed / constant))
        return value


@dataclasses.dataclass(frozen=True, eq=False)
class CreepFit:
    """Creep with the number of elements that the data justify: zero, one or two."""

    creep: Creep
    rmse: float
    rmse_by_order: tuple[float, ...]
    """Rms error with zero, one and two elements."""
    p_values: tuple[float, ...]
    """p-value of the F test for the first and the second element."""
    duration: float
    """Length of the hold [s]."""
    unit: str = ""
    """Unit of the creeping quantity; empty for a contraction."""
    solved: SolvedProblem | None = None
    """The problem with the time constants: covariance, profiles, bootstrap; None without creep."""

    @property
    def verdict(self) -> str:
        """The number of justified elements, as sentences with the numbers."""
        count = len(self.creep.amplitudes)
        unit = f" {self.unit}" if self.unit else ""
        pairs = zip(self.creep.amplitudes, self.creep.time_constants, strict=True)
        elements = ", ".join(f"{amplitude:.3g}{unit} with {tau:.3g} s" for amplitude, tau in pairs)
        subject = ("no creep", "creep with one time constant", "creep with two time constants")[
            count
        ]
        rms = ", ".join(f"{value:.3g}" for value in self.rmse_by_order)
        subject += f" ({elements})" if elements else ""
        text = (
            f"The data justify {subject}; rms error with zero, one and two time constants:"
            f" {rms}{unit}."
        )
        too_short = (
            f" The record of {self.duration:.3g} s is too short for the longest time constant, so"
            " the final value is extrapolated."
        )
        return (
            text + too_short
            if count and max(self.creep.time_constants) > self.duration / 2
            else text
        )


def fit_creep(recording: Recording, quantity: str) -> CreepFit:
    """Fit creep of a column, `contraction` or `force`, to the rows of a hold at constant pressure.
    Time counts from the first row. An element is added as long as the F test is significant. Raises
    IdentificationError for another column, fewer than 12 rows, or time that does not increase."""
    if quantity not in ("contraction", "force"):
        raise IdentificationError(
            f"{recording.origin}: creep of the column '{one_line(quantity)}' is not fitted; give"
            " 'contraction' or 'force'. A length becomes a contraction where the recording states"
            " the resting length."
        )
    known = np.isfinite(recording[quantity])
    time = recording["time"][known]
    values = recording[quantity][known]
    if time.size < 12 or not (np.diff(time) > 0).all():
        raise IdentificationError(
            f"{recording.origin}: a fit of creep needs 12 or more rows of a hold in increasing"
            f" time; there are {time.size} rows."
        )
    time = time - time[0]
    fits = [
        _Elements(Creep(float(np.mean(values))), None),
        _fit_elements(time, values, 1),
        _fit_elements(time, values, 2),
    ]
    squares = [float(np.mean((fit.creep.value_at(time) - values) ** 2)) for fit in fits]
    sample_size = effective_sample_size(fits[-1].creep.value_at(time) - values)
    p_values = tuple(
        f_test_p_value(squares[i], squares[i + 1], sample_size, 3 + 2 * i, 2) for i in (0, 1)
    )
    count = 0
    while count < 2 and p_values[count] < SIGNIFICANCE_LEVEL:
        count += 1
    rmse_by_order = tuple(float(np.sqrt(square)) for square in squares)
    unit = "N" if quantity == "force" else ""
    creep, solved = fits[count]
    return CreepFit(
        creep, rmse_by_order[count], rmse_by_order, p_values, float(time[-1]), unit, solved
    )


class _Elements(NamedTuple):
    """Creep, and the problem with its time constants if it has any."""

    creep: Creep
    solved: SolvedProblem | None


def _fit_elements(time: Array, values: Array, count: int) -> _Elements:
    """Nonlinear least squares in the time constants from the best grid point; the other parameters
    are linear.
    """
    low = np.log(np.median(np.diff(time)))
    high = np.log(2.0 * time[-1])
    min_step = np.log(MIN_RATIO)
    problem = HoldProblem(values, (1.0,), (), time)
    grid = np.linspace(low, high, GRID_SIZE)[1:-1]
    steps = grid - low + 1.01 * min_step
    starts: list[tuple[float, ...]]
    if count == 1:
        starts = [(logarithm,) for logarithm in grid]
    else:
        starts = [(a, b) for a in grid for b in steps[::3] if a + b < high]

    def sum_of_squares(start: tuple[float, ...]) -> float:
        return float(np.sum((problem.predict(np.exp(start)) - values) ** 2))

    best = min(starts, key=sum_of_squares)
    greatest_step = max(high - low, 2.0 * min_step)
    limits = np.exp([(low, high), (min_step, greatest_step)][:count])
    problem = HoldProblem(values, tuple(np.exp(best)), tuple(map(tuple, limits)), time)
    solved = problem.solve()
    times = np.asarray(np.cumprod(solved.values))
    coefficients = problem.linear_part(times)
    creep = Creep(float(coefficients[0]), tuple(coefficients[1:]), tuple(times))
    return _Elements(creep, solved)


@dataclasses.dataclass(frozen=True, eq=False)
class TimeConstantProblem(MeasuredProblem):
    """Measured values, and the time constants of a sum of exponentials: the first [s], and the
    ratio of each further one to the one before. What is linear is solved for at every evaluation.
    """

    target: Array
    initial: tuple[float, ...]
    limits: tuple[tuple[float, float], ...]
    name = "creep"
    origin = "hold"
    accuracy = Accuracy(1e-9, 1e-12)

    @abc.abstractmethod
    def columns(self, times: Array) -> Array:
        """The columns (N, C) in whose coefficients the values are linear, of time constants
        [s].
        """

    @functools.cached_property
    def parameters(self) -> tuple[FreeParameter, ...]:
        parameters = []
        for i, value in enumerate(self.initial):
            name = f"tau_{i + 1}/tau_{i}" if i else "tau_1"
            unit = "1" if i else "s"
            meaning = "ratio of time constants" if i else "first time constant"
            limits = self.limits[i]
            parameters.append(
                FreeParameter(name, name, value, limits, unit, meaning, is_logarithmic=True)
            )
        return tuple(parameters)

    def linear_part(self, times: Array) -> Array:
        """The coefficients (C,) of the columns."""
        return np.asarray(np.linalg.lstsq(self.columns(times), self.target, rcond=None)[0])

    def predict(self, values: Array) -> Array:
        matrix = self.columns(np.asarray(np.cumprod(values)))
        return np.asarray(matrix @ np.linalg.lstsq(matrix, self.target, rcond=None)[0])

    def solve(self) -> SolvedProblem:
        """The problem with the parameters of least squares."""
        solution = solve_iteratively(self, LeastSquares(), self.initial_values)
        return SolvedProblem(self, solution.values)


@dataclasses.dataclass(frozen=True, eq=False)
class HoldProblem(TimeConstantProblem):
    """The values of one hold at times [s] from its start."""

    time: Array
    quantity = "value"

    def columns(self, times: Array) -> Array:
        return np.column_stack(
            [np.ones_like(self.time), *(1.0 - np.exp(-self.time / tau) for tau in times)]
        )


def creep_elements(
    fit: CreepFit,
    *,
    step: float,
    stiffness: float | None = None,
    resting_length: float | None = None,
) -> CreepElements:
    """The creep elements of a muscle that creeps as the hold of `fit`; none if the data justify no
    creep.

    step            shortening of the muscle [m] by the fast change before the hold, negative for an
                    elongation
    stiffness       static stiffness K [N/m] of the relaxed muscle at constant pressure; needed for
                    a hold under a load
    resting_length  [m]; needed for a hold under a load, whose creep is a contraction

    The fast change must be quick compared with the time constants, and the muscle taut. Raises
    ParameterError for a missing or invalid value, IdentificationError for creep in the wrong
    direction, which passive elements do not have.
    """
    if not np.isfinite(step) or step == 0.0:
        raise ParameterError(
            f"creep_elements: the step is {step:g} m; it must be finite and not zero."
        )
    amplitudes = np.array(fit.creep.amplitudes)
    times = np.array(fit.creep.time_constants)
    if not amplitudes.size:
        return CreepElements()
    if not fit.unit:
        if stiffness is None or resting_length is None:
            raise ParameterError(
                "creep_elements: a hold under a load needs the static stiffness and the resting"
                " length of the muscle. Give stiffness=... [N/m], such as that of its law, and"
                " resting_length=... [m]."
            )
        if not stiffness > 0.0 or not resting_length > 0.0:
            raise ParameterError(
                f"creep_elements: the stiffness is {stiffness:g} N/m and the resting length"
                f" {resting_length:g} m; both must be greater than zero."
            )
        amplitudes = amplitudes * resting_length
    ratios = amplitudes / step
    if (ratios <= 0.0).any():
        raise IdentificationError(
            "the creep has the opposite direction of that of passive elements: after a shortening"
            " the force recovers at constant length, and the muscle shortens further under a"
            " constant load. Check the sign of the step and that the pressure was constant; creep"
            " of the pressure is no creep of the muscle."
        )
    if stiffness is None or fit.unit:  # a shortening by the step lowers the force at first
        return CreepElements(tuple(ratios.tolist()), tuple(times.tolist()))
    return _retardation(amplitudes, times, step, stiffness)


def _retardation(
    creep: np.ndarray, times: np.ndarray, step: float, stiffness: float
) -> CreepElements:
    """From the further shortening [m] under a constant load after a shortening by `step` [m]."""
    load = stiffness * (step + creep.sum())
    instantaneous = step / load
    compliances = creep / load
    # D(s) prod(1 + s lambda_i) as a polynomial in s; its zeros are -1/tau_i
    factors = [np.poly1d([constant, 1.0]) for constant in times]
    numerator = math.prod(factors) * instantaneous
    for i, compliance in enumerate(compliances):
        numerator = (
            numerator
            + math.prod(factors[:i] + factors[i + 1 :], start=np.poly1d([1.0])) * compliance
        )
    zeros = np.sort(np.real(numerator.roots))
    slopes = [-float(np.sum(compliances * times / (1.0 + zero * times) ** 2)) for zero in zeros]
    stiffnesses = [1.0 / (slope * zero) for slope, zero in zip(slopes, zeros, strict=True)]
    return CreepElements(
        tuple(map(float, stiffnesses)), tuple(float(-1.0 / zero) for zero in zeros)
    )

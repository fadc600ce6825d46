"""Creep: slow change of contraction or force at constant pressure, as a sum of exponential functions."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ....core.annotation import one_line
from ....core.arrays import Array
from ....core.declaration import model, parameter
from ....core.errors import IdentificationError, ParameterError
from ....recording import Recording
from ..model_evidence import effective_sample_size, f_test_p_value
from .result import SIGNIFICANCE_LEVEL

GRID_SIZE = 40
"""Grid of initial time constants, evenly spaced in their logarithm over the observable range (chosen)."""
MIN_RATIO = 3.0
"""Minimum ratio of two time constants (chosen): closer ones cannot be separated, and their amplitudes diverge."""


@model
class Creep:
    """y(t) = y_0 + Sum a_i (1 - exp(-t/tau_i)): Kelvin-Voigt elements in series, t from the start of the hold.

    y contraction [1] or force [N], y_0 its initial value, a_i and tau_i amplitude and time constant of each element.
    """

    initial: float = parameter("1 or N", "y_0", "value at the start of the hold")
    amplitudes: tuple[float, ...] = parameter("1 or N", "a_i", "amplitude of each element", default=())
    time_constants: tuple[float, ...] = parameter(
        "s", "tau_i", "time constant of each element", bounds=(1e-6, 1e9), default=()
    )

    def check(self) -> None:
        if len(self.amplitudes) != len(self.time_constants):
            raise ParameterError(
                f"Creep: there are {len(self.amplitudes)} amplitudes and {len(self.time_constants)} time constants; "
                "give one of each for every element."
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

    @property
    def verdict(self) -> str:
        """The number of justified elements, as sentences with the numbers."""
        count, unit = len(self.creep.amplitudes), f" {self.unit}" if self.unit else ""
        elements = ", ".join(
            f"{a:.3g}{unit} with {tau:.3g} s"
            for a, tau in zip(self.creep.amplitudes, self.creep.time_constants, strict=True)
        )
        subject = ("no creep", "creep with one time constant", "creep with two time constants")[count]
        rms = ", ".join(f"{value:.3g}" for value in self.rmse_by_order)
        text = f"The data justify {subject}{f' ({elements})' if elements else ''}; "
        text += f"rms error with zero, one and two time constants: {rms}{unit}."
        if count and max(self.creep.time_constants) > self.duration / 2:
            text += (
                f" The record of {self.duration:.3g} s is too short for the longest time constant, so the final value "
                "is extrapolated."
            )
        return text


def fit_creep(recording: Recording, quantity: str) -> CreepFit:
    """Fit creep of a column, `contraction` or `force`, to the rows of a hold at constant pressure.

    Time counts from the first row. An element is added as long as the F test is significant. Raises IdentificationError
    for another column, fewer than 12 rows, or time that does not increase.
    """
    if quantity not in ("contraction", "force"):
        raise IdentificationError(
            f"{recording.origin}: creep of the column '{one_line(quantity)}' is not fitted; give 'contraction' or "
            "'force'. A length becomes a contraction where the recording states the resting length."
        )
    time, values = recording["time"], recording[quantity]
    if time.size < 12 or not (np.diff(time) > 0).all():
        raise IdentificationError(
            f"{recording.origin}: a fit of creep needs 12 or more rows of a hold in increasing time; there are "
            f"{time.size} rows."
        )
    time = time - time[0]
    fits = [_fit_constant(values), _fit_elements(time, values, 1), _fit_elements(time, values, 2)]
    squares = [float(np.mean((creep.value_at(time) - values) ** 2)) for creep in fits]
    sample_size = effective_sample_size(fits[-1].value_at(time) - values)
    p_values = tuple(f_test_p_value(squares[i], squares[i + 1], sample_size, 3 + 2 * i, 2) for i in (0, 1))
    count = 0
    while count < 2 and p_values[count] < SIGNIFICANCE_LEVEL:
        count += 1
    rmse_by_order = tuple(float(np.sqrt(square)) for square in squares)
    unit = "N" if quantity == "force" else ""
    return CreepFit(fits[count], rmse_by_order[count], rmse_by_order, p_values, float(time[-1]), unit)


def _fit_constant(values: Array) -> Creep:
    return Creep(float(np.mean(values)))


def _fit_elements(time: Array, values: Array, count: int) -> Creep:
    """Nonlinear least squares in the time constants from the best grid point; the other parameters are linear."""
    from scipy.optimize import least_squares

    low, high, min_step = np.log(np.median(np.diff(time))), np.log(2.0 * time[-1]), np.log(MIN_RATIO)
    grid = np.linspace(low, high, GRID_SIZE)[1:-1]
    steps = grid - low + 1.01 * min_step
    starts = [(g,) for g in grid] if count == 1 else [(a, b) for a in grid for b in steps[::3] if a + b < high]
    best = min(starts, key=lambda x: float(np.sum(_residuals(np.array(x), time, values) ** 2)))
    bounds = ([low, min_step][:count], [high, max(high - low, 2.0 * min_step)][:count])
    logarithms = np.cumsum(least_squares(_residuals, best, bounds=bounds, args=(time, values)).x)
    coefficients = np.linalg.lstsq(_design_matrix(logarithms, time), values, rcond=None)[0]
    return Creep(float(coefficients[0]), tuple(coefficients[1:]), tuple(np.exp(logarithms)))


def _design_matrix(logarithms: Array, time: Array) -> Array:
    return np.column_stack([np.ones_like(time), *(1.0 - np.exp(-time / np.exp(log)) for log in logarithms)])


def _residuals(steps: Array, time: Array, values: Array) -> Array:
    """Residuals for the logarithm of the first time constant and its difference to that of the second."""
    matrix = _design_matrix(np.cumsum(steps), time)
    return np.asarray(matrix @ np.linalg.lstsq(matrix, values, rcond=None)[0] - values)

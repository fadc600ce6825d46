"""Creep: how a muscle goes on moving, or its force goes on changing, at constant pressure."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ...core.arrays import Array
from ...core.declaration import model, parameter
from ...core.errors import IdentificationError, ParameterError
from ...recording import Recording
from ..model_evidence import effective_sample_size, f_test_p_value
from .result import SIGNIFICANCE_LEVEL

GRID_SIZE = 40
"""Time constants tried, spread evenly in their logarithm over what the record can tell (chosen)."""
MIN_RATIO = 3.0
"""Least ratio of two time constants; closer ones cannot be told apart, and their amplitudes run away (chosen)."""


@model
class Creep:
    """y(t) = y_0 + Sum a_i (1 - exp(-t/tau_i)): Kelvin-Voigt elements in series, t from the start of the hold.

    y a contraction [1] or a force [N], y_0 its value at the start, a_i how far it creeps with the time constant tau_i.
    """

    initial: float = parameter("1 or N", "y_0", "value at the start of the hold")
    amplitudes: tuple[float, ...] = parameter("1 or N", "a_i", "how far each part creeps", default=())
    time_constants: tuple[float, ...] = parameter(
        "s", "tau_i", "time constant of each part", bounds=(1e-6, 1e9), default=()
    )

    def check(self) -> None:
        if len(self.amplitudes) != len(self.time_constants):
            raise ParameterError(
                f"Creep: {len(self.amplitudes)} amplitudes and {len(self.time_constants)} time constants; give one of "
                "each for every part."
            )

    def value_at(self, time: Any) -> Any:
        """The value at times [s] from the start of the hold."""
        elapsed = np.asarray(time, dtype=float)
        found = self.initial + 0.0 * elapsed
        for amplitude, constant in zip(self.amplitudes, self.time_constants, strict=True):
            found = found + amplitude * (1.0 - np.exp(-elapsed / constant))
        return found


@dataclasses.dataclass(frozen=True, eq=False)
class CreepFit:
    """Creep with as many parts as the data justify: none, one or two."""

    creep: Creep
    rmse: float
    rmse_by_order: tuple[float, ...]
    """With no part, one, two."""
    p_values: tuple[float, ...]
    """Probability that the first, the second part would do as well by chance (F test)."""
    duration: float
    unit: str = ""
    """Of what creeps; empty for a contraction, which is a ratio."""

    @property
    def verdict(self) -> str:
        """How many parts the data justify, in words with the numbers."""
        count, unit = len(self.creep.amplitudes), f" {self.unit}" if self.unit else ""
        parts = ", ".join(
            f"{a:.3g}{unit} with {tau:.3g} s"
            for a, tau in zip(self.creep.amplitudes, self.creep.time_constants, strict=True)
        )
        found = ("no creep", "one time constant", "two time constants")[count]
        rms = ", ".join(f"{value:.3g}" for value in self.rmse_by_order)
        text = f"The data justify {found}{f' ({parts})' if parts else ''}; rms error with none, one, two: {rms}{unit}."
        if count and max(self.creep.time_constants) > self.duration / 2:
            text += f" The record of {self.duration:.3g} s is too short for the longest: its end is extrapolated."
        return text


def fit_creep(recording: Recording, quantity: str) -> CreepFit:
    """Creep of a column, `contraction` or `force`, over the rows of a hold: pressure constant, time from its start.

    A part is added as long as the F test says that chance would not do as well. Raises IdentificationError for a
    record too short.
    """
    time, values = recording["time"] - recording["time"][0], recording[quantity]
    if time.size < 12 or not (np.diff(time) > 0).all():
        raise IdentificationError(
            f"{recording.origin}: creep needs 12 rows of a hold at least, in rising time; there are {time.size}."
        )
    found = [_fit_constant(values), _fit_elements(time, values, 1), _fit_elements(time, values, 2)]
    squares = [float(np.mean((creep.value_at(time) - values) ** 2)) for creep in found]
    rows = effective_sample_size(found[-1].value_at(time) - values)
    chances = tuple(f_test_p_value(squares[i], squares[i + 1], rows, 3 + 2 * i, 2) for i in (0, 1))
    count = 0
    while count < 2 and chances[count] < SIGNIFICANCE_LEVEL:
        count += 1
    rmses = tuple(float(np.sqrt(square)) for square in squares)
    unit = "N" if quantity == "force" else ""
    return CreepFit(found[count], rmses[count], rmses, chances, float(time[-1]), unit)


def _fit_constant(values: Array) -> Creep:
    return Creep(float(np.mean(values)))


def _fit_elements(time: Array, values: Array, count: int) -> Creep:
    """The time constants by search from the best of a grid; initial value and amplitudes by linear least squares."""
    from scipy.optimize import least_squares

    low, high, apart = np.log(np.median(np.diff(time))), np.log(2.0 * time[-1]), np.log(MIN_RATIO)
    grid = np.linspace(low, high, GRID_SIZE)[1:-1]
    steps = grid - low + 1.01 * apart
    starts = [(g,) for g in grid] if count == 1 else [(a, b) for a in grid for b in steps[::3] if a + b < high]
    first = min(starts, key=lambda x: float(np.sum(_residuals(np.array(x), time, values) ** 2)))
    bounds = ([low, apart][:count], [high, max(high - low, 2.0 * apart)][:count])
    logs = np.cumsum(least_squares(_residuals, first, bounds=bounds, args=(time, values)).x)
    coefficients = np.linalg.lstsq(_design_matrix(logs, time), values, rcond=None)[0]
    return Creep(float(coefficients[0]), tuple(coefficients[1:]), tuple(np.exp(logs)))


def _design_matrix(logs: Array, time: Array) -> Array:
    return np.column_stack([np.ones_like(time), *(1.0 - np.exp(-time / np.exp(log)) for log in logs)])


def _residuals(steps: Array, time: Array, values: Array) -> Array:
    """Errors for the logarithm of the first time constant, and how far that of the second lies above it."""
    columns = _design_matrix(np.cumsum(steps), time)
    return np.asarray(columns @ np.linalg.lstsq(columns, values, rcond=None)[0] - values)

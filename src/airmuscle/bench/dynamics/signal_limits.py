"""Limits of a test rig for the signals that are played on it: pressures, their rates, travel."""

import dataclasses
import math
from collections.abc import Mapping

import numpy as np

from ...core import Array, ParameterError, check_field_types

TRAVEL_MARGIN = 0.05
"""Part of the travel at either end that a planned motion leaves free (chosen)."""


@dataclasses.dataclass(frozen=True)
class SignalLimits:
    """What commands and motions must not exceed.

    max_pressure, min_pressure  range of the commands, gauge [Pa]
    max_rate                    greatest rate of a command [Pa/s]
    travel                      range of coordinates of the mechanism by name [SI]
    """

    max_pressure: float
    min_pressure: float = 0.0
    max_rate: float = math.inf
    travel: Mapping[str, tuple[float, float]] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        check_field_types(self)
        if not 0.0 <= self.min_pressure < self.max_pressure < math.inf:
            raise ParameterError(
                f"SignalLimits: the pressures are {self.min_pressure:g} Pa to"
                f" {self.max_pressure:g} Pa; give a minimum of at least 0 below the maximum."
            )
        if not self.max_rate > 0.0:
            raise ParameterError(
                f"SignalLimits: max_rate is {self.max_rate:g} Pa/s; it must be positive."
            )
        for name, (low, high) in self.travel.items():
            if not -math.inf < low < high < math.inf:
                raise ParameterError(
                    f"SignalLimits: the travel of {name} is {low:g} to {high:g}; give the lower"
                    " end first."
                )

    @property
    def span(self) -> float:
        """Range of the pressure [Pa]."""
        return self.max_pressure - self.min_pressure

    def limited(self, commands: Array, start: Array, sample_time: float) -> Array:
        """Commands (N, m) [Pa] within the range and the rate, after those of `start` (m,)."""
        wanted = np.clip(commands, self.min_pressure, self.max_pressure)
        if math.isinf(self.max_rate):
            return wanted
        most = self.max_rate * sample_time
        limited = np.empty_like(wanted)
        level = start
        for row, values in enumerate(wanted):
            level = level + np.clip(values - level, -most, most)
            limited[row] = level
        return limited

    def ramp(self, start: Array, end: Array, least: float, sample_time: float) -> Array:
        """Commands (N, m) [Pa] from one level to another within `least` [s], or as slowly as the
        rate demands; the last row is the end.
        """
        distance = float(np.max(np.abs(end - start)))
        duration = max(least, distance / self.max_rate)
        # A little more, so that rounding does not exceed the rate.
        rows = max(1, math.ceil(duration / sample_time * (1.0 + 1e-9)))
        share = np.arange(1, rows + 1)[:, None] / rows
        return np.asarray(start + (end - start) * share)

    def allows(self, motions: Mapping[str, Array], margin: float = TRAVEL_MARGIN) -> Array:
        """Whether motions (K, N) by the name of the coordinate stay within the travel without the
        margin, (K,).
        """
        count = max(map(len, motions.values()), default=0)
        allowed = np.ones(count, dtype=bool)
        for name, motion in motions.items():
            if name not in self.travel:
                continue
            low, high = self.travel[name]
            free = margin * (high - low)
            inside = (motion >= low + free) & (motion <= high - free)
            allowed &= inside.all(axis=1)
        return allowed

"""Limits of friction parameters that follow from the data: maximum force, and lowest and highest speed."""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ....core import Array, Leaf, leaves
from ....physics.muscle.friction import Friction
from ...segment.sensor import estimate_noise
from ..identifiability import UndeterminedCombination

SPEED_INTERVALS = 40
"""Intervals of the path over each of which a speed is measured, so that noise of the path has no effect (chosen)."""
SPEED_QUANTILES = (0.05, 0.95)
"""Quantiles of the speeds of the intervals that count as the lowest and the highest speed of the data (chosen)."""
MIN_SPEED_RATIO = 3.0
"""Minimum ratio of the highest to the lowest speed for the terms of speed to be determined (chosen)."""

STEP_SHARE = 0.1
"""Resolution of a path without noise, as a fraction of its median step between two rows (chosen): a transition within
this part of a step is complete at the next row."""
MAX_REPEATED = 0.1
"""Share of the rows that repeat a reading during the motion, above which a step is that of a reading (chosen)."""
AMPLITUDE_QUANTILE = 0.95
"""Quantile of the forces without the static curve that counts as the amplitude of the hysteresis (chosen)."""


@dataclasses.dataclass(frozen=True)
class Axis:
    """The axis on which a path [m] is plotted: its label, and the factor from metres to its unit.

    `si_unit` is the SI unit of the driving quantity, of which `si_factor` correspond to a metre.
    """

    label: str
    factor: float
    si_unit: str = "m"
    si_factor: float = 1.0

    def display(self, value: float, unit: str) -> tuple[float, str]:
        """The value and unit of a parameter of the friction with the driving quantity in place of the displacement."""
        if self.si_unit == "m":
            return value, "" if unit == "1" else unit
        conversions = {
            "m": (value * self.si_factor, self.si_unit),
            "m/s": (value * self.si_factor, f"{self.si_unit}/s"),
            "N/m": (value / self.si_factor, f"N/{self.si_unit}"),
            "N s/m": (value / self.si_factor, f"N s/{self.si_unit}"),
            "1": (value, ""),
        }
        return conversions.get(unit, (value, unit))


MILLIMETRES = Axis("displacement [mm]", 1e3)


@dataclasses.dataclass(frozen=True)
class DataLimits:
    """Maximum force [N], lowest and highest speed [m/s], and maximum stiffness [N/m] that the data show.

    The speeds are NaN without a time. A stiffer transition of the friction lies between two readings of the path.
    """

    force: float
    low_speed: float
    high_speed: float
    stiffness: float = math.inf

    @property
    def has_speed_variation(self) -> bool:
        """Whether the speeds differ enough to determine terms of speed."""
        return self.high_speed >= MIN_SPEED_RATIO * self.low_speed

    def bounds(self, leaf: Leaf) -> tuple[float, float]:
        """Bounds of a parameter: the declared ones, narrowed by what a muscle of this force and speed can show.

        A force is at most the maximum force, a viscous force at the highest speed likewise, a characteristic speed is
        between the lowest and the highest speed, and a stiffness is at most what the readings show.
        """
        low, high = leaf.declared.bounds
        narrow_low, narrow_high = -math.inf, math.inf
        if leaf.declared.unit == "N":
            narrow_high = self.force
        elif leaf.declared.unit == "N/m":
            narrow_high = self.stiffness
        elif leaf.declared.unit == "N s/m" and self.high_speed > 0:
            narrow_high = self.force / self.high_speed
        elif leaf.declared.unit == "m/s" and 0 < self.low_speed < self.high_speed:
            narrow_low, narrow_high = self.low_speed, self.high_speed
        narrow_low, narrow_high = max(low, narrow_low), min(high, narrow_high)
        return (narrow_low, narrow_high) if narrow_low < narrow_high else (low, high)


def interval_speeds(path: Array, time: Array, rows: npt.NDArray[np.bool_]) -> Array:
    """Speeds [m/s] at which a path [m] passed intervals of equal length in one direction and ended in a fitted row."""
    width = float(np.ptp(path)) / SPEED_INTERVALS
    if not width > 0:
        return np.empty(0)
    interval = np.floor((path - path.min()) / width)
    steps = np.sign(np.diff(interval))
    crossings = np.flatnonzero(steps) + 1
    one_way = np.flatnonzero(steps[crossings[1:] - 1] == steps[crossings[:-1] - 1])
    first, last = crossings[one_way], crossings[one_way + 1]
    kept = rows[last] & (time[last] > time[first])
    first, last = first[kept], last[kept]
    return np.asarray(np.abs(path[last] - path[first]) / (time[last] - time[first]))


def data_limits(force: Array, path: Array, time: Array | None, rows: npt.NDArray[np.bool_]) -> DataLimits:
    """The limits of a run: forces [N] and the path [m] over the time [s], at the fitted rows; arrays (N,)."""
    greatest = float(np.max(np.abs(force[rows]), initial=0.0))
    if time is None or len(path) < 2:
        return DataLimits(greatest, float("nan"), float("nan"))
    moving = interval_speeds(path, time, rows)
    low, high = np.quantile(moving, SPEED_QUANTILES) if moving.size else (np.nan, np.nan)
    return DataLimits(greatest, float(low), float(high))


def resolved_stiffness(path: Array, hysteresis: Array) -> float:
    """The maximum stiffness that readings show [N/m]: the amplitude of the hysteresis by the resolution of the path.

    path        displacement at the fitted rows [m], shape (N,)
    hysteresis  force without its static curve at these rows [N], shape (N,)
    """
    resolution = _path_resolution(path)
    amplitude = float(np.quantile(np.abs(hysteresis), AMPLITUDE_QUANTILE)) if resolution else 0.0
    return amplitude / resolution if amplitude > 0 else math.inf


def _path_resolution(path: Array) -> float:
    """The displacement below which nothing is seen [m]: the noise, a tenth of the median step, or the step of a reading
    that is repeated during the motion; 0 without a motion."""
    steps = np.abs(np.diff(path))
    moving = steps > 0
    if not moving.any():
        return 0.0
    repeated = np.count_nonzero(~moving[1:-1] & (moving[:-2] | moving[2:]))
    share = 1.0 if repeated > MAX_REPEATED * steps.size else STEP_SHARE
    return max(estimate_noise(path), share * float(np.median(steps[moving])))


def combine_limits(limits: tuple[DataLimits, ...]) -> DataLimits:
    """The limits of several runs together."""
    return DataLimits(
        max(each.force for each in limits),
        float(np.min([each.low_speed for each in limits])),
        float(np.max([each.high_speed for each in limits])),
        max(each.stiffness for each in limits),
    )


def parameters_on_bounds(friction: Friction, limits: DataLimits) -> tuple[str, ...]:
    """Paths of the fitted parameters that are on a bound, declared or set by the data; 0 is no such bound."""
    on_bounds = []
    for leaf in leaves(friction):
        low, high = limits.bounds(leaf)
        if leaf.declared.fitted and ((low > 0 and leaf.value <= 1.01 * low) or leaf.value >= 0.99 * high):
            on_bounds.append(leaf.path)
    return tuple(on_bounds)


def undetermined_parameters(
    friction: Friction, limits: DataLimits, weak: Sequence[UndeterminedCombination]
) -> tuple[str, ...]:
    """Paths of the parameters that the data do not determine: on a bound, or in a poorly determined combination."""
    names = [name for each in weak for name, _ in each.shares]
    return tuple(dict.fromkeys([*parameters_on_bounds(friction, limits), *names]))


def limit_reservations(
    friction: Friction, limits: DataLimits, weak: Sequence[UndeterminedCombination], axis: Axis
) -> list[str]:
    """Reasons, as sentences, against a friction: a force on its limit, or terms of speed that are not determined."""
    declared = {leaf.path: leaf.declared for leaf in leaves(friction)}
    reasons = [
        f"{name} is on its limit, the maximum force in the data ({limits.force:.4g} N)."
        for name in parameters_on_bounds(friction, limits)
        if declared[name].unit == "N" and limits.force < declared[name].bounds[1]
    ]
    if friction.rate_independent:
        return reasons
    too_uniform = speed_reservation(limits, axis)
    if too_uniform:
        return [*reasons, too_uniform]
    if undetermined_parameters(friction, limits, weak):
        reasons.append("A law with terms of speed is justified only if all of its parameters are determined.")
    return reasons


def speed_reservation(limits: DataLimits, axis: Axis) -> str:
    """The reason, as a sentence, why the data cannot determine terms of speed; empty if they can."""
    if limits.has_speed_variation:
        return ""
    if math.isnan(limits.high_speed):
        return "The data have no time, so the terms of speed are not determined."
    (low, unit), (high, _) = (axis.display(speed, "m/s") for speed in (limits.low_speed, limits.high_speed))
    return (
        f"The speed in the data is {low:.3g} to {high:.3g} {unit}, so the terms of speed are not determined; measure "
        "loops at clearly different speeds."
    )

"""Data of a loop: path of the friction and static curve, and limits of friction parameters that
follow from the data, the maximum force, the lowest and the highest speed, and the stiffness."""

import abc
import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from ...core import Array, Hint, IdentificationError, Leaf, leaves, model, parameter
from ...physics import Characteristic
from ...physics.muscle.friction import Friction
from ...recording import Recording
from ..estimation import UndeterminedCombination
from ..inspection import EDGE, Mask, estimate_noise, rounding


@dataclasses.dataclass(frozen=True)
class Axis:
    """The axis on which a path [m] is plotted: its label, and the factor from metres to its unit.
    `si_unit` is the SI unit of the driving quantity, of which `si_factor` correspond to a metre."""

    label: str
    factor: float
    si_unit: str = "m"
    si_factor: float = 1.0

    def display(self, value: float, unit: str) -> tuple[float, str]:
        """The value and unit of a parameter of the friction with the driving quantity in place of
        the displacement.
        """
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


class FrictionPath(abc.ABC):
    """The displacement along which the friction slides, as a function of the recorded columns."""

    @abc.abstractmethod
    def displacement(self, recording: Recording) -> Array:
        """Displacement [m] at every row, shape (N,)."""

    @property
    def axis(self) -> Axis:
        """The axis of figures."""
        return MILLIMETRES


@model
class ContractionPath(FrictionPath):
    """x = eps L0: friction against shortening, visible in loops at constant pressure or load."""

    def displacement(self, recording: Recording) -> Array:
        length = recording.constants.get("resting_length")
        if not isinstance(length, float | int):
            raise IdentificationError(
                f"{recording.origin}: friction against shortening needs the resting length.",
                hint=Hint("To state it", "resting_length", function="ColumnMapping"),
            )
        return np.asarray(recording["contraction"] * float(length))


@model
class PressurePath(FrictionPath):
    """x = c p: friction of braid threads that shift with pressure, visible in a muscle at constant
    length.

    Only k_i c, a force by pressure, is determined; c is chosen as 1 mm for each 100 kPa, so that
    the friction laws keep their units. Such a friction describes isometric loops only and cannot be
    part of a plant.
    """

    displacement_per_pressure: float = parameter(
        "m/Pa",
        "c",
        "displacement of the threads by pressure",
        bounds=(1e-12, 1e-3),
        fitted=False,
        default=1e-8,
    )

    def displacement(self, recording: Recording) -> Array:
        return self.displacement_per_pressure * recording["pressure"]

    @property
    def axis(self) -> Axis:
        by_displacement = 1.0 / self.displacement_per_pressure
        return Axis(
            "gauge pressure [kPa]", 1e-3 / self.displacement_per_pressure, "Pa", by_displacement
        )


class StaticCurve(abc.ABC):
    """The force without friction: a known part, and columns whose coefficients are fitted with the
    friction.
    """

    def known_force(self, recording: Recording) -> Array:
        """The known part of the force [N] at every row, shape (N,); 0 unless overridden."""
        return np.zeros(len(recording))

    @abc.abstractmethod
    def design_matrix(self, recording: Recording) -> Array:
        """The columns whose coefficients are fitted, shape (N, coefficients)."""


@dataclasses.dataclass(frozen=True)
class FixedCharacteristic(StaticCurve):
    """A known characteristic with a fitted constant offset of the force."""

    characteristic: Characteristic

    def known_force(self, recording: Recording) -> Array:
        return np.asarray(
            self.characteristic.force(recording["pressure"], recording["contraction"]), dtype=float
        )

    def design_matrix(self, recording: Recording) -> Array:
        return np.ones((len(recording), 1))


@dataclasses.dataclass(frozen=True)
class PolynomialCurve(StaticCurve):
    """A fitted polynomial in one column: `pressure` in isometric runs, `contraction` in isobaric
    runs.
    """

    column: str
    degree: int

    def design_matrix(self, recording: Recording) -> Array:
        scale = (
            1e5 if self.column == "pressure" else 0.1
        )  # so that the coefficients have similar magnitudes
        return np.vander(recording[self.column] / scale, self.degree + 1)


SPEED_INTERVALS = 40
SPEED_QUANTILES = (0.05, 0.95)
"""Intervals of the path over each of which a speed is measured, so that noise of the path has no
effect, and quantiles of their speeds that count as the lowest and the highest speed of the data
(chosen)."""
MIN_SPEED_RATIO = 3.0
"""Minimum ratio of the highest to the lowest speed for the terms of speed to be determined
(chosen).
"""
STEP_SHARE = 0.1
"""Resolution of a path without noise, as a fraction of its median step between two rows (chosen): a
transition within this part of a step is complete at the next row."""
MAX_REPEATED = 0.1
"""Share of the rows that repeat a reading during the motion, above which a step is that of a
reading (chosen).
"""
AMPLITUDE_QUANTILE = 0.95
"""Quantile of the forces without the static curve that counts as the amplitude of the hysteresis
(chosen).
"""


@dataclasses.dataclass(frozen=True)
class DataLimits:
    """Maximum force [N], lowest and highest speed [m/s], and maximum stiffness [N/m] that the data
    show. The speeds are NaN without a time. A stiffer transition of the friction lies between two
    readings of the path.
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
        """Bounds of a parameter: the declared ones, narrowed to the force, also a viscous one at
        the highest speed, the range of speed and the stiffness that the data show."""
        narrowed = {"N": (-math.inf, self.force), "N/m": (-math.inf, self.stiffness)}
        if self.high_speed > 0:
            narrowed["N s/m"] = (-math.inf, self.force / self.high_speed)
        if 0 < self.low_speed < self.high_speed:
            narrowed["m/s"] = (self.low_speed, self.high_speed)
        low, high = leaf.declared.bounds
        ends = narrowed.get(leaf.declared.unit, (-math.inf, math.inf))
        within = max(low, ends[0]), min(high, ends[1])
        return within if within[0] < within[1] else (low, high)


def data_limits(force: Array, path: Array, time: Array | None, rows: Mask) -> DataLimits:
    """The limits of a run: forces [N] and the path [m] over the time [s], at the fitted rows;
    arrays (N,). The speeds are those at which the path passed intervals of equal length in one
    direction and ended in a fitted row.
    """
    greatest = float(np.max(np.abs(force[rows]), initial=0.0))
    low = math.nan
    high = math.nan
    width = float(np.ptp(path)) / SPEED_INTERVALS if len(path) else 0.0
    if time is not None and width > 0:
        steps = np.sign(np.diff(np.floor((path - path.min()) / width + EDGE)))
        crossings = np.flatnonzero(steps) + 1
        one_way = np.flatnonzero(steps[crossings[1:] - 1] == steps[crossings[:-1] - 1])
        first = crossings[one_way]
        last = crossings[one_way + 1]
        usable = rows[last] & (time[last] > time[first])
        first = first[usable]
        last = last[usable]
        if first.size:
            low, high = np.quantile(
                np.abs(path[last] - path[first]) / (time[last] - time[first]), SPEED_QUANTILES
            )
    return DataLimits(greatest, float(low), float(high))


def resolved_stiffness(path: Array, hysteresis: Array) -> float:
    """The maximum stiffness that readings show [N/m]: the amplitude of the hysteresis (N,) [N], the
    force without its static curve, by the resolution of the path (N,) [m], both at the fitted rows.
    The resolution is the noise, a tenth of the median step, or the step of a reading that is
    repeated in motion."""
    steps = np.abs(np.diff(path))
    moving = steps > rounding("", path)
    if not moving.any():
        return math.inf
    repeated = np.count_nonzero(~moving[1:-1] & (moving[:-2] | moving[2:]))
    share = 1.0 if repeated > MAX_REPEATED * steps.size else STEP_SHARE
    resolution = max(estimate_noise(path), share * float(np.median(steps[moving])))
    amplitude = float(np.quantile(np.abs(hysteresis), AMPLITUDE_QUANTILE))
    return amplitude / resolution if amplitude > 0 else math.inf


def combine_limits(limits: tuple[DataLimits, ...]) -> DataLimits:
    """The limits of several runs together."""
    low = np.min([run_limits.low_speed for run_limits in limits])
    high = np.max([run_limits.high_speed for run_limits in limits])
    force = max(run_limits.force for run_limits in limits)
    stiffness = max(run_limits.stiffness for run_limits in limits)
    return DataLimits(force, float(low), float(high), stiffness)


def parameters_on_bounds(friction: Friction, limits: DataLimits) -> tuple[str, ...]:
    """Paths of the fitted parameters that are on a bound, declared or set by the data; 0 is no such
    bound.
    """
    bounds = [(leaf, *limits.bounds(leaf)) for leaf in leaves(friction) if leaf.declared.fitted]
    return tuple(
        leaf.path
        for leaf, low, high in bounds
        if (low > 0 and leaf.value <= 1.01 * low) or leaf.value >= 0.99 * high
    )


def undetermined_parameters(
    friction: Friction, limits: DataLimits, weak: Sequence[UndeterminedCombination]
) -> tuple[str, ...]:
    """Paths of the parameters that the data do not determine: on a bound, or in a poorly determined
    combination.
    """
    names = [name for combination in weak for name, _ in combination.shares]
    return tuple(dict.fromkeys([*parameters_on_bounds(friction, limits), *names]))


def limit_reservations(
    friction: Friction, limits: DataLimits, weak: Sequence[UndeterminedCombination], axis: Axis
) -> list[str]:
    """Reasons, as sentences, against a friction: a force on its limit, or terms of speed that are
    not determined.
    """
    declared = {leaf.path: leaf.declared for leaf in leaves(friction)}
    reasons = [
        f"{name} is on its limit, the maximum force in the data ({limits.force:.4g} N)."
        for name in parameters_on_bounds(friction, limits)
        if declared[name].unit == "N" and limits.force < declared[name].bounds[1]
    ]
    of_speed = "" if friction.rate_independent else speed_reservation(limits, axis)
    if (
        not friction.rate_independent
        and not of_speed
        and undetermined_parameters(friction, limits, weak)
    ):
        of_speed = (
            "A law with terms of speed is justified only if all of its parameters are determined."
        )
    return [*reasons, of_speed] if of_speed else reasons


def speed_reservation(limits: DataLimits, axis: Axis) -> str:
    """The reason, as a sentence, why the data cannot determine terms of speed; empty if they
    can.
    """
    if limits.has_speed_variation:
        return ""
    if math.isnan(limits.high_speed):
        return "The data have no time, so the terms of speed cannot be identified."
    (low, unit), (high, _) = (
        axis.display(speed, "m/s") for speed in (limits.low_speed, limits.high_speed)
    )
    return (
        f"The speed in the data is {low:.3g} to {high:.3g} {unit}, so the terms of speed"
        " cannot be identified; measure loops at clearly different speeds."
    )

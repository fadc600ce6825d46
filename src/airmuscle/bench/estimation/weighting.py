"""Rules by which rows count in a fit: losses, censored observations (slack muscle, limits of the
sensor), weights of different test rigs."""

import abc
import dataclasses
import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ...core import Array, ColumnError, ParameterError, check_field_types
from ...recording import Recording
from ..inspection import estimate_sensors, remembered

ROBUST_LIMIT = 6.0
"""Limit of the residuals in the errors of a robust fit, in robust standard deviations (chosen)."""


class Loss(abc.ABC):
    """A function rho of the squared scaled residuals; a fit minimises the sum of scale^2
    rho((residual/scale)^2).
    """

    scale: float

    def __post_init__(self) -> None:
        check_field_types(self)
        if not 0 < self.scale < np.inf:
            raise ParameterError(
                f"{type(self).__name__}.scale is {self.scale!r}; it must be positive and finite, in"
                " the unit of the fitted quantity. Use about three times the standard deviation of"
                " the noise."
            )

    def limit(self, residuals: Array) -> float:
        """The magnitude to which residuals (N,) are limited in errors of a robust fit; infinite for
        least squares. It is six robust standard deviations, 1.4826 times the median magnitude, and
        at least `scale` (chosen).
        """
        return max(self.scale, ROBUST_LIMIT * 1.4826 * float(np.median(np.abs(residuals))))

    @abc.abstractmethod
    def rho(self, z: Array) -> Array:
        """rho(z) and its first and second derivative, shape (3, N), for z = (residual/scale)^2 >=
        0, shape (N,).
        """


@dataclasses.dataclass(frozen=True)
class LeastSquares(Loss):
    """rho = z: ordinary least squares."""

    scale: float = 1.0

    def limit(self, residuals: Array) -> float:
        return np.inf

    def rho(self, z: Array) -> Array:
        return np.stack([z, np.ones_like(z), np.zeros_like(z)])


@dataclasses.dataclass(frozen=True)
class Huber(Loss):
    """rho = z for z <= 1, 2 sqrt(z) - 1 beyond: residuals above `scale` contribute linearly.

    `scale` has the unit of the fitted quantity [SI].
    Reference: Huber, P. J. (1964), "Robust estimation of a location parameter", Annals of
    Mathematical Statistics.
    """

    scale: float

    def rho(self, z: Array) -> Array:
        root = np.sqrt(np.maximum(z, 1.0))
        inside = z <= 1.0
        return np.stack(
            [np.where(inside, z, 2 * root - 1), 1 / root, np.where(inside, 0.0, -0.5 / root**3)]
        )


@dataclasses.dataclass(frozen=True)
class SoftL1(Loss):
    """rho = 2 (sqrt(1 + z) - 1): squares of small residuals, magnitudes of those beyond `scale`
    [SI].
    """

    scale: float

    def rho(self, z: Array) -> Array:
        root = np.sqrt(1.0 + z)
        return np.stack([2.0 * (root - 1.0), 1.0 / root, -0.5 / root**3])


@dataclasses.dataclass(frozen=True)
class Censoring:
    """The range of force [N] within which a row is a measured value; at its limits and beyond it is
    a bound.

    A row at or below `min_force` states that the force of the law is at most `min_force` there,
    since a slack muscle cannot push; a row at or above `max_force`, that it is at least
    `max_force`. Such a censored row contributes to the fit only where the law violates this bound.
    Set `min_force` to the resolution of the sensor where slack rows read slightly more than 0.
    """

    min_force: float = 0.0
    max_force: float = math.inf

    def __post_init__(self) -> None:
        check_field_types(self)

    def signs(self, force: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """By row: 0 uncensored, 1 censored below (the true force is at most the limit), -1 censored
        above.
        """
        return (force <= self.min_force) * 1.0 - (force >= self.max_force) * 1.0


UNCENSORED = Censoring(-math.inf, math.inf)
"""No censoring: every row is a measured value."""


@remembered
def force_limits(runs: Sequence[Recording]) -> Censoring:
    """The range of the force sensor, where the recordings show a limit at which it saturates. The
    limits are estimated only if every recording has a time column and all come from one test rig;
    otherwise the range is unlimited.
    """
    timed = bool(runs) and all(
        "time" in run.columns and "force" in run.columns and len(run) for run in runs
    )
    if not timed or sensor_deviations(runs, "force") is not None:
        return UNCENSORED
    sensor = estimate_sensors(
        [Recording({"force": run.columns["force"]}, run.origin) for run in runs]
    )["force"]
    return Censoring(sensor.lower_limit + sensor.tolerance, sensor.upper_limit - sensor.tolerance)


MIN_SENSOR_RATIO = 2.0
"""Minimum ratio of neighbouring standard deviations of two different sensors (chosen: estimates of
the standard deviation of one sensor differ less)."""


@remembered
def sensor_deviations(runs: Sequence[Recording], quantity: str) -> Array | None:
    """The standard deviation of one observation in each recording [SI], shape (recordings,). It
    includes noise and quantisation where every recording has a time column, otherwise quantisation
    alone, because the rows are then in no known order. Recordings with similar standard deviations
    are attributed to one test rig and share their median. None where all recordings are of one rig,
    or a sensor shows neither noise nor resolution."""
    try:
        deviations, quantisation = (
            np.array([reading_deviations([run], quantity) for run in runs]).reshape(-1, 2).T
        )
    except ColumnError:
        return None
    timed = all("time" in run.columns for run in runs)
    single = deviations if timed else quantisation
    if not single.size or not (single > 0).all():
        return None
    # With the whole resolution, because the noise of readings that change by few steps of the
    # resolution is estimated as none or as a whole step.
    coarse = np.hypot(deviations, quantisation * np.sqrt(12.0)) if timed else quantisation
    order = np.argsort(coarse)
    rigs = np.split(
        order, np.flatnonzero(coarse[order][1:] > MIN_SENSOR_RATIO * coarse[order][:-1]) + 1
    )
    if len(rigs) < 2:
        return None
    result = np.empty(single.size)
    for rig in rigs:
        result[rig] = np.median(single[rig])
    return result


@remembered
def reading_deviations(runs: Sequence[Recording], quantity: str) -> tuple[float, float]:
    """Standard deviations of one reading of a quantity [SI]: of noise and quantisation, and of
    quantisation alone; 0 where they cannot be estimated."""
    columns = [run[quantity][np.isfinite(run[quantity])] for run in runs]
    sensors = estimate_sensors(
        [Recording({quantity: values}, "runs") for values in columns if values.size]
    )
    sensor = sensors.get(quantity)
    return (0.0, 0.0) if sensor is None else (sensor.std, float(sensor.resolution / np.sqrt(12.0)))

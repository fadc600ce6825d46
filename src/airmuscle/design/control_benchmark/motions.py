"""Motions of a joint as set points: step, ramp, sine with a smooth start, minimum jerk."""

from __future__ import annotations

import abc
import dataclasses
import math

import numpy as np

from ...core.annotation import check_field_types
from ...core.arrays import Array
from ...core.errors import ParameterError


@dataclasses.dataclass(frozen=True)
class JointMotion(abc.ABC):
    """A wanted motion of a joint angle (interface)."""

    def __post_init__(self) -> None:
        check_field_types(self)

    @abc.abstractmethod
    def at(self, time: Array) -> Array:
        """Angle [rad], angular speed [rad/s] and acceleration [rad/s2] as rows (3, N) at times (N,) [s]."""


@dataclasses.dataclass(frozen=True)
class StepMotion(JointMotion):
    """An angle of 0 until `begin` [s], then `amplitude` [rad]; speed and acceleration are stated as 0."""

    amplitude: float
    begin: float

    def at(self, time: Array) -> Array:
        # a sampling instant that is rounded below the time of the step belongs to the step
        angle = np.where(time > self.begin - 1e-9, self.amplitude, 0.0)
        return np.stack([angle, np.zeros_like(time), np.zeros_like(time)])


@dataclasses.dataclass(frozen=True)
class RampMotion(JointMotion):
    """A rise from 0 to `amplitude` [rad] with constant speed from `begin` [s] on within `rise_time` [s]."""

    amplitude: float
    begin: float
    rise_time: float

    def at(self, time: Array) -> Array:
        share = (time - self.begin) / self.rise_time
        moving = (share > 0.0) & (share < 1.0)
        speed = np.where(moving, self.amplitude / self.rise_time, 0.0)
        return np.stack([self.amplitude * np.clip(share, 0.0, 1.0), speed, np.zeros_like(time)])


@dataclasses.dataclass(frozen=True)
class SineMotion(JointMotion):
    """A sin(2 pi f t) r(t), where r rises from 0 to 1 within the first period as the fifth-degree polynomial of
    minimum jerk, so that the motion begins at rest."""

    amplitude: float
    frequency: float

    def at(self, time: Array) -> Array:
        w = 2.0 * math.pi * self.frequency
        r, r1, r2 = _fifth_degree(time * self.frequency) * self.frequency ** np.arange(3.0)[:, None]
        s, c = np.sin(w * time), np.cos(w * time)
        return self.amplitude * np.stack([r * s, r1 * s + w * r * c, r2 * s + 2.0 * w * r1 * c - w * w * r * s])


@dataclasses.dataclass(frozen=True)
class MinimumJerkMotion(JointMotion):
    """A rise from 0 to `amplitude` [rad] from `begin` [s] on within `rise_time` [s] with minimum jerk.

    theta = A (10 s^3 - 15 s^4 + 6 s^5), s = (t - t_0)/T. Reference: Flash and Hogan (1985).
    """

    amplitude: float
    begin: float
    rise_time: float

    def at(self, time: Array) -> Array:
        scale = self.amplitude / self.rise_time ** np.arange(3.0)
        return scale[:, None] * _fifth_degree((time - self.begin) / self.rise_time)


@dataclasses.dataclass(frozen=True)
class SumOfMotions(JointMotion):
    """The sum of several motions."""

    parts: tuple[JointMotion, ...]

    def at(self, time: Array) -> Array:
        return np.asarray(np.sum([part.at(time) for part in self.parts], axis=0))


def check_times(time: Array) -> None:
    """Raise ParameterError unless times (N,) are finite and rise."""
    if time.ndim != 1 or time.size < 2 or not np.isfinite(time).all() or not (np.diff(time) > 0).all():
        raise ParameterError("the times of a motion must be at least two, finite, and rise.")


def _fifth_degree(share: Array) -> Array:
    """The polynomial 10 s^3 - 15 s^4 + 6 s^5 and its derivatives by s (3, N), constant outside 0 to 1."""
    s = np.clip(share, 0.0, 1.0)
    value = s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
    return np.stack([value, 30.0 * s**2 * (1.0 - s) ** 2, 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)])

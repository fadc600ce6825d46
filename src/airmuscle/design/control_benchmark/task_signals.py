"""Set points of a task: motion, mean pressure, stiffness, and the feed-forward of the model by its static inverse."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...control.laws.antagonistic_inverse import AntagonisticInverse
from ...core.arrays import Array
from ...core.errors import ParameterError, suggestion
from ...engine.loop import SampledSignal
from ...physics.plant.plant import Plant
from .joints import BenchmarkJoint
from .motion_dynamics import inverse_dynamics
from .tasks import ControlTask

TORQUE_INPUT = "external_torque"


class TaskSignals(NamedTuple):
    """Signals of a task at the sampling instants (N,), all in SI units.

    feed_forward is half the pressure difference [Pa] by which the model would follow the motion without friction,
    feed_forward_rate its rate [Pa/s]; stiffness is that of the model at these pressures [N m/rad].
    """

    time: Array
    angle: Array
    angular_speed: Array
    angular_acceleration: Array
    mean_pressure: Array
    feed_forward: Array
    feed_forward_rate: Array
    stiffness: Array

    def setpoint(self, names: Sequence[str], further: Mapping[str, Array] | None = None) -> SampledSignal:
        """The named signals as set points. Raises ParameterError for a name that a task does not have."""
        known = {**self._asdict(), **(further or {})}
        known.pop("time")
        points = {}
        for name in names:
            if name not in known:
                raise ParameterError(
                    f"a task has no set point '{name}'; there are {', '.join(known)}.{suggestion(name, known)}"
                )
            points[name] = tuple(zip(self.time.tolist(), known[name].tolist(), strict=True))
        return SampledSignal(points)


def task_signals(joint: BenchmarkJoint, task: ControlTask) -> TaskSignals:
    """The signals of a task at the sampling instants of a joint."""
    h = joint.sample_time
    time: Array = h * np.arange(round(task.duration / h) + 2, dtype=float)
    angle, speed, acceleration = task.motion.at(time)
    mean = joint.mean_pressure + interpolated(task.stiffening, time)
    half = inverse_dynamics(joint, joint.model, task.motion, time, mean)
    ahead = inverse_dynamics(joint, joint.model, task.motion, time + 0.5 * h, mean)
    behind = inverse_dynamics(joint, joint.model, task.motion, time - 0.5 * h, mean)
    rate = np.where(np.isclose(speed, 0.0), 0.0, (ahead - behind) / h)
    stiffness = stiffness_of(joint.model, mean + half, mean - half, angle)
    return TaskSignals(time, angle, speed, acceleration, mean, half, rate, stiffness)


def interpolated(points: Sequence[tuple[float, float]], time: Array) -> Array:
    """Values at times (N,) of a function through points (time, value), 0 without points."""
    if not points:
        return np.zeros_like(time)
    times, values = np.array(points).T
    return np.asarray(np.interp(time, times, values))


def stiffness_of(plant: Plant, first: Array, second: Array, angle: Array) -> Array:
    """Stiffness of both muscles (N,) [N m/rad] at constant gauge pressures [Pa] and angles [rad] (N,)."""
    inverse = AntagonisticInverse(plant.muscles, plant.mechanism)
    return np.asarray(inverse.stiffness(first, second, angle), dtype=float)


def disturbance(task: ControlTask, inputs: Sequence[str]) -> SampledSignal:
    """The external torque of a task as an input signal of the plant; 0 without one."""
    if TORQUE_INPUT not in inputs:
        raise ParameterError(
            f"task '{task.name}': the plant has no input '{TORQUE_INPUT}'; wrap its mechanism in "
            "JointWithExternalTorque."
        )
    return SampledSignal({TORQUE_INPUT: task.torque or ((0.0, 0.0),)})

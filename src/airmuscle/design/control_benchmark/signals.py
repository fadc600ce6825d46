"""Control loop of a task: set points, disturbance, fault, and the feed-forward of the model by its inverse."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...control.laws.antagonistic_inverse import AntagonisticInverse
from ...control.laws.enclosing import WithStuckValve
from ...control.laws.static_inverse import static_force
from ...core.arrays import Array
from ...core.errors import ParameterError, suggestion
from ...engine.loop import ControlLaw, Controller, ControlLoop, Driver, SampledSignal
from ...physics.plant.plant import Plant
from .called_contender import SensedController
from .joints import BenchmarkJoint
from .motions import JointMotion
from .tasks import ControlTask

TORQUE_INPUT = "external_torque"
BISECTIONS = 40
ANGLE_STEP = 1e-4
"""Step of the angle [rad] for the speed of the muscles, by central differences (chosen)."""


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


def inverse_dynamics(joint: BenchmarkJoint, plant: Plant, motion: JointMotion, time: Array, mean: Array) -> Array:
    """Half the pressure difference (N,) [Pa] by which a plant without friction follows a motion at times (N,) [s].

    The torque of both muscles, with their dampers, gives the acceleration of the motion; it is solved for the pressure
    difference by bisection within the range of the joint. A motion beyond the range receives the limit.
    """
    angle, speed, acceleration = motion.at(time)
    mechanism, lengths = plant.mechanism, plant.resting_lengths
    name, rate = mechanism.coordinates[0].name, mechanism.coordinates[0].speed
    q, v = {name: angle}, {rate: speed}
    rest = dict.fromkeys((each.name for each in mechanism.inputs), 0.0)
    free, driven = (mechanism.acceleration(q, v, {name: torque}, rest)[name] for torque in (0.0, 1.0))
    wanted = (acceleration - free) / (driven - free)
    contractions = mechanism.contractions(q, lengths)
    beside = [mechanism.contractions({name: angle + side * ANGLE_STEP}, lengths) for side in (0.5, -0.5)]
    shortening = [length * (b - a) / ANGLE_STEP * speed for length, b, a in zip(lengths, *beside, strict=True)]
    low, high = np.full(time.shape, -joint.pressure_span), np.full(time.shape, joint.pressure_span)
    for _ in range(BISECTIONS):
        half = 0.5 * (low + high)
        tensions = [
            static_force(muscle, p, c) - muscle.damper.force(p, c, u)
            for muscle, p, c, u in zip(plant.muscles, (mean + half, mean - half), contractions, shortening, strict=True)
        ]
        below = mechanism.generalised_forces(q, tensions, lengths)[name] < wanted
        low, high = np.where(below, half, low), np.where(below, high, half)
    return np.asarray(0.5 * (low + high))


def angular_acceleration(joint: BenchmarkJoint, plant: Plant, angle: float, speed: float, half: float) -> float:
    """Acceleration [rad/s2] of a plant without friction at an angle [rad], a speed [rad/s] and half a pressure
    difference [Pa] about the mean pressure."""
    mechanism, lengths = plant.mechanism, plant.resting_lengths
    name, rate = mechanism.coordinates[0].name, mechanism.coordinates[0].speed
    q, rest = {name: angle}, dict.fromkeys((each.name for each in mechanism.inputs), 0.0)
    beside = [mechanism.contractions({name: angle + side * ANGLE_STEP}, lengths) for side in (0.5, -0.5)]
    tensions = [
        static_force(muscle, p, c) - muscle.damper.force(p, c, length * (b - a) / ANGLE_STEP * speed)
        for muscle, p, c, length, b, a in zip(
            plant.muscles, (joint.mean_pressure + half, joint.mean_pressure - half),
            mechanism.contractions(q, lengths), lengths, *beside, strict=True,
        )
    ]  # fmt: skip
    torque = mechanism.generalised_forces(q, tensions, lengths)[name]
    return float(mechanism.acceleration(q, {rate: speed}, {name: torque}, rest)[name])


def task_loop(
    joint: BenchmarkJoint, law: Controller, task: ControlTask, plant: Plant, drivers: Mapping[str, Driver]
) -> ControlLoop:
    """The control loop of a task at a plant with drivers of its valves."""
    if task.stuck is not None and isinstance(law, SensedController):
        law = dataclasses.replace(law, stuck=task.stuck)
    elif task.stuck is not None:
        assert isinstance(law, ControlLaw)
        law = WithStuckValve(law, task.stuck.input, task.stuck.time, task.stuck.opening)
    setpoint = task_signals(joint, task).setpoint(law.setpoints)
    return ControlLoop(law, joint.sample_time, setpoint, disturbance(task, plant.inputs), drivers)

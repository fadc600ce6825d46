"""Dynamics of a benchmark's joint without friction: acceleration by the pressures, and pressures along a motion."""

from __future__ import annotations

import numpy as np

from ...control.laws.static_inverse import static_force
from ...core.arrays import Array
from ...physics.plant.plant import Plant
from .joints import BenchmarkJoint
from .motions import JointMotion

BISECTIONS = 40
ANGLE_STEP = 1e-4
"""Step of the angle [rad] for the speed of the muscles, by central differences (chosen)."""


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

"""Standard environments: lift, joint and arm, with their default tasks."""

import dataclasses
import functools
import math
import warnings
from collections.abc import Mapping
from typing import Any, TypeVar

from ...core import AirmuscleWarning, ParameterError, Value, bar, model, ops, parameter
from ...files.library import Entry, PlantEntry, ValveEntry, load
from ...physics import Coordinate, FillDischarge, HangingMass, LinearDamper, Plant, Supply
from .randomisation import FactorRange, Randomisation, ValueRange
from .task import EnvironmentTask, Observation


@model
class LoadLifting(EnvironmentTask):
    """Lifting of a load to a height y_r that is constant in an episode; all numbers are chosen.

    The plant has one coordinate 'position' and one muscle. Observed are the height, its speed, the
    pressure, and the reference. The error y - y_r is scaled by `error_scale`. An episode ends where
    the height is beyond `lowest` or `highest`, or a number is not finite.
    """

    plant: Plant
    target_height: float = parameter(
        "m", "y_r", "reference height", bounds=(-1.0, 1.0), default=0.03
    )
    error_scale: float = parameter(
        "m", "e_0", "error at which the reward is 0.37", bounds=(1e-6, 1.0), default=0.005
    )
    lowest: float = parameter(
        "m", "y_min", "lower height that ends an episode", bounds=(-1.0, 1.0), default=-0.01
    )
    highest: float = parameter(
        "m", "y_max", "upper height that ends an episode", bounds=(-1.0, 1.0), default=0.075
    )
    effort_weight: float = parameter(
        "1", "w", "weight of the effort in the reward", bounds=(0.0, 1.0), default=0.01
    )
    period: float = parameter("s", "T", "period of the actions", bounds=(1e-6, 10.0), default=0.01)
    min_height: float = parameter(
        "m", "y_0min", "lowest initial height", bounds=(-1.0, 1.0), default=0.005
    )
    max_height: float = parameter(
        "m", "y_0max", "highest initial height", bounds=(-1.0, 1.0), default=0.02
    )
    min_pressure: float = parameter(
        "Pa", "p_min", "lowest initial pressure", bounds=(0.0, 1e6), default=1.0e5
    )
    max_pressure: float = parameter(
        "Pa", "p_max", "highest initial pressure", bounds=(0.0, 1e6), default=2.0e5
    )

    @property
    def observations(self) -> tuple[Observation, ...]:
        return (
            Observation("height", "cm", -50.0, 50.0, "height of the load"),
            Observation("speed", "m/s", -10.0, 10.0, "speed of the load"),
            Observation("pressure", "bar", -1.1, 20.0, "gauge pressure"),
            Observation("target", "cm", -50.0, 50.0, "reference height"),
        )

    @property
    def initial_ranges(self) -> Mapping[str, tuple[float, float]]:
        return {
            "pressure": (self.min_pressure, self.max_pressure),
            "position": (self.min_height, self.max_height),
        }

    def observe(
        self, state: Mapping[str, Value], outputs: Mapping[str, Value], time: Value
    ) -> tuple[Value, ...]:
        return (
            state["position"] / _CM,
            state["speed"],
            outputs["pressure"] / bar,
            self.target_height / _CM,
        )

    def errors(self, state: Mapping[str, Value], time: Value) -> tuple[Value, ...]:
        return ((state["position"] - self.target_height) / self.error_scale,)

    def ends(self, state: Mapping[str, Value]) -> Value:
        below = ops.where(state["position"] < self.lowest, 1.0, 0.0)
        above = ops.where(state["position"] > self.highest, 1.0, 0.0)
        return below + above > 0.5


@model
class JointTracking(EnvironmentTask):
    """Tracking of a sine by a joint: theta_r(t) = A sin(2 pi f t + phi); all numbers are chosen.

    The plant has one rotational coordinate and two muscles. Observed are the angle, its speed, the
    pressures of both muscles, and the reference now and one period later. The error theta - theta_r
    is scaled by `error_scale`. An episode ends where the angle exceeds `largest_angle`, or a number
    is not finite.
    """

    plant: Plant
    target_amplitude: float = parameter(
        "rad", "A", "amplitude of the reference", bounds=(0.0, 3.0), default=0.3
    )
    target_frequency: float = parameter(
        "Hz", "f", "frequency of the reference", bounds=(0.0, 100.0), default=0.5
    )
    target_phase: float = parameter(
        "rad", "phi", "phase of the reference", bounds=(-10.0, 10.0), default=0.0
    )
    error_scale: float = parameter(
        "rad", "e_0", "error at which the reward is 0.37", bounds=(1e-6, 10.0), default=0.1
    )
    largest_angle: float = parameter(
        "rad", "theta_max", "angle that ends an episode", bounds=(0.0, 3.2), default=0.785
    )
    effort_weight: float = parameter(
        "1", "w", "weight of the effort in the reward", bounds=(0.0, 1.0), default=0.01
    )
    period: float = parameter("s", "T", "period of the actions", bounds=(1e-6, 10.0), default=0.01)
    initial_angle: float = parameter(
        "rad", "theta_0", "largest initial angle", bounds=(0.0, 3.0), default=0.1
    )
    min_pressure: float = parameter(
        "Pa", "p_min", "lowest initial pressure", bounds=(0.0, 1e6), default=1.5e5
    )
    max_pressure: float = parameter(
        "Pa", "p_max", "highest initial pressure", bounds=(0.0, 1e6), default=2.5e5
    )

    def check(self) -> None:
        if len(self.plant.mechanism.coordinates) != 1:
            names = ", ".join(c.name for c in self.plant.mechanism.coordinates) or "none"
            raise ParameterError(
                f"JointTracking: the coordinates of the plant are {names}; one is needed. Give"
                " ArmReaching an arm."
            )

    @property
    def joint(self) -> Coordinate:
        """The coordinate of the joint."""
        return self.plant.mechanism.coordinates[0]

    @property
    def observations(self) -> tuple[Observation, ...]:
        return (
            Observation("angle", "rad", -3.2, 3.2, "joint angle"),
            Observation("angular_speed", "rad/s", -50.0, 50.0, "speed of the joint angle"),
            *(
                Observation(f"{p}pressure", "bar", -1.1, 20.0, "gauge pressure")
                for p in self.plant.prefixes
            ),
            Observation("target", "rad", -3.2, 3.2, "reference angle"),
            Observation("next_target", "rad", -3.2, 3.2, "reference angle one period later"),
        )

    @property
    def initial_ranges(self) -> Mapping[str, tuple[float, float]]:
        pressures = {
            f"{p}pressure": (self.min_pressure, self.max_pressure) for p in self.plant.prefixes
        }
        return {**pressures, self.joint.name: (-self.initial_angle, self.initial_angle)}

    def target(self, time: Value) -> Value:
        """The reference [rad] at a time [s]."""
        return self.target_amplitude * ops.sin(
            2.0 * ops.pi * self.target_frequency * time + self.target_phase
        )

    def observe(
        self, state: Mapping[str, Value], outputs: Mapping[str, Value], time: Value
    ) -> tuple[Value, ...]:
        pressures = (outputs[f"{p}pressure"] / bar for p in self.plant.prefixes)
        later = self.target(time + self.period)
        return (
            state[self.joint.name],
            state[self.joint.speed],
            *pressures,
            self.target(time),
            later,
        )

    def errors(self, state: Mapping[str, Value], time: Value) -> tuple[Value, ...]:
        return ((state[self.joint.name] - self.target(time)) / self.error_scale,)

    def ends(self, state: Mapping[str, Value]) -> Value:
        return ops.absolute_value(state[self.joint.name]) > self.largest_angle


@model
class ArmReaching(EnvironmentTask):
    """Reaching of angles that are constant in an episode by an arm with any number of joints; all
    numbers are chosen.

    The plant has rotational coordinates only. Observed are all angles, their speeds, the pressures
    of all muscles, and the references. The errors are scaled by `error_scale`. An episode ends
    where an angle exceeds `largest_angle`, or a number is not finite.
    """

    plant: Plant
    targets: tuple[float, ...] = parameter(
        "rad", "theta_r", "reference angles", bounds=(-3.2, 3.2), default=(0.0, 0.0)
    )
    error_scale: float = parameter(
        "rad", "e_0", "error at which the reward is 0.37", bounds=(1e-6, 10.0), default=0.05
    )
    largest_angle: float = parameter(
        "rad", "theta_max", "angle that ends an episode", bounds=(0.0, 3.2), default=0.5
    )
    effort_weight: float = parameter(
        "1", "w", "weight of the effort in the reward", bounds=(0.0, 1.0), default=0.01
    )
    period: float = parameter("s", "T", "period of the actions", bounds=(1e-6, 10.0), default=0.01)
    initial_angle: float = parameter(
        "rad", "theta_0", "largest initial angle", bounds=(0.0, 3.0), default=0.03
    )
    min_pressure: float = parameter(
        "Pa", "p_min", "lowest initial pressure", bounds=(0.0, 1e6), default=2.5e5
    )
    max_pressure: float = parameter(
        "Pa", "p_max", "highest initial pressure", bounds=(0.0, 1e6), default=3.5e5
    )

    def check(self) -> None:
        joints = len(self.plant.mechanism.coordinates)
        if len(self.targets) != joints:
            raise ParameterError(
                f"ArmReaching: {len(self.targets)} targets for {joints} joints; give one each."
            )

    @property
    def observations(self) -> tuple[Observation, ...]:
        joints = self.plant.mechanism.coordinates
        return (
            *(Observation(c.name, "rad", -3.2, 3.2, "joint angle") for c in joints),
            *(Observation(c.speed, "rad/s", -50.0, 50.0, "speed of a joint angle") for c in joints),
            *(
                Observation(f"{p}pressure", "bar", -1.1, 20.0, "gauge pressure")
                for p in self.plant.prefixes
            ),
            *(Observation(f"{c.name}.target", "rad", -3.2, 3.2, "reference angle") for c in joints),
        )

    @property
    def initial_ranges(self) -> Mapping[str, tuple[float, float]]:
        pressures = {
            f"{p}pressure": (self.min_pressure, self.max_pressure) for p in self.plant.prefixes
        }
        angles = {
            c.name: (-self.initial_angle, self.initial_angle)
            for c in self.plant.mechanism.coordinates
        }
        return {**pressures, **angles}

    def observe(
        self, state: Mapping[str, Value], outputs: Mapping[str, Value], time: Value
    ) -> tuple[Value, ...]:
        joints = self.plant.mechanism.coordinates
        # in the order of the observations
        angles = [state[c.name] for c in joints]
        speeds = [state[c.speed] for c in joints]
        pressures = [outputs[f"{p}pressure"] / bar for p in self.plant.prefixes]
        return (*angles, *speeds, *pressures, *self.targets)

    def errors(self, state: Mapping[str, Value], time: Value) -> tuple[Value, ...]:
        pairs = zip(self.plant.mechanism.coordinates, self.targets, strict=True)
        return tuple((state[c.name] - target) / self.error_scale for c, target in pairs)

    def ends(self, state: Mapping[str, Value]) -> Value:
        angles = (ops.absolute_value(state[c.name]) for c in self.plant.mechanism.coordinates)
        return sum(ops.where(angle > self.largest_angle, 1.0, 0.0) for angle in angles) > 0.5


LibraryEntry = TypeVar("LibraryEntry", Entry, PlantEntry, ValveEntry)
TaskWithRandomisation = tuple[JointTracking | LoadLifting | ArmReaching, tuple[Randomisation, ...]]


@functools.cache
def joint_task() -> TaskWithRandomisation:
    """Tracking by joint-dmsp-20-matrix; sines of 0.1 to 0.4 rad and 0.1 to 0.8 Hz, inertia and
    supply vary.
    """
    return JointTracking(_loaded("joint-dmsp-20-matrix", PlantEntry).plant), (
        ValueRange(("target_amplitude",), 0.1, 0.4),
        ValueRange(("target_frequency",), 0.1, 0.8),
        ValueRange(("target_phase",), 0.0, 2.0 * math.pi),
        FactorRange(("plant.mechanism.inertia",), 0.8, 1.2),
        FactorRange(("plant.mechanism.weight_torque",), 0.7, 1.3),
        FactorRange(
            ("plant.circuit[0].supply.pressure", "plant.circuit[1].supply.pressure"), 0.8, 1.0
        ),
    )


@functools.cache
def lift_task() -> TaskWithRandomisation:
    """Lifting of 15 to 25 kg by dmsp-20-300 with MATRIX 821 valves at 6 bar to heights of 10 to 40
    mm.
    """
    muscle = _loaded("dmsp-20-300", Entry).muscle
    valve = _loaded("matrix-821", ValveEntry).valve
    muscle = dataclasses.replace(muscle, damper=LinearDamper(200.0))
    plant = Plant(muscle, FillDischarge(Supply(6e5), valve, valve), HangingMass(20.0))
    return LoadLifting(plant), (
        ValueRange(("target_height",), 0.01, 0.04),
        FactorRange(("plant.mechanism.mass",), 0.75, 1.25),
        FactorRange(("plant.circuit.supply.pressure",), 0.8, 1.0),
    )


@functools.cache
def arm_task() -> TaskWithRandomisation:
    """Reaching by the arm of Lilly and Quesada: reference angles within 0.1 rad, masses vary."""
    masses = ("plant.mechanism.links[0].mass", "plant.mechanism.links[1].mass")
    return ArmReaching(_loaded("arm-lilly-quesada", PlantEntry).plant), (
        ValueRange(("targets[0]",), -0.1, 0.1),
        ValueRange(("targets[1]",), -0.1, 0.1),
        FactorRange(masses, 0.8, 1.2),
    )


ON_OFF = "JointOnOff"
TASKS = {"Joint": joint_task, ON_OFF: joint_task, "Lift": lift_task, "Arm": arm_task}
"""Functions that return the tasks of the registered environments, airmuscle/Joint-v0 and so on."""


def task_and_options(
    kind: str, task: EnvironmentTask | None, options: dict[str, Any]
) -> tuple[EnvironmentTask, dict[str, Any]]:
    """The given task, or that of a registered environment with its randomisation."""
    if task is not None:
        return task, options
    default, randomisation = TASKS[kind]()
    return default, {"randomisation": randomisation, **options}


def _loaded(name: str, kind: type[LibraryEntry]) -> LibraryEntry:
    """An entry of the library without its warnings."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        entry = load(name)
    assert isinstance(entry, kind)
    return entry


_CM = 0.01
"""Centimetre [m], the unit of the observed heights."""

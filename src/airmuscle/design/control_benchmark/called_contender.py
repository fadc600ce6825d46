"""SensedController: a controller that is called at each sample, behind the sensors and in front of the actuation."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

from ...core.declaration import model
from ...core.ops import Value
from ...engine.loop.control_law import ControlLaw
from ...engine.loop.controller import Controller, Measurement
from ...engine.loop.sensors import WithSensors
from ...engine.run.compiled_law import LawSample
from .tasks import StuckValve

COMMANDED = "commanded."
"""Prefix of the set points by which the actuation receives the commands of a controller."""


@model
class Readings(ControlLaw):
    """The measured columns themselves as commands, so that sensors in front of it deliver their readings."""

    from_file: ClassVar[bool] = False

    columns: tuple[str, ...]
    setpoints: ClassVar[tuple[str, ...]] = ()
    initial_memory: ClassVar[Mapping[str, float]] = {}

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return self.columns

    @property
    def inputs(self) -> tuple[str, ...]:
        return self.columns

    def step(
        self, memory: Mapping[str, Value], measurement: Measurement, dt: Value
    ) -> tuple[dict[str, Value], dict[str, Value]]:
        return {name: measurement.columns[name] for name in self.columns}, {}


class SensedMemory(NamedTuple):
    """Memories of the sensors, the controller and the actuation, and the number of samples so far."""

    sensors: Any
    controller: Any
    actuation: Any
    samples: int


@dataclasses.dataclass(frozen=True, eq=False)
class SensedController(Controller):
    """A controller that is no control law, with sensors in front of it and the actuation behind it.

    controller  commands half the pressure difference, both pressures, or the valves
    actuation   law from these commands, as set points `commanded.<input>`, to the valves
    ranges      minimum and maximum [SI] of the controller's commands; those of the plant unless given
    sensors     of all columns that controller and actuation measure
    stuck       a valve that sticks
    """

    controller: Controller
    actuation: ControlLaw
    ranges: Mapping[str, tuple[float, float]]
    sensors: WithSensors
    stuck: StuckValve | None = None

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return self.sensors.measured_columns

    @property
    def setpoints(self) -> tuple[str, ...]:
        further = [name for name in self.actuation.setpoints if not name.startswith(COMMANDED)]
        return tuple(dict.fromkeys((*self.controller.setpoints, *further)))

    @property
    def inputs(self) -> tuple[str, ...]:
        return self.actuation.inputs

    @functools.cached_property
    def _compiled(self) -> tuple[LawSample, LawSample]:
        """Sensors and actuation as machine code."""
        return LawSample(self.sensors), LawSample(self.actuation)

    def __getstate__(self) -> dict[str, Any]:
        """The fields without machine code, which belongs to one process."""
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}

    def init(self) -> SensedMemory:
        sensors, actuation = self._compiled
        return SensedMemory(sensors.initial, self.controller.init(), actuation.initial, 0)

    def step(
        self, memory: SensedMemory, measurement: Measurement, dt: float
    ) -> tuple[Mapping[str, float], SensedMemory]:
        sense, act = self._compiled
        readings, sensors = sense.step(memory.sensors, measurement, dt)
        seen = Measurement(readings, measurement.setpoints, {**measurement.ranges, **self.ranges})
        commands, own = self.controller.step(memory.controller, seen, dt)
        points = {**measurement.setpoints, **{f"{COMMANDED}{name}": value for name, value in commands.items()}}
        valves, actuation = act.step(memory.actuation, seen._replace(setpoints=points), dt)
        if self.stuck is not None and (memory.samples + 1e-6) * dt > self.stuck.time:
            valves = {**valves, self.stuck.input: self.stuck.opening}
        return valves, SensedMemory(sensors, own, actuation, memory.samples + 1)

    def notes(self, memory: SensedMemory) -> tuple[str, ...]:
        """The remarks of the controller."""
        return self.controller.notes(memory.controller)


def sensed(
    controller: Controller,
    actuation: ControlLaw,
    ranges: Mapping[str, tuple[float, float]],
    sensors: tuple[Any, ...],
    seed: int,
) -> SensedController:
    """A controller behind the sensors of the columns that it and the actuation measure."""
    columns = tuple(dict.fromkeys((*controller.measured_columns, *actuation.measured_columns)))
    known = {sensor.column: sensor for sensor in sensors}
    chosen = tuple(known[name] for name in columns)
    return SensedController(controller, actuation, ranges, WithSensors(Readings(columns), chosen, float(seed)))

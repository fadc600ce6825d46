"""Contenders of a comparison: laws and called controllers, completed by sensors and
pressure control.
"""

import dataclasses
import functools
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

from ...control.laws import DIFFERENCE, Cascade, CoContraction, ProportionalFeedback
from ...core import ParameterError, Value, check_field_types, leaves, model, one_line, ops
from ...core.declaration import forwarded
from ...core.system import select_prefix, united, with_prefix
from ...engine.loop import (
    ControlLaw,
    Controller,
    Measurement,
    Memory,
    Sampled,
    SigmaDelta,
    SplitRange,
    WithSensors,
)
from ...engine.run.compiled_law import LawSample
from ..tuning import load_scenario_loop
from . import JointRig

ELSEWHERE = (
    "A controller of another plant, such as a fitted arm, is judged by airmuscle tune {}, whose"
    " table has the error of its present gains and of tuned ones on perturbed plants; give each"
    " controller a scenario of its own."
)
"""What to do with a controller that does not fit the joint, by the path of its scenario."""

COMMANDED = "commanded."
"""Prefix of the set points by which the actuation receives the commands of a controller."""


@model
class PassedSignals(ControlLaw):
    """Measured columns as commands, and set points `commanded.<input>` as commands that are limited
    and remembered.

    Sensors in front of it deliver their readings. In a `Cascade` with tracking it remembers what
    the inner law attains.
    """

    from_file: ClassVar[bool] = False

    columns: tuple[str, ...] = ()
    commanded: tuple[str, ...] = ()

    measured_columns = forwarded("columns")

    @property
    def setpoints(self) -> tuple[str, ...]:
        return tuple(f"{COMMANDED}{name}" for name in self.commanded)

    @property
    def inputs(self) -> tuple[str, ...]:
        return (*self.columns, *self.commanded)

    @property
    def initial_memory(self) -> dict[str, float]:
        return dict.fromkeys(self.commanded, 0.0)

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        wanted = measurement.setpoints
        ranges = measurement.ranges
        applied = {
            name: ops.clip(wanted[f"{COMMANDED}{name}"], *ranges[name]) for name in self.commanded
        }
        return {**{name: measurement.columns[name] for name in self.columns}, **applied}, applied


Memories = tuple[Any, Any, Any]
"""Memories of the three parts of a controller, in the order of its fields."""


@dataclasses.dataclass(frozen=True, eq=False)
class SensedController(Controller):
    """A controller that is no control law, with sensors in front of it and the actuation behind it.

    sensors     of all columns that controller and actuation measure
    controller  commands half the pressure difference, both pressures, or the valves
    actuation   law from these commands, as set points `commanded.<input>`, to the valves, which
                remembers them as they are attained: the controller goes on as if it had commanded
                those
    ranges      minimum and maximum [SI] of the controller's commands; those of the plant unless
                given
    """

    sensors: WithSensors
    controller: Controller
    actuation: ControlLaw
    ranges: Mapping[str, tuple[float, float]]

    measured_columns = forwarded("sensors.law.measured_columns")

    @property
    def setpoints(self) -> tuple[str, ...]:
        further = [name for name in self.actuation.setpoints if not name.startswith(COMMANDED)]
        return tuple(dict.fromkeys((*self.controller.setpoints, *further)))

    inputs = forwarded("actuation.inputs")

    @functools.cached_property
    def _compiled(self) -> tuple[LawSample, LawSample]:
        """Sensors and actuation as machine code."""
        return LawSample(self.sensors), LawSample(self.actuation)

    def __getstate__(self) -> dict[str, Any]:
        """The fields without machine code, which belongs to one process."""
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}

    def init(self) -> Memories:
        sensors, actuation = self._compiled
        return sensors.initial, self.controller.init(), actuation.initial

    def step(
        self, memory: Memories, measurement: Measurement, dt: float
    ) -> tuple[Mapping[str, float], Memories]:
        sense, act = self._compiled
        sensors, before, actuation = memory
        readings, sensors = sense.step(sensors, measurement, dt)
        ranges = {**measurement.ranges, **self.ranges}
        seen = Measurement(readings, measurement.setpoints, ranges)
        commands, controller_memory = self.controller.step(before, seen, dt)
        points = {**measurement.setpoints, **with_prefix(COMMANDED, commands)}
        valves, actuation = act.step(actuation, seen._replace(setpoints=points), dt)
        attained = self._attained(commands, actuation)
        is_limited = any(
            abs(attained[name] - value) > 1e-9 * abs(value) for name, value in commands.items()
        )
        if is_limited:
            # The controller takes note of what was applied: a second step, in which nothing else
            # is possible, replaces its memory.
            only = {name: (value, value) for name, value in attained.items()}
            limited = seen._replace(ranges={**seen.ranges, **only})
            _, controller_memory = self.controller.step(before, limited, dt)
        return valves, (sensors, controller_memory, actuation)

    def _attained(self, commands: Mapping[str, float], actuation: Any) -> dict[str, float]:
        """The commands as the actuation applied them, which stand in its memory."""
        applied = dict[str, float]()
        memories = zip(self.actuation.initial_memory, actuation, strict=True)
        for key, value in memories:
            name = key.rpartition("outer.")[2].removeprefix("law.")
            applied[name] = value
        return {name: applied[name] for name in commands}

    def notes(self, memory: Memories) -> tuple[str, ...]:
        """The remarks of the controller."""
        _, controller_memory, _ = memory
        return self.controller.notes(controller_memory)


BAR = 1e5
Bounds = Mapping[str, tuple[float, float]]
ZONE = (0.005 * BAR, 0.2 * BAR)
"""Range of the dead zone of the inner pressure control (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False)
class Contender:
    """A controller that takes part in a comparison.

    name     for tables
    law      a ControlLaw, which is compiled with the plant, or another Controller, which is called
             at each sample. It commands half the pressure difference (`difference`), both pressures
             (`left.pressure`, `right.pressure`) or the valves. It may measure the angle, the
             angular speed and both pressures. Its set points are names of TaskSignals: `angle`,
             `angular_speed`, `angular_acceleration`, `mean_pressure`, `stiffness`, `feed_forward`,
             `feed_forward_rate`
    bounds   minimum and maximum [SI] of the gains of the law that are tuned, by path. Without
             bounds, and with a law that commands the valves, nothing is tuned
    commissioned  the same of the gains that are sought afterwards on each truth, by the same
                  routine and number of runs for all contenders; none: the contender is not
                  commissioned
    tuned_as  a contender whose tuned gains it takes, by the ends of their paths, in place of its
              own tuning
    """

    name: str
    law: Controller
    bounds: Bounds = dataclasses.field(default_factory=dict)
    commissioned: Bounds = dataclasses.field(default_factory=dict)
    tuned_as: "Contender | None" = None

    def __post_init__(self) -> None:
        if not isinstance(self.law, Controller):
            raise ParameterError(
                f"Contender '{one_line(self.name)}': its law is a {type(self.law).__name__}; give a"
                " ControlLaw or another Controller."
            )
        check_field_types(self)
        known = [leaf.path for leaf in leaves(self.law)]
        for purpose, bounds in (("tuned", self.bounds), ("commissioned", self.commissioned)):
            if unknown := [path for path in bounds if path not in known]:
                raise ParameterError(
                    f"contender '{self.name}': {type(self.law).__name__} has no declared parameter"
                    f" '{unknown[0]}' to be {purpose}; there are {', '.join(known) or 'none'}. Omit"
                    " its bounds."
                )


class CompleteLaw(NamedTuple):
    """A law that commands the valves of a joint through its sensors, and the ranges of the gains
    that are tuned, and of those that are commissioned."""

    law: WithSensors | SensedController
    bounds: Bounds
    commissioned: Bounds


def complete(joint: JointRig, contender: Contender, seed: int = 1) -> CompleteLaw:
    """The law of a contender with the parts that it lacks: co-contraction, pressure control,
    modulation, sensors.

    Raises ParameterError for a law that commands other inputs, or measures a column without a
    sensor.
    """
    _check_columns(joint, contender)
    ranges = (contender.bounds, contender.commissioned)
    known = {sensor.column: sensor for sensor in joint.sensors}
    if isinstance(contender.law, ControlLaw):
        law, prefix, actuation_bounds = _actuated(joint, contender.law, contender.name)
        sensors = tuple(known[name] for name in law.measured_columns)
        tuned, commissioned = (with_prefix(f"law.{prefix}", bounds) for bounds in ranges)
        return CompleteLaw(
            WithSensors(law, sensors, float(seed)),
            {**tuned, **with_prefix("law.", actuation_bounds)},
            commissioned,
        )
    inputs = contender.law.inputs
    law, _, actuation_bounds = _actuated(joint, PassedSignals((), inputs), contender.name)
    tuned, commissioned = (with_prefix("controller.", bounds) for bounds in ranges)
    span = joint.pressure_span
    limits = dict.fromkeys(joint.pressures, (joint.min_pressure, joint.max_pressure)) | {
        DIFFERENCE: (-span, span)
    }
    limited = {name: limits[name] for name in inputs if name in limits}
    tuned = {**tuned, **with_prefix("actuation.", actuation_bounds)} if tuned else {}
    columns = united(contender.law.measured_columns, law.measured_columns)
    sense = WithSensors(PassedSignals(columns), tuple(known[name] for name in columns), float(seed))
    return CompleteLaw(SensedController(sense, contender.law, law, limited), tuned, commissioned)


def _check_columns(joint: JointRig, contender: Contender, path: str | Path = "FILE.toml") -> None:
    """Raise ParameterError where a law, of the scenario `path`, measures a column without a
    sensor.
    """
    known = [sensor.column for sensor in joint.sensors]
    if without := [name for name in contender.law.measured_columns if name not in known]:
        raise ParameterError(
            f"contender '{contender.name}' measures '{without[0]}'; the joint has sensors of"
            f" {', '.join(known)}. {ELSEWHERE.format(path)}"
        )


def _actuated(joint: JointRig, law: ControlLaw, name: str) -> tuple[ControlLaw, str, Bounds]:
    """A law with the parts from its commands to the valves, the prefix of its parameters, and
    ranges of the parts.
    """
    prefix = ""
    ranges = dict[str, tuple[float, float]]()
    tracking = not joint.switching
    if law.inputs == (DIFFERENCE,):
        span = (joint.pressure_span,)
        law = Cascade(
            law, CoContraction(joint.pressures, 0.0, "mean_pressure"), (-span[0],), span, tracking
        )
        prefix = "outer."
    if set(law.inputs) == set(joint.pressures):
        names = [muscle.name for muscle in joint.model.muscles]
        valves = tuple(SplitRange(f"{name}.fill", f"{name}.discharge") for name in names)
        start = (10.0 / BAR, 0.02 * BAR) if joint.switching else (2.0 / BAR, 0.0)
        inner = ProportionalFeedback(joint.pressures, valves, *start)
        law = Cascade(law, inner, (joint.min_pressure,) * 2, (joint.max_pressure,) * 2, tracking)
        prefix = f"outer.{prefix}"
        ranges = {"inner.gain": joint.pressure_gains}
        if joint.switching:
            law = SigmaDelta(law)
            prefix = f"law.{prefix}"
            ranges = with_prefix("law.", {**ranges, "inner.zone": ZONE})
    if set(law.inputs) != set(joint.model.inputs) - {"external_torque"}:
        raise ParameterError(
            f"contender '{name}' commands {', '.join(law.inputs)}; allowed are '{DIFFERENCE}', the"
            f" pressures {', '.join(joint.pressures)}, or all valves."
        )
    return law, prefix, ranges


def scenario_contender(joint: JointRig, path: str | Path) -> Contender:
    """The contender of a scenario file: its control law, with the ranges of its gains that
    `airmuscle tune` has.

    The rig has its own sensors and, for a law that commands pressures, its own pressure
    control: `WithSensors` around the law is removed, and of a `Cascade` whose inputs the joint does
    not have the outer law is taken. Raises FileError, ParameterError, UnitError or UnknownNameError
    with the location; ParameterError for a law that commands none of half the pressure difference,
    the pressures and the valves of the joint.
    """
    scenario = load_scenario_loop(path)
    law = scenario.loop.controller
    prefix = ""
    allowed = {DIFFERENCE}, set(joint.pressures), set(joint.model.inputs) - {"external_torque"}
    while isinstance(law, WithSensors | Cascade) and (
        isinstance(law, WithSensors) or set(law.inputs) not in allowed
    ):
        name, law = ("law", law.law) if isinstance(law, WithSensors) else ("outer", law.outer)
        prefix = f"{prefix}{name}."
    if not isinstance(law, ControlLaw) or set(law.inputs) not in allowed:
        raise ParameterError(
            f"{scenario.location.inside('input').inside('controller')}: the law commands"
            f" {', '.join(law.inputs)}; allowed are '{DIFFERENCE}', the pressures"
            f" {', '.join(joint.pressures)}, or all valves {', '.join(sorted(allowed[2]))}."
            f" {ELSEWHERE.format(path)}"
        )
    contender = Contender(Path(path).stem, law, select_prefix(prefix, scenario.bounds()))
    _check_columns(joint, contender, path)
    return contender

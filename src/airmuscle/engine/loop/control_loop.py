"""ControlLoop: a sampled controller at a plant, with its sample time, set points, other inputs and
drivers.

A control law that is designed from weights (LawDesign) is designed before the loop runs.
"""

import abc
import dataclasses
import functools
import math
import sys
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core import (
    ParameterError,
    ShortRepr,
    System,
    Value,
    abridged,
    alternatives,
    describe_model,
    quantity,
)
from ...core.tree import Structure, structure, with_ambient
from ...recording.recording import Recording
from .control_law import ControlLaw, EnclosingLaw, Memory, Sampled, rebuilt
from .controller import Controller, Measurement, named_signal_units
from .inputs import (
    ZERO_INPUT,
    CombinedSignal,
    InputSignal,
    Schedule,
    check_input_names,
    check_input_signal,
)
from .pwm_and_solenoid import Driver, WithDrivers

COMMAND = "command."
SETPOINT = "setpoint."
MEASURED = "measured."
"""Prefixes of the columns of a recording that hold commands, set points and measurements of a
controller.
"""
_without_design: set[Structure] = set()
"""Structures of control laws that contain no design."""


class ControlLoopState(NamedTuple):
    """A control loop at one instant.

    controller      the controller's memory
    origin, time    when the loop began, and this instant [s]
    sample_count    samples so far
    measured, commanded    values of the last sample
    applied_inputs  the plant's inputs just before this instant
    drivers         the drivers' states
    """

    controller: Any
    origin: float
    time: float
    sample_count: int
    measured: tuple[float, ...]
    commanded: tuple[float, ...]
    applied_inputs: tuple[float, ...]
    drivers: Mapping[str, tuple[Any, ...]]


@dataclasses.dataclass(frozen=True, repr=False)
class ControlLoop(ShortRepr):
    """A sampled control loop: every `sample_time` [s], from the start of a run, the controller
    measures and commands.

    sample_time   a number [s], or a text with its unit, "5 ms"
    setpoint      an InputSignal whose names are the controller's set points,
                  `Schedule({"pressure": ((0, 1e5), (2, 3e5))})`
    other_inputs  an InputSignal for the inputs that the controller does not command; zero by
                  default
    drivers       between commands and openings, as in WithDrivers; the command of a driver is
                  within 0 and 1

    Between two samples a command is held. It is limited to the range that the plant declares for
    its input.
    """

    controller: Controller
    sample_time: float
    setpoint: InputSignal
    other_inputs: InputSignal = ZERO_INPUT
    drivers: Mapping[str, Driver | tuple[Driver, ...]] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        if not isinstance(self.controller, Controller):
            raise ParameterError(
                f"ControlLoop.controller is {abridged(self.controller)}; give a PID or another"
                " Controller."
            )
        sample_time: Any = self.sample_time
        if isinstance(sample_time, str):
            sample_time = quantity(sample_time, "s", where="ControlLoop.sample_time")
        elif isinstance(sample_time, np.number | np.ndarray) and np.ndim(sample_time) == 0:
            sample_time = sample_time.item()
        object.__setattr__(self, "sample_time", sample_time)
        if (
            isinstance(sample_time, bool)
            or not isinstance(sample_time, float | int)
            or not 0 < sample_time <= sys.float_info.max
        ):
            raise ParameterError(
                f"ControlLoop.sample_time is {abridged(sample_time)} s; it must be positive and"
                " finite."
            )
        check_input_signal(self.setpoint)
        check_input_signal(self.other_inputs)
        named = self.setpoint.names
        expected = self.controller.setpoints
        if named is not None and set(named) != set(expected):
            raise ParameterError(
                f"ControlLoop.setpoint names {', '.join(named) or 'nothing'}; the set points of "
                f"{type(self.controller).__name__} are {', '.join(expected)}."
            )
        twice = [name for name in self.other_inputs.names or () if name in self.controller.inputs]
        if twice:
            raise ParameterError(
                f"the input '{twice[0]}' is commanded by the controller and by other_inputs."
            )
        _ = self.driven_inputs

    @property
    def driven_inputs(self) -> WithDrivers:
        """The inputs that the controller does not command behind their drivers, and the drivers of
        all.
        """
        return WithDrivers(self.other_inputs, self.drivers)

    def init(self, start: float) -> ControlLoopState:
        """The state of a loop that begins at `start` [s]: no sample yet, every driver at rest."""
        controller = self.controller
        return ControlLoopState(
            controller=controller.init(),
            origin=start,
            time=start,
            sample_count=0,
            measured=(math.nan,) * len(controller.measured_columns),
            commanded=(0.0,) * len(controller.inputs),
            applied_inputs=(),
            drivers=self.driven_inputs.init(start),
        )

    def check_columns(self, columns: Sequence[str], inputs: Sequence[str]) -> None:
        """Raise ParameterError, with the nearest name, for a column or input that the plant does
        not have.
        """
        check_present(self.controller, columns, inputs)
        check_input_names((*(self.other_inputs.names or ()), *self.drivers), inputs)

    def command_ranges(self, plant: System) -> dict[str, tuple[float, float]]:
        """Minimum and maximum of every commanded input of a plant, in its order; of one with a
        driver 0 and 1.
        """
        declared = {
            variable.name: (variable.minimum, variable.maximum)
            for variable in plant.input_variables
        }
        known = {**declared, **dict.fromkeys(self.drivers, (0.0, 1.0))}
        return {name: known[name] for name in self.controller.inputs}

    def units(self, known: Mapping[str, str]) -> dict[str, str]:
        """The units of the columns that the loop adds to a recording, from those of the plant's
        columns.
        """
        known = {
            **named_signal_units(self.controller),
            **{name: unit for name, unit in known.items() if unit},
        }
        names = [name for names_of_signal in self.signals.values() for name in names_of_signal]
        return {
            column: known.get(name, "")
            for column, name in zip(self.column_names, names, strict=True)
        }

    @property
    def signals(self) -> dict[str, tuple[str, ...]]:
        """Names of set points, measured columns and commanded inputs, by the prefixes of their
        columns.
        """
        controller = self.controller
        return {
            SETPOINT: controller.setpoints,
            MEASURED: controller.measured_columns,
            COMMAND: controller.inputs,
        }

    @property
    def column_names(self) -> tuple[str, ...]:
        """The columns that the loop adds to a recording."""
        return tuple(f"{prefix}{name}" for prefix, names in self.signals.items() for name in names)

    def describe(self, units: Mapping[str, str]) -> str:
        """Controller, sample time, controlled and manipulated variables; `units` by the names of
        columns and inputs.
        """
        measured, commanded = (
            ", ".join(
                f"{name} [{units[name]}]" if units.get(name, "1") not in ("", "1") else name
                for name in names
            )
            for names in (self.controller.measured_columns, self.controller.inputs)
        )
        seconds = self.sample_time
        period = f"{seconds * 1e3:.4g} ms" if seconds < 1 else f"{seconds:.4g} s"
        return (
            f"{self._controller_text}, sample time {period}, measured {measured}, commanded"
            f" {commanded}"
        )

    @functools.cached_property
    def _controller_text(self) -> str:
        """The controller and its fields."""
        return describe_model(self.controller)

    def as_open_loop(self, recording: Recording) -> InputSignal:
        """The commands of a complete recorded run as an input signal without a controller.

        It gives the same run: to plot the outputs of the drivers, or to simulate another plant with
        the same commands.
        """
        time = recording["time"].tolist()
        commands = {name: recording[f"{COMMAND}{name}"].tolist() for name in self.controller.inputs}
        changes = {
            name: tuple((time[i], v) for i, v in enumerate(values) if i == 0 or v != values[i - 1])
            for name, values in commands.items()
        }
        signal = CombinedSignal(Schedule(changes), self.other_inputs)
        return WithDrivers(signal, self.drivers) if self.drivers else signal


def check_present(controller: Controller, columns: Sequence[str], inputs: Sequence[str]) -> None:
    """Raise ParameterError, with the nearest name, for a column or input that the plant does not
    have.
    """
    for name in controller.measured_columns:
        if name not in columns:
            raise ParameterError(
                f"{type(controller).__name__} measures '{name}', which the plant does not have"
                f"{alternatives(name, columns)}"
            )
    check_input_names(controller.inputs, inputs)


class LawDesign(EnclosingLaw):
    """A control law whose numbers follow from declared weights by a design, such as Riccati
    equations.

    A design cannot be traced; its result can. A run therefore compiles the designed `law`, and a
    search for the weights designs it anew for each set. Everything else is that of the designed
    law.
    """

    @property
    @abc.abstractmethod
    def law(self) -> ControlLaw:
        """The designed law."""

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        return self.law.step(memory, measurement, dt)


def with_designed_laws(law: Controller) -> Controller:
    """A controller with the designed law in place of every LawDesign in it; the same object where
    there is none.

    A controller that is no ControlLaw remains as it is.
    """
    if not isinstance(law, ControlLaw) or structure(law) in _without_design:
        return law
    designed: Controller = rebuilt(
        law, lambda part: part.law if isinstance(part, LawDesign) else part
    )
    if designed is law:
        _without_design.add(structure(law))
    return designed


def designed_loop(loop: ControlLoop, system: System) -> ControlLoop:
    """A loop with the designed laws in its controller; the same object where there is no design.

    Pressures that the controller states as absolute are converted with the ambient pressure of the
    system.
    """
    controller = with_designed_laws(loop.controller)
    ambient = system.constants.get("ambient")
    if isinstance(controller, ControlLaw) and isinstance(ambient, float):
        controller = with_ambient(controller, ambient)
    return (
        loop if controller is loop.controller else dataclasses.replace(loop, controller=controller)
    )

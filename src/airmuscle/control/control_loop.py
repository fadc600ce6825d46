"""A loop: a controller at a plant, how often it looks, what it is to follow, and what stands around it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from ..core.errors import ParameterError, suggestion
from .controller import Controller
from .driver import Driver, WithDrivers, column, merge_inputs
from .inputs import ZERO_INPUT, InputSignal, PiecewiseLinear, Schedule, check_input_names, check_input_signal

if TYPE_CHECKING:
    from ..recording import Recording

COMMAND, SETPOINT, MEASURED = "command.", "setpoint.", "measured."
"""How the columns of a recording begin that hold what a controller commanded, was to follow, and measured."""


class ControlLoopState(NamedTuple):
    """A loop at one moment: the controller's memory, when the loop began and which moment it is [s], the samples taken
    so far, what was measured and commanded at the last, the inputs that the plant had, and the drivers' memories."""

    controller: Any
    origin: float
    time: float
    sample_count: int
    measured: tuple[float, ...]
    commanded: tuple[float, ...]
    applied_inputs: tuple[float, ...]
    drivers: Mapping[str, tuple[Any, ...]]


@dataclasses.dataclass(frozen=True)
class ControlLoop:
    """A sampled loop: every `period` [s], from the beginning of a run on, the controller measures and commands.

    setpoint  a Command whose names are the controller's set points, `Schedule({"pressure": ((0, 1e5), (2, 3e5))})`
    beside    a Command for the inputs that the controller does not command; they rest unless given
    drivers   what stands between command and opening, as in Driven; a command to one is within 0 and 1

    Between two samples a command is held. It is cut off at the range that the plant declares for its input.
    """

    controller: Controller
    period: float
    setpoint: InputSignal
    other_inputs: InputSignal = ZERO_INPUT
    drivers: Mapping[str, Driver | tuple[Driver, ...]] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        if not isinstance(self.controller, Controller):
            raise ParameterError(f"ControlLoop.controller is {self.controller!r}; give a PID or another Controller.")
        period = self.period
        if isinstance(period, bool) or not isinstance(period, float | int) or not 0 < period < math.inf:
            raise ParameterError(f"ControlLoop.period is {period!r} s; it must be positive and finite.")
        check_input_signal(self.setpoint)
        check_input_signal(self.other_inputs)
        self._check_names()
        WithDrivers(self.other_inputs, self.drivers)

    def _check_names(self) -> None:
        controller = self.controller
        named = self.setpoint.names
        if named is not None and set(named) != set(controller.setpoints):
            raise ParameterError(
                f"ControlLoop.setpoint names {', '.join(named) or 'nothing'}; {type(controller).__name__} follows "
                f"{', '.join(controller.setpoints)}."
            )
        twice = [name for name in self.other_inputs.names or () if name in controller.inputs]
        if twice:
            raise ParameterError(f"the input '{twice[0]}' is commanded by the controller, and beside it too.")

    def init(self, start: float) -> ControlLoopState:
        """The memory of a loop that begins at `start` [s]: nothing measured yet, every driver at rest."""
        drivers = WithDrivers(self.other_inputs, self.drivers).init(start)
        told = (0.0,) * len(self.controller.inputs)
        return ControlLoopState(
            self.controller.init(),
            start,
            start,
            0,
            (math.nan,) * len(self.controller.measured_columns),
            told,
            (),
            drivers,
        )

    def check_columns(self, columns: Sequence[str], inputs: Sequence[str]) -> None:
        """Raise ParameterError, with the nearest name, for what a plant with these columns and inputs does not have."""
        check_present(self.controller, columns, inputs)
        check_input_names((*(self.other_inputs.names or ()), *self.drivers), inputs)

    def check_period(self, duration: float) -> None:
        """Raise ParameterError where a run of `duration` [s] ends before the second sample."""
        if self.period > duration:
            raise ParameterError(
                f"the controller looks every {self.period:g} s, and the run lasts {duration:g} s: it would look only "
                "once. Shorten the period, or simulate longer."
            )

    def units(self, known: Mapping[str, str]) -> dict[str, str]:
        """The units of the columns that a recording has because of the loop, from those of the plant's columns."""
        kinds = (
            (SETPOINT, self.controller.setpoints),
            (MEASURED, self.controller.measured_columns),
            (COMMAND, self.controller.inputs),
        )
        return {f"{kind}{name}": known.get(name, "") for kind, names in kinds for name in names}

    def describe(self, units: Mapping[str, str]) -> str:
        """Who measures, commands and follows what, and how often; `units` by the names of columns and inputs."""
        with_unit = {name: f"{name} [{unit}]" if unit else name for name, unit in units.items()}
        measured, commanded = (
            ", ".join(with_unit.get(name, name) for name in names)
            for names in (self.controller.measured_columns, self.controller.inputs)
        )
        return (
            f"every {self.period:g} s {measured} is measured and {commanded} commanded by {_in_words(self.controller)}"
        )

    def as_open_loop(self, recording: Recording) -> InputSignal:
        """What the controller commanded in a run that was recorded whole, as a command that knows no controller.

        It gives the same run: to draw what drivers made of it, or to run something else under the same command.
        """
        time = recording["time"].tolist()
        told = {name: recording[f"{COMMAND}{name}"].tolist() for name in self.controller.inputs}
        changes = {
            name: tuple((time[i], v) for i, v in enumerate(values) if i == 0 or v != values[i - 1])
            for name, values in told.items()
        }
        command = Beside(Schedule(changes), self.other_inputs)
        return WithDrivers(command, self.drivers) if self.drivers else command


def check_present(controller: Controller, columns: Sequence[str], inputs: Sequence[str]) -> None:
    """Raise ParameterError, with the nearest name, for what a plant with these columns and inputs does not have."""
    for name in controller.measured_columns:
        if name not in columns:
            raise ParameterError(
                f"{type(controller).__name__} measures '{name}', which the plant does not have; there are "
                f"{', '.join(columns)}.{suggestion(name, columns)}"
            )
    check_input_names(controller.inputs, inputs)


@dataclasses.dataclass(frozen=True)
class Beside(InputSignal):
    """The inputs that `inner` names as it says, the others as `other` does."""

    inner: InputSignal
    other: InputSignal

    @property
    def names(self) -> tuple[str, ...] | None:
        other = self.other.names
        return None if other is None else (*(self.inner.names or ()), *other)

    def segments(self, inputs: Sequence[str], start: float, duration: float) -> PiecewiseLinear:
        inner, other = (command.segments(inputs, start, duration) for command in (self.inner, self.other))
        return merge_inputs(
            other, {inputs.index(name): column(inner, inputs.index(name)) for name in self.inner.names or ()}, start
        )


def _in_words(controller: Controller) -> str:
    """A controller and its fields; numbers without the last digits, which a change of unit leaves."""
    told = []
    fields: tuple[dataclasses.Field[Any], ...] = ()
    if dataclasses.is_dataclass(controller):
        fields = dataclasses.fields(controller)
    for field in fields:
        value = getattr(controller, field.name)
        told.append(f"{field.name}={value:.12g}" if isinstance(value, float) else f"{field.name}={value!r}")
    return f"{type(controller).__name__}({', '.join(told)})"

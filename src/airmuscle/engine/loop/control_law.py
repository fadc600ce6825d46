"""Control laws (interfaces): controllers written over `ops`, so that a whole loop runs as compiled
code.

Laws around other laws, laws of one column by one input or by two in split range, and sigma-delta
modulation.
"""

import abc
import dataclasses
import operator
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar

from ...core import (
    ParameterError,
    Reference,
    Value,
    model,
    ops,
    parameter,
    published,
    select_prefix,
    with_prefix,
)
from ...core.declaration import forwarded
from .controller import Controller, Measurement

Memory = Mapping[str, Value]
"""Values that a law stores from one sample to the next, by name."""
Sampled = tuple[Mapping[str, Value], Mapping[str, Value]]
"""The commands of a sample, and the memory of the next one."""


class ControlLaw(Controller):
    """A sampled controller whose `step` is written over `airmuscle.core.ops`, as the laws of
    muscles and valves are.

    Its declared parameters are numbers of the compiled program, its memory has named values. `step`
    is called with floats, arrays or symbols, therefore it chooses by `ops.where` and does not use
    `if` on a measurement. A controller that cannot be written in this way derives from Controller,
    and is called at each sample.
    """

    if TYPE_CHECKING:  # a field of a law that does not define its inputs

        @property
        def commanded(self) -> "Commanded | tuple[Commanded, ...]":
            """The inputs, or pairs of inputs in split range, that the law commands."""

    @property
    def inputs(self) -> tuple[str, ...]:
        return inputs_of(self.commanded)

    irregular: ClassVar[Any] = ""
    """Why the samples of the law have no linearisation that repeats, and what to linearise in its
    place; empty for a law that has one. A property where it depends on the fields.
    """

    @property
    @abc.abstractmethod
    def initial_memory(self) -> Mapping[str, float]:
        """The values that are stored from one sample to the next, by name, with their initial
        values.
        """

    def init(self) -> dict[str, Value]:
        return dict(self.initial_memory)

    @abc.abstractmethod
    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        """The command of every input until the next sample, `dt` [s] later, and the memory for that
        sample.
        """

    def commands_at_rest(
        self, memory: Memory, measurement: Measurement, dt: Value
    ) -> Mapping[str, Value]:
        """The commands, within their ranges, of a sample whose set points are the measured columns:
        those of the working point at which a law starts.
        """
        setpoints = {
            name: measurement.columns.get(name, value)
            for name, value in measurement.setpoints.items()
        }
        commands, _ = self.step(memory, measurement._replace(setpoints=setpoints), dt)
        return {name: ops.clip(commands[name], *measurement.ranges[name]) for name in self.inputs}

    def attained(
        self, measurement: Measurement, commands: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        """The set points to which the commands belong as their ranges limit them, for a law that
        gives the set points.

        Unless a law knows more, the measured column while a command is at the end of its range.
        """
        at_end = 0.0 > 1.0
        for name in self.inputs:
            low, high = measurement.ranges[name]
            at_end = ops.either(at_end, commands[name] >= high)
            if len(self.inputs) == 1:  # of several, such as those in split range, zero is rest
                at_end = ops.either(at_end, commands[name] <= low)
        here = {**measurement.setpoints, **measurement.columns}
        return {
            name: ops.where(at_end, here[name], value)
            for name, value in measurement.setpoints.items()
        }


def named_in(*fields: str, optional: tuple[str, ...] = ()) -> Any:
    """A property: the names that fields hold, as in `named_in("inverse.coordinate")`; an optional
    one may be empty.
    """

    def names(law: Any) -> tuple[str, ...]:
        further = (getattr(law, field) for field in optional)
        return (*(operator.attrgetter(field)(law) for field in fields), *filter(None, further))

    return property(names, doc=f"The names in {', '.join((*fields, *optional))}.")


class EnclosingLaw(ControlLaw):
    """A control law that changes the measurements, the commands or the numbers of another one, its
    `law`.
    """

    simulated: ClassVar[bool] = False
    """Whether it simulates sensors or a fault of the plant, and is no part of a controller of a
    real plant.
    """

    if TYPE_CHECKING:  # a field of a model, or designed

        @property
        def law(self) -> ControlLaw:
            """The law inside."""

    measured_columns = forwarded("law.measured_columns")
    setpoints = forwarded("law.setpoints")
    inputs = forwarded("law.inputs")
    initial_memory = forwarded("law.initial_memory")
    """That of the law, unless the enclosing law stores further values."""

    def attained(
        self, measurement: Measurement, commands: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        return self.law.attained(measurement, commands)


def rebuilt(part: Any, change: Callable[[Any], Any]) -> Any:
    """A controller with a change of it and of all that is inside it; the same object where nothing
    changes.

    `change` returns a part itself, or another one, which is changed again.
    """
    if (replacement := change(part)) is not part:
        return rebuilt(replacement, change)
    if isinstance(part, tuple):
        items = tuple(rebuilt(item, change) for item in part)
        return part if all(a is b for a, b in zip(items, part, strict=True)) else items
    if not isinstance(part, Controller) or not dataclasses.is_dataclass(part):
        return part
    fields = {
        field.name: getattr(part, field.name) for field in dataclasses.fields(part) if field.init
    }
    changed = {
        name: new for name, old in fields.items() if (new := rebuilt(old, change)) is not old
    }
    return dataclasses.replace(part, **changed) if changed else part


def without_simulated(law: Any) -> Any:
    """A control law without the simulated sensors and faults of the plant, at any depth: that of a
    real plant.
    """
    return rebuilt(
        law, lambda part: part.law if isinstance(part, EnclosingLaw) and part.simulated else part
    )


@model
class SplitRange:
    """Split range: a positive output u goes to one input, -u of a negative one to another, such as
    a fill and a discharge valve; the other input is zero. u is between minus the maximum of the one
    and the maximum of the other.
    """

    positive: str
    negative: str

    def check(self) -> None:
        if self.positive == self.negative:
            raise ParameterError(f"SplitRange: both inputs are '{self.positive}'; name two inputs.")


Commanded = str | SplitRange


def inputs_of(commanded: Commanded | tuple[Commanded, ...]) -> tuple[str, ...]:
    """The commanded inputs."""
    if isinstance(commanded, tuple):
        return tuple(name for part in commanded for name in inputs_of(part))
    return (commanded,) if isinstance(commanded, str) else (commanded.positive, commanded.negative)


def range_of(
    commanded: Commanded, ranges: Mapping[str, tuple[Value, Value]]
) -> tuple[Value, Value]:
    """The range of a controller output, from those of the inputs."""
    if isinstance(commanded, str):
        return ranges[commanded]
    return -ranges[commanded.negative][1], ranges[commanded.positive][1]


def commands(commanded: Commanded, output: Value) -> dict[str, Value]:
    """The values of the inputs for a controller output."""
    if isinstance(commanded, str):
        return {commanded: output}
    return {
        commanded.positive: ops.maximum(output, 0.0),
        commanded.negative: ops.maximum(-output, 0.0),
    }


@model
class SisoController(ControlLaw):
    """A control law that compares one column, `measured`, with its set point; `commanded` is the
    manipulated input.
    """

    measured: str
    commanded: Commanded

    measured_columns = named_in("measured")
    setpoints = named_in("measured")


@model
class SigmaDelta(EnclosingLaw):
    """v_k = s_(k-1) + u_k,   position_k = 1 where v_k >= 1/2, else 0,   s_k = v_k - position_k.

    u command of the inner law for an input, 0 to 1, s sum of what has not been applied, by which
    the mean of the positions follows u: the sums of both differ by at most 1/2 at any time. Unlike
    PWM it has no period; for small u the valve opens seldom. A valve with a dead time needs a
    sample time that is longer than it. Commands below u_min count as 0, which stops single openings
    at rest. Reference: Inose, Yasuda and Murakami (1962).
    """

    references: ClassVar[tuple[Reference, ...]] = (published("inose-1962"),)
    irregular: ClassVar[Any] = (
        "SigmaDelta switches between two positions, so that its commands have no slopes. Linearise"
        " the law inside it, its field 'law', whose commands are the mean of the positions."
    )

    law: ControlLaw
    minimum: float = parameter(
        "1", "u_min", "command below which a valve is closed", bounds=(0.0, 1.0), default=0.0
    )

    @property
    def initial_memory(self) -> dict[str, float]:
        """The sum of each input, `sum.fill`, and the values of the law."""
        sums = dict.fromkeys(self.inputs, 0.0)
        return {**with_prefix("sum.", sums), **with_prefix("law.", self.law.initial_memory)}

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        wanted, law = self.law.step(select_prefix("law.", memory), measurement, dt)
        positions: dict[str, Value] = {}
        sums: dict[str, Value] = {}
        for name, before in select_prefix("sum.", memory).items():
            command = ops.clip(wanted[name], 0.0, 1.0)
            total = before + ops.where(command >= self.minimum, command, 0.0)
            positions[name] = ops.where(total >= 0.5, 1.0, 0.0)
            sums[name] = total - positions[name]
        return positions, {**with_prefix("sum.", sums), **with_prefix("law.", law)}

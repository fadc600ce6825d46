"""Laws composed of laws: cascade, feed-forward beside feedback, decentralised control, scheduled
parameters.
"""

import itertools
from collections.abc import Mapping
from typing import ClassVar

from ...core import (
    Parameter,
    ParameterError,
    Reference,
    Value,
    leaves,
    model,
    ops,
    parameter,
    published,
    unflatten,
)
from ...core.declaration import forwarded
from ...core.errors import check_known
from ...core.system import select_prefix, united, with_prefix
from ...engine.loop import ControlLaw, EnclosingLaw, Measurement, Memory, Sampled, parameter_units
from .pid_and_sliding_mode import ASTROM_HAGGLUND1995


@model
class Cascade(ControlLaw):
    """Cascade control: the outer law commands set points of the inner law, which commands the
    inputs of the plant.

    `Cascade(PID("position", "pressure", ...), PID("pressure", SplitRange("fill", "discharge"),
    ...), (0.0,), (5e5,))` controls the position by the pressure. `minimum` and `maximum` are the
    ranges of the outer commands, in the order of `outer.inputs` and in SI units; the outer law sees
    them as the ranges of its inputs, so that it does not wind up. By `tracking` the saturation
    of the inner law reaches the outer one, too: while the inner law cannot attain its set point,
    because a command is at the end of its range, the outer law goes on as if it had commanded what
    is attained, so that its anti-windup acts, or its observer predicts with it. Both laws are
    sampled at the same instants, the outer one first. Reference: Åström and Hägglund (1995),
    chapter 7.
    """

    references: ClassVar[tuple[Reference, ...]] = (ASTROM_HAGGLUND1995,)

    outer: ControlLaw
    inner: ControlLaw
    minimum: tuple[float, ...] = parameter(
        "SI", "r_min", "minima of the outer commands", fitted=False
    )
    maximum: tuple[float, ...] = parameter(
        "SI", "r_max", "maxima of the outer commands", fitted=False
    )
    tracking: bool = True

    def check(self) -> None:
        commanded = self.outer.inputs
        what = "Cascade: the inner law has no set point for the outer command"
        check_known(what, commanded, self.inner.setpoints, "its set points are")
        if not len(self.minimum) == len(self.maximum) == len(commanded):
            raise ParameterError(
                f"Cascade: {len(self.minimum)} minima and {len(self.maximum)} maxima for"
                f" {len(commanded)} outer commands ({', '.join(commanded)}); give one for each."
            )
        for name, low, high in zip(commanded, self.minimum, self.maximum, strict=True):
            if low >= high:
                raise ParameterError(
                    f"Cascade: '{name}' has minimum {low:g}; it must be below its maximum {high:g}."
                )

    def unit_of(self, declared: Parameter, index: int, units: Mapping[str, str]) -> str:
        """The unit of a limit: that of the outer command with the same index."""
        names = self.outer.inputs
        return units[names[index]] or "1" if index < len(names) else "1"

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return united(self.outer.measured_columns, self.inner.measured_columns)

    @property
    def setpoints(self) -> tuple[str, ...]:
        own = tuple(name for name in self.inner.setpoints if name not in self.outer.inputs)
        return united(self.outer.setpoints, own)

    inputs = forwarded("inner.inputs")

    @property
    def initial_memory(self) -> dict[str, float]:
        """The values of both laws, with the prefixes `outer.` and `inner.`."""
        return {
            **with_prefix("outer.", self.outer.initial_memory),
            **with_prefix("inner.", self.inner.initial_memory),
        }

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        limits = zip(self.outer.inputs, self.minimum, self.maximum, strict=True)
        ranges = {name: (low, high) for name, low, high in limits}
        wanted, first = self.outer.step(
            select_prefix("outer.", memory), measurement._replace(ranges=ranges), dt
        )
        setpoints = {
            **measurement.setpoints,
            **{n: ops.clip(wanted[n], *ranges[n]) for n in self.outer.inputs},
        }
        seen = measurement._replace(setpoints=setpoints)
        commands, second = self.inner.step(select_prefix("inner.", memory), seen, dt)
        if self.tracking:
            reached = self.inner.attained(seen, commands)
            only = {name: (reached[name], reached[name]) for name in ranges}
            _, tracked = self.outer.step(
                select_prefix("outer.", memory), measurement._replace(ranges=only), dt
            )
            missed = sum(
                (ops.absolute_value(reached[name] - setpoints[name]) for name in ranges), 0.0
            )
            first = {
                name: ops.where(missed > 0.0, tracked[name], value) for name, value in first.items()
            }
        return dict(commands), {**with_prefix("outer.", first), **with_prefix("inner.", second)}


@model
class WithFeedForward(ControlLaw):
    """u = u_ff + u_fb: each input receives the sum of the commands of two control laws.

    The feedback law sees the range of each input less the feed-forward command, so that its
    anti-windup is that of the sum. It commands no input that the feed-forward law does not command.
    The initial output of a PID remains 0: the first command is that of the feed-forward. Reference:
    Åström and Hägglund (1995), chapter 7.
    """

    references: ClassVar[tuple[Reference, ...]] = (ASTROM_HAGGLUND1995,)

    feed_forward: ControlLaw
    feedback: ControlLaw

    def check(self) -> None:
        what = "WithFeedForward: the feed-forward law does not command the input of the feedback"
        check_known(what, self.feedback.inputs, self.feed_forward.inputs, "it commands")

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return united(self.feedback.measured_columns, self.feed_forward.measured_columns)

    @property
    def setpoints(self) -> tuple[str, ...]:
        return united(self.feedback.setpoints, self.feed_forward.setpoints)

    inputs = forwarded("feed_forward.inputs")

    @property
    def initial_memory(self) -> dict[str, float]:
        """The values of both laws, with the prefixes `feed_forward.` and `feedback.`."""
        first = self.feed_forward.initial_memory
        second = self.feedback.initial_memory
        return {**with_prefix("feed_forward.", first), **with_prefix("feedback.", second)}

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        ahead, first = self.feed_forward.step(
            select_prefix("feed_forward.", memory), measurement, dt
        )
        known = {name: measurement.ranges[name] for name in self.feedback.inputs}
        ranges = {
            name: (low - ahead[name], high - ahead[name]) for name, (low, high) in known.items()
        }
        back, second = self.feedback.step(
            select_prefix("feedback.", memory), measurement._replace(ranges=ranges), dt
        )
        commands = {
            name: value + back[name] if name in back else value for name, value in ahead.items()
        }
        return commands, {**with_prefix("feed_forward.", first), **with_prefix("feedback.", second)}


@model
class Decentralised(ControlLaw):
    """Decentralised control: independent control laws, such as one pressure controller for each
    muscle of a joint.

    No input may be commanded by two laws.
    Reference: Skogestad and Postlethwaite (2005), chapter 10.
    """

    references: ClassVar[tuple[Reference, ...]] = (published("skogestad-postlethwaite-2005"),)

    laws: tuple[ControlLaw, ...]

    def check(self) -> None:
        if not self.laws:
            raise ParameterError("Decentralised: there is no law; give at least one.")
        named = [name for law in self.laws for name in law.inputs]
        twice = [name for name in named if named.count(name) > 1]
        if twice:
            raise ParameterError(
                f"Decentralised: '{twice[0]}' is commanded by two laws; give each input to one law."
            )

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return united(*(law.measured_columns for law in self.laws))

    @property
    def setpoints(self) -> tuple[str, ...]:
        return united(*(law.setpoints for law in self.laws))

    @property
    def inputs(self) -> tuple[str, ...]:
        return united(*(law.inputs for law in self.laws))

    @property
    def initial_memory(self) -> dict[str, float]:
        """The values of all laws, with the prefixes `0.`, `1.`, ..."""
        return {
            f"{i}.{name}": value
            for i, law in enumerate(self.laws)
            for name, value in law.initial_memory.items()
        }

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        commands: dict[str, Value] = {}
        later: dict[str, Value] = {}
        for i, law in enumerate(self.laws):
            own, kept = law.step(select_prefix(f"{i}.", memory), measurement, dt)
            commands |= own
            later |= with_prefix(f"{i}.", kept)
        return commands, later


@model
class GainSchedule(EnclosingLaw):
    """theta(z) = theta_i + (theta_(i+1) - theta_i) (z - z_i)/(z_(i+1) - z_i) for z_i <= z <=
    z_(i+1), constant beyond.

    theta parameter of the law, by its path (`gain`, `outer.gain`), z scheduling variable: a
    measured column. Both lists are in SI units, z rising. The integral of a PID holds its
    integrated gain, so that a change of the gain does not make the command jump by it. Several
    parameters are scheduled by one schedule within another. Reference: Rugh and Shamma (2000).
    """

    references: ClassVar[tuple[Reference, ...]] = (published("rugh-shamma-2000"),)

    law: ControlLaw
    scheduled: str
    scheduling_column: str
    breakpoints: tuple[float, ...] = parameter(
        "SI", "z_i", "values of the scheduling variable", fitted=False
    )
    scheduled_values: tuple[float, ...] = parameter(
        "SI", "theta_i", "values of the parameter at the breakpoints"
    )

    def check(self) -> None:
        if not len(self.breakpoints) == len(self.scheduled_values) >= 2:
            raise ParameterError(
                f"GainSchedule: {len(self.breakpoints)} breakpoints and"
                f" {len(self.scheduled_values)} values; give at least two breakpoints and one value"
                " for each."
            )
        if any(b <= a for a, b in itertools.pairwise(self.breakpoints)):
            raise ParameterError(f"GainSchedule: the breakpoints {self.breakpoints} must rise.")
        known = {leaf.path: leaf for leaf in leaves(self.law)}
        check_known(
            f"GainSchedule: {type(self.law).__name__} has no parameter", self.scheduled, known
        )
        low, high = known[self.scheduled].declared.bounds
        for value in self.scheduled_values:
            if not low <= value <= high:
                raise ParameterError(
                    f"GainSchedule: a value of {self.scheduled} is {value:g}; allowed range:"
                    f" {low:g} to {high:g}."
                )

    def unit_of(self, declared: Parameter, index: int, units: Mapping[str, str]) -> str:
        """The unit of a breakpoint is that of the scheduling column, of a value that of the
        scheduled parameter.
        """
        if declared.name == "breakpoints":
            return units[self.scheduling_column] or "1"
        return parameter_units(self.law, units).get(self.scheduled, "1")

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return united(self.law.measured_columns, (self.scheduling_column,))

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        value = interpolated(
            measurement.columns[self.scheduling_column], self.breakpoints, self.scheduled_values
        )
        numbers = [
            value if leaf.path == self.scheduled else leaf.value for leaf in leaves(self.law)
        ]
        return unflatten(self.law, numbers).step(memory, measurement, dt)


def interpolated(x: Value, points: tuple[Value, ...], values: tuple[Value, ...]) -> Value:
    """Piecewise linear function through values at rising points, constant beyond the first and the
    last.
    """
    result = values[0]
    for (a, b), (c, d) in zip(itertools.pairwise(points), itertools.pairwise(values), strict=True):
        result = result + (d - c) * ops.clip((x - a) / (b - a), 0.0, 1.0)
    return result

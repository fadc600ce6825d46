"""Laws of several pressures: co-contraction of two muscles, proportional feedback, decentralised control."""

from collections.abc import Mapping
from typing import ClassVar

from ...core import ParameterError, Reference, Value, model, ops, parameter, published
from ...core.declaration import forwarded
from ...core.system import select_prefix, united, with_prefix
from ...engine.loop import Commanded, ControlLaw, Measurement, Memory, Sampled, commands, range_of
from ...physics.muscle.characteristic.tondu_lopez2000 import TONDU_LOPEZ_2000
from .open_loop import OpenLoopLaw, check_pair
from .single_column import ASTROM_HAGGLUND1995

DIFFERENCE = "difference"
"""Name of the set point that an outer controller commands: half the difference of both pressures [Pa]."""


@model
class CoContraction(OpenLoopLaw):
    """p_1 = p_0 + d,   p_2 = p_0 - d.

    d half the pressure difference, which turns the joint: the set point `difference`; p_0 mean pressure, which stiffens
    it: the set point that `mean_setpoint` names, else the parameter `mean`. In a `Cascade` an outer controller of the
    angle commands d, and the two pressures are the set points of regulators or of inner pressure controllers. Neither
    needs a model of the muscles.
    Reference: Tondu and Lopez (2000).
    """

    references: ClassVar[tuple[Reference, ...]] = (TONDU_LOPEZ_2000,)

    commanded: tuple[str, ...]
    mean: float = parameter("Pa", "p_0", "mean gauge pressure where it is no set point", bounds=(0.0, 1e7), default=0.0)
    mean_setpoint: str = ""

    def check(self) -> None:
        check_pair(self, self.commanded)

    @property
    def setpoints(self) -> tuple[str, ...]:
        return (DIFFERENCE, *((self.mean_setpoint,) if self.mean_setpoint else ()))

    @property
    def signal_units(self) -> dict[str, str]:
        return {DIFFERENCE: "Pa", **({self.mean_setpoint: "Pa"} if self.mean_setpoint else {})}

    def command(self, setpoints: Mapping[str, Value]) -> dict[str, Value]:
        mean = setpoints[self.mean_setpoint] if self.mean_setpoint else self.mean
        first, second = self.commanded
        return {first: mean + setpoints[DIFFERENCE], second: mean - setpoints[DIFFERENCE]}

    def attained(self, measurement: Measurement, commands: Mapping[str, Value]) -> dict[str, Value]:
        first, second = (ops.clip(commands[n], *measurement.ranges[n]) - commands[n] for n in self.commanded)
        return {**measurement.setpoints, DIFFERENCE: measurement.setpoints[DIFFERENCE] + 0.5 * (first - second)}


@model
class ProportionalFeedback(ControlLaw):
    """u_i = K (r_i - y_i), and u_i = 0 where |r_i - y_i| < z, for every controlled column.

    Inner pressure controller of several equal muscles: a muscle with valves integrates the flow, so that proportional
    action leaves no error at rest, and a common gain K is one parameter for tuning. z half width of a dead zone, which
    keeps on/off valves closed at rest. `commanded` has one input or split range for each column.
    Reference: Åström and Hägglund (1995), chapter 3.
    """

    references: ClassVar[tuple[Reference, ...]] = (ASTROM_HAGGLUND1995,)

    controlled: tuple[str, ...]
    commanded: tuple[Commanded, ...]
    gain: float = parameter("u/y", "K", "gain of all columns", bounds=(0.0, 1e6))
    zone: float = parameter("y", "z", "half width of the dead zone", bounds=(0.0, 1e9), default=0.0)

    initial_memory: ClassVar[Mapping[str, float]] = {}

    def check(self) -> None:
        if not len(self.controlled) == len(self.commanded) >= 1:
            raise ParameterError(
                f"ProportionalFeedback: {len(self.controlled)} columns and {len(self.commanded)} commanded inputs; "
                "give one input, or one SplitRange, for each column."
            )

    measured_columns = forwarded("controlled")
    setpoints = forwarded("controlled")

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        result: dict[str, Value] = {}
        for name, commanded in zip(self.controlled, self.commanded, strict=True):
            error = measurement.setpoints[name] - measurement.columns[name]
            low, high = range_of(commanded, measurement.ranges)
            wanted = ops.where(ops.absolute_value(error) < self.zone, 0.0, self.gain * error)
            result |= commands(commanded, ops.clip(wanted, low, high))
        return result, {}

    def attained(self, measurement: Measurement, commands: Mapping[str, Value]) -> dict[str, Value]:
        """The set points with which the commands just reach the ends of their ranges, where they are beyond."""
        result, gain = dict(measurement.setpoints), ops.maximum(self.gain, 1e-30)
        for name, commanded in zip(self.controlled, self.commanded, strict=True):
            y, (low, high) = measurement.columns[name], range_of(commanded, measurement.ranges)
            result[name] = ops.clip(result[name], y + low / gain, y + high / gain)
        return result


@model
class Decentralised(ControlLaw):
    """Decentralised control: independent control laws, such as one pressure controller for each muscle of a joint.

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
            raise ParameterError(f"Decentralised: '{twice[0]}' is commanded by two laws; give each input to one law.")

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
        return {f"{i}.{name}": value for i, law in enumerate(self.laws) for name, value in law.initial_memory.items()}

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        commands: dict[str, Value] = {}
        later: dict[str, Value] = {}
        for i, law in enumerate(self.laws):
            own, kept = law.step(select_prefix(f"{i}.", memory), measurement, dt)
            commands |= own
            later |= with_prefix(f"{i}.", kept)
        return commands, later

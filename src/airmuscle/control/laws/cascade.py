"""Cascade: an outer control law whose commands are set points of an inner one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...core import ops
from ...core.declaration import Parameter, model, parameter
from ...core.errors import ParameterError
from ...core.ops import Value
from ...core.reference import Reference
from ...core.system import select_prefix, united, with_prefix
from ...engine.loop.control_law import ControlLaw
from ...engine.loop.controller import Measurement
from .pid import ASTROM_HAGGLUND1995


@model
class Cascade(ControlLaw):
    """Cascade control: the outer law commands set points of the inner law, which commands the inputs of the plant.

    `Cascade(PID("position", "pressure", ...), PID("pressure", SplitRange("fill", "discharge"), ...), (0.0,), (5e5,))`
    controls the position by the pressure. `minimum` and `maximum` are the ranges of the outer commands, in the order
    of `outer.inputs` and in SI units; the outer law sees them as the ranges of its inputs, so that it does not wind up.
    Both laws are sampled at the same instants, the outer one first.
    Reference: Åström and Hägglund (1995), chapter 7.
    """

    references: ClassVar[tuple[Reference, ...]] = (ASTROM_HAGGLUND1995,)

    outer: ControlLaw
    inner: ControlLaw
    minimum: tuple[float, ...] = parameter("SI", "r_min", "minima of the outer commands", fitted=False)
    maximum: tuple[float, ...] = parameter("SI", "r_max", "maxima of the outer commands", fitted=False)

    def check(self) -> None:
        commanded = self.outer.inputs
        unknown = [name for name in commanded if name not in self.inner.setpoints]
        if unknown:
            raise ParameterError(
                f"Cascade: the outer law commands '{unknown[0]}', which is no set point of the inner law; these are "
                f"{', '.join(self.inner.setpoints)}."
            )
        if not len(self.minimum) == len(self.maximum) == len(commanded):
            raise ParameterError(
                f"Cascade: {len(self.minimum)} minima and {len(self.maximum)} maxima for {len(commanded)} outer "
                f"commands ({', '.join(commanded)}); give one for each."
            )
        for name, low, high in zip(commanded, self.minimum, self.maximum, strict=True):
            if low >= high:
                raise ParameterError(
                    f"Cascade: '{name}' has minimum {low:g}; allowed range: below its maximum {high:g}."
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

    @property
    def inputs(self) -> tuple[str, ...]:
        return self.inner.inputs

    @property
    def initial_memory(self) -> dict[str, float]:
        """The values of both laws, with the prefixes `outer.` and `inner.`."""
        return {**with_prefix("outer.", self.outer.initial_memory), **with_prefix("inner.", self.inner.initial_memory)}

    def step(
        self, memory: Mapping[str, Value], measurement: Measurement, dt: Value
    ) -> tuple[dict[str, Value], dict[str, Value]]:
        limits = zip(self.outer.inputs, self.minimum, self.maximum, strict=True)
        ranges = {name: (low, high) for name, low, high in limits}
        wanted, first = self.outer.step(select_prefix("outer.", memory), measurement._replace(ranges=ranges), dt)
        setpoints = {**measurement.setpoints, **{n: ops.clip(wanted[n], *ranges[n]) for n in self.outer.inputs}}
        commands, second = self.inner.step(
            select_prefix("inner.", memory), measurement._replace(setpoints=setpoints), dt
        )
        return dict(commands), {**with_prefix("outer.", first), **with_prefix("inner.", second)}

"""GainSchedule: a control law with one parameter as a piecewise linear function of a measured column."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import ClassVar

from ...core import ops
from ...core.declaration import Parameter, model, parameter
from ...core.errors import ParameterError
from ...core.ops import Value
from ...core.reference import Reference
from ...core.system import united
from ...core.tree import leaves, unflatten
from ...engine.loop.control_law import ControlLaw, EnclosingLaw
from ...engine.loop.controller import Measurement, parameter_units

RUGH_SHAMMA2000 = Reference(
    key="rugh-shamma-2000",
    authors="Rugh, W. J., Shamma, J. S.",
    title="Research on gain scheduling",
    where="Automatica 36(10):1401-1425",
    year=2000,
    doi="10.1016/S0005-1098(00)00058-3",
    note="gains interpolated between operating points",
)


@model
class GainSchedule(EnclosingLaw):
    """theta(z) = theta_i + (theta_(i+1) - theta_i) (z - z_i)/(z_(i+1) - z_i) for z_i <= z <= z_(i+1), constant beyond.

    theta parameter of the law, by its path (`gain`, `outer.gain`), z scheduling variable: a measured column. Both
    lists are in SI units, z rising. The integral of a PID holds its integrated gain, so that a change of the gain does
    not make the command jump by it. Several parameters are scheduled by one schedule within another.
    Reference: Rugh and Shamma (2000).
    """

    references: ClassVar[tuple[Reference, ...]] = (RUGH_SHAMMA2000,)

    law: ControlLaw
    scheduled: str
    scheduling_column: str
    breakpoints: tuple[float, ...] = parameter("SI", "z_i", "values of the scheduling variable", fitted=False)
    scheduled_values: tuple[float, ...] = parameter("SI", "theta_i", "values of the parameter at the breakpoints")

    def check(self) -> None:
        if not len(self.breakpoints) == len(self.scheduled_values) >= 2:
            raise ParameterError(
                f"GainSchedule: {len(self.breakpoints)} breakpoints and {len(self.scheduled_values)} values; give at "
                "least two breakpoints and one value for each."
            )
        if any(b <= a for a, b in itertools.pairwise(self.breakpoints)):
            raise ParameterError(f"GainSchedule: the breakpoints {self.breakpoints} must rise.")
        known = {leaf.path: leaf for leaf in leaves(self.law)}
        if self.scheduled not in known:
            raise ParameterError(
                f"GainSchedule: {type(self.law).__name__} has no parameter '{self.scheduled}'; there are "
                f"{', '.join(known)}."
            )
        low, high = known[self.scheduled].declared.bounds
        for value in self.scheduled_values:
            if not low <= value <= high:
                raise ParameterError(
                    f"GainSchedule: a value of {self.scheduled} is {value:g}; allowed range: {low:g} to {high:g}."
                )

    def unit_of(self, declared: Parameter, index: int, units: Mapping[str, str]) -> str:
        """The unit of a breakpoint is that of the scheduling column, of a value that of the scheduled parameter."""
        if declared.name == "breakpoints":
            return units[self.scheduling_column] or "1"
        return parameter_units(self.law, units).get(self.scheduled, "1")

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return united(self.law.measured_columns, (self.scheduling_column,))

    def step(
        self, memory: Mapping[str, Value], measurement: Measurement, dt: Value
    ) -> tuple[Mapping[str, Value], Mapping[str, Value]]:
        value = interpolated(measurement.columns[self.scheduling_column], self.breakpoints, self.scheduled_values)
        numbers = [value if leaf.path == self.scheduled else leaf.value for leaf in leaves(self.law)]
        return unflatten(self.law, numbers).step(memory, measurement, dt)


def interpolated(x: Value, points: tuple[Value, ...], values: tuple[Value, ...]) -> Value:
    """Piecewise linear function through values at rising points, constant beyond the first and the last."""
    result = values[0]
    for (a, b), (c, d) in zip(itertools.pairwise(points), itertools.pairwise(values), strict=True):
        result = result + (d - c) * ops.clip((x - a) / (b - a), 0.0, 1.0)
    return result

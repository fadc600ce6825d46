"""SuperTwisting: second-order sliding mode control with a continuous command."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...core import ops
from ...core.declaration import model, parameter
from ...core.ops import Value
from ...core.reference import Reference
from ...engine.loop.control_law import Commanded, SisoController, commands, range_of
from ...engine.loop.controller import Measurement
from .sliding_variable import sliding_memory, sliding_variable

LEVANT1993 = Reference(
    key="levant-1993",
    authors="Levant, A.",
    title="Sliding order and sliding accuracy in sliding mode control",
    where="International Journal of Control 58(6):1247-1263",
    year=1993,
    doi="10.1080/00207179308923053",
    note="super-twisting algorithm",
)


@model
class SuperTwisting(SisoController):
    """u = k_1 sqrt|s| sign(s) + w,   w' = k_2 sign(s),   s = e + T_s e',   e = r - y.

    The integral w reconstructs a disturbance with bounded rate; for s' = d(t) - u with |d'| < k_2 and k_1 large enough
    s reaches 0 in finite time, and the command is continuous. By forward differences with sample time h, s remains
    within a band that shrinks with h^2. w is limited to the range of the command and starts at u_0. e' is a backward
    difference with a first-order filter of time constant T_f.
    Reference: Levant (1993).
    """

    references: ClassVar[tuple[Reference, ...]] = (LEVANT1993,)

    measured: str
    commanded: Commanded
    proportional: float = parameter("u/y^0.5", "k_1", "gain of the square root, in SI units", bounds=(0.0, 1e12))
    integral: float = parameter("u/s", "k_2", "rate of the integral", bounds=(0.0, 1e12))
    sliding_time: float = parameter("s", "T_s", "time constant of the error on s = 0", bounds=(0.0, 1e3), default=0.0)
    filter_time: float = parameter("s", "T_f", "time constant of the derivative", bounds=(0.0, 1e3), default=0.0)
    initial_output: float = parameter("u", "u_0", "initial integral", default=0.0)

    @property
    def initial_memory(self) -> dict[str, float]:
        """Whether it has started (0 or 1), the last error, its filtered derivative, and the integral w [u]."""
        return {**sliding_memory(), "integral": 0.0}

    def step(
        self, memory: Mapping[str, Value], measurement: Measurement, dt: Value
    ) -> tuple[dict[str, Value], dict[str, Value]]:
        error = measurement.setpoints[self.measured] - measurement.columns[self.measured]
        s, later = sliding_variable(memory, error, self.sliding_time, self.filter_time, dt)
        sign = ops.where(s > 0.0, 1.0, ops.where(s < 0.0, -1.0, 0.0))
        integral = ops.where(memory["started"] > 0, memory["integral"], self.initial_output)
        low, high = range_of(self.commanded, measurement.ranges)
        wanted = self.proportional * ops.sqrt(ops.absolute_value(s)) * sign + integral
        later["integral"] = ops.clip(integral + dt * self.integral * sign, low, high)
        return commands(self.commanded, ops.clip(wanted, low, high)), later

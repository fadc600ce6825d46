"""WithFilter: a law that receives a measured column through a notch or lead-lag filter."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

from ...core import ops
from ...core.declaration import model, parameter
from ...core.errors import ParameterError
from ...core.ops import Value
from ...core.reference import Reference
from ...core.system import select_prefix, with_prefix
from ...engine.loop.control_law import ControlLaw, EnclosingLaw
from ...engine.loop.controller import Measurement
from .state_feedback import FRANKLIN1998


@model
class WithFilter(EnclosingLaw):
    """y_f = F(s) y,  F = (b_2 s^2 + b_1 s + 1)/(a_2 s^2 + a_1 s + 1): the law receives y_f for a measured column y.

    b `numerator` (b_1, b_2) and a `denominator` (a_1, a_2) in [s] and [s^2]. F is made discrete by Tustin's rule,
    s = k (z - 1)/(z + 1), with k = 2/h, or so that F is exact at the frequency f_0 [Hz] if that is not 0. It starts in
    the steady state of the first value. `notch` and `lead_lag` are the usual filters.
    Reference: Franklin, Powell and Workman (1998), chapter 6.
    """

    references: ClassVar[tuple[Reference, ...]] = (FRANKLIN1998,)

    law: ControlLaw
    column: str
    numerator: tuple[float, ...] = parameter("SI", "b", "coefficients of s and s^2 above the line", fitted=False)
    denominator: tuple[float, ...] = parameter("SI", "a", "coefficients of s and s^2 below the line", fitted=False)
    exact_frequency: float = parameter(
        "Hz", "f_0", "frequency at which the filter is exact; 0: none", bounds=(0.0, 1e6), fitted=False, default=0.0
    )

    @classmethod
    def notch(
        cls, law: ControlLaw, column: str, frequency: float, *, depth: float = 0.1, damping: float = 0.5
    ) -> WithFilter:
        """A notch at a frequency [Hz], with the gain `depth` there and the damping ratio of its poles [1]."""
        omega = 2.0 * math.pi * frequency
        poles = (2.0 * damping / omega, 1.0 / omega**2)
        return cls(law, column, (depth * poles[0], poles[1]), poles, frequency)

    @classmethod
    def lead_lag(cls, law: ControlLaw, column: str, lead_time: float, lag_time: float) -> WithFilter:
        """(T_1 s + 1)/(T_2 s + 1) with the lead time T_1 and the lag time T_2 [s]."""
        return cls(law, column, (lead_time, 0.0), (lag_time, 0.0))

    def check(self) -> None:
        if self.column not in self.law.measured_columns:
            raise ParameterError(
                f"WithFilter: the law does not measure '{self.column}'; it measures "
                f"{', '.join(self.law.measured_columns) or 'nothing'}."
            )
        if len(self.numerator) != 2 or len(self.denominator) != 2 or min(self.denominator) < 0:
            raise ParameterError(
                f"WithFilter: numerator {self.numerator} and denominator {self.denominator}; give two coefficients "
                "each, of s and s^2, those of the denominator from 0 on."
            )

    @property
    def initial_memory(self) -> dict[str, float]:
        """Whether it has started, two values of the filter, and the values of the law."""
        own = {"started": 0.0, "first": 0.0, "second": 0.0}
        return {**own, **with_prefix("law.", dict(self.law.initial_memory))}

    def step(
        self, memory: Mapping[str, Value], measurement: Measurement, dt: Value
    ) -> tuple[Mapping[str, Value], dict[str, Value]]:
        x, f = measurement.columns[self.column], self.exact_frequency
        angle = ops.pi * ops.where(f > 0.0, f, 1.0) * dt
        k = ops.where(f > 0.0, 2.0 * ops.pi * f * ops.cos(angle) / ops.sin(angle), 2.0 / dt)
        (b0, b1, b2), (a0, a1, a2) = (_tustin(each, k) for each in (self.numerator, self.denominator))
        started = memory["started"] > 0
        second = ops.where(started, memory["second"], (b2 - a2) * x)
        first = ops.where(started, memory["first"], (b1 - a1 + b2 - a2) * x)
        y = (b0 * x + first) / a0
        columns = {**measurement.columns, self.column: y}
        commands, law = self.law.step(select_prefix("law.", memory), measurement._replace(columns=columns), dt)
        own = {"started": 1.0, "first": b1 * x - a1 * y + second, "second": b2 * x - a2 * y}
        return commands, {**own, **with_prefix("law.", law)}


def _tustin(coefficients: tuple[Value, ...], k: Value) -> tuple[Value, Value, Value]:
    """Coefficients of 1, z^-1 and z^-2 of c_2 s^2 + c_1 s + 1, times (1 + z^-1)^2."""
    first, second = coefficients[0] * k, coefficients[1] * k * k
    return second + first + 1.0, 2.0 - 2.0 * second, second - first + 1.0

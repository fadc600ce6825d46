"""PID controller in standard form: derivative filter, set-point weights, anti-windup, bumpless start."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import ClassVar

from ...core import ops
from ...core.declaration import model, parameter
from ...core.ops import Value
from ...core.reference import Reference
from ...engine.loop.control_law import Commanded, SisoController, commands, range_of
from ...engine.loop.controller import Measurement

ASTROM_HAGGLUND1995 = Reference(
    key="astrom-hagglund-1995",
    authors="Åström, K. J., Hägglund, T.",
    title="PID Controllers: Theory, Design, and Tuning",
    where="2nd edition, Instrument Society of America, Research Triangle Park, chapter 3",
    year=1995,
    note="standard form, filter of the derivative, weights of the set point, back-calculation, differences in time",
)


@model
class PID(SisoController):
    """u = K (b r - y) + I + D,   I' = K/T_i (r - y),   (T_d/N) D' + D = K T_d (c r - y)',   standard (ISA) form.

    r set point and y measurement, in the unit of the measured column; u command, in that of the commanded input. At
    the samples t_k, h apart, I goes by forward and D by backward differences, e = r - y:

        D_k     = T_d/(T_d + N h) D_(k-1) + K T_d N/(T_d + N h) ((c r - y)_k - (c r - y)_(k-1))
        v_k     = K (b r_k - y_k) + I_k + D_k,      u_k = v_k limited to the range of the input
        I_(k+1) = I_k + K h/T_i e_k + min(h/T_t, 1) (u_k - v_k)

    The last term is anti-windup by back-calculation: while u is limited, I follows with the time constant T_t. Where
    T_t is 0 it is sqrt(T_i T_d), or T_i without derivative action. The start is bumpless: I_0 is chosen so that the
    first command is u_0, and D_0 = 0. Without integral action (T_i = 0) u_0 is a constant bias. A negative gain is
    for an input that lowers the measured column.
    Reference: Åström and Hägglund (1995), chapter 3.
    """

    references: ClassVar[tuple[Reference, ...]] = (ASTROM_HAGGLUND1995,)

    measured: str
    commanded: Commanded
    gain: float = parameter("u/y", "K", "proportional gain")
    integral_time: float = parameter("s", "T_i", "integral time; 0: no integral", bounds=(0.0, 1e6), default=0.0)
    derivative_time: float = parameter("s", "T_d", "derivative time; 0: no derivative", bounds=(0.0, 1e6), default=0.0)
    derivative_filter: float = parameter(
        "1", "N", "maximum gain of the derivative, in K", bounds=(1.0, 1e3), default=10.0
    )
    setpoint_weight: float = parameter(
        "1", "b", "set-point weight of the proportional part", bounds=(0.0, 1.0), default=1.0
    )
    derivative_weight: float = parameter("1", "c", "set-point weight of the derivative", bounds=(0.0, 1.0), default=0.0)
    tracking_time: float = parameter(
        "s", "T_t", "tracking time of the anti-windup; 0: by the rule", bounds=(0.0, 1e6), default=0.0
    )
    initial_output: float = parameter("u", "u_0", "first command; without integral action the bias", default=0.0)

    @property
    def initial_memory(self) -> dict[str, float]:
        """Whether it has started (0 or 1), I and D [u], and c r - y of the last sample [y]."""
        return {"started": 0.0, "integral": 0.0, "derivative": 0.0, "weighted_error": 0.0}

    def step(
        self, memory: Mapping[str, Value], measurement: Measurement, dt: Value
    ) -> tuple[dict[str, Value], dict[str, Value]]:
        setpoint, measured = measurement.setpoints[self.measured], measurement.columns[self.measured]
        proportional = self.gain * (self.setpoint_weight * setpoint - measured)
        weighted = self.derivative_weight * setpoint - measured
        started, (integrates, integral_time, tracking) = memory["started"] > 0, self._integration
        filtered = self.derivative_time + self.derivative_filter * dt
        increment = self.gain * self.derivative_filter * (weighted - memory["weighted_error"])
        derivative = self.derivative_time / filtered * (memory["derivative"] + increment)
        derivative = ops.where(started, derivative, 0.0)
        first = self.initial_output - ops.where(integrates, proportional, 0.0)
        integral = ops.where(started, memory["integral"], first)
        wanted = proportional + integral + derivative
        minimum, maximum = range_of(self.commanded, measurement.ranges)
        limited = ops.clip(wanted, minimum, maximum)
        later = integral + self.gain * dt / integral_time * (setpoint - measured)
        later = later + ops.minimum(dt / tracking, 1.0) * (limited - wanted)
        integral = ops.where(integrates, later, integral)
        values = {"started": 1.0, "integral": integral, "derivative": derivative, "weighted_error": weighted}
        return commands(self.commanded, limited), values

    @functools.cached_property
    def _integration(self) -> tuple[Value, Value, Value]:
        """Whether there is integral action, and its time constant and that of the anti-windup [s]; otherwise 1."""
        integrates = self.integral_time > 0
        return integrates, ops.where(integrates, self.integral_time, 1.0), ops.where(integrates, self._tracking(), 1.0)

    def _tracking(self) -> Value:
        """The time constant [s] of the anti-windup."""
        product = self.integral_time * self.derivative_time
        by_rule = ops.where(product > 0, ops.sqrt(ops.where(product > 0, product, 1.0)), self.integral_time)
        return ops.where(self.tracking_time > 0, self.tracking_time, by_rule)

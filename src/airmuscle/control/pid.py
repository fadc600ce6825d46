"""PID controller in standard form: derivative filter, set-point weights, anti-windup, bumpless start."""

from __future__ import annotations

import functools
import math
from typing import ClassVar, NamedTuple

from ..core.declaration import model, parameter
from ..core.reference import Reference
from .controller import Measurement
from .siso import SisoController
from .split_range import Commanded, commands, range_of

ASTROM_HAGGLUND1995 = Reference(
    key="astrom-hagglund-1995",
    authors="Åström, K. J., Hägglund, T.",
    title="PID Controllers: Theory, Design, and Tuning",
    where="2nd edition, Instrument Society of America, Research Triangle Park, chapter 3",
    year=1995,
    note="standard form, filter of the derivative, weights of the set point, back-calculation, differences in time",
)


class PIDMemory(NamedTuple):
    """A PID controller between two samples: whether it has started, its integral and derivative parts [u], and the
    weighted error of the derivative at the last sample [y]."""

    started: bool
    integral: float
    derivative: float
    weighted: float


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

    def init(self) -> PIDMemory:
        return PIDMemory(started=False, integral=0.0, derivative=0.0, weighted=0.0)

    def step(self, memory: PIDMemory, measurement: Measurement, dt: float) -> tuple[dict[str, float], PIDMemory]:
        columns, setpoints, ranges = measurement
        setpoint, measured, gain = setpoints[self.measured], columns[self.measured], self.gain
        proportional = gain * (self.setpoint_weight * setpoint - measured)
        weighted = self.derivative_weight * setpoint - measured
        if memory.started:
            integral = memory.integral
            filtered = self.derivative_time + self.derivative_filter * dt
            increment = gain * self.derivative_filter * (weighted - memory.weighted)
            derivative = self.derivative_time / filtered * (memory.derivative + increment)
        else:
            integral = self.initial_output - proportional if self.integral_time > 0 else self.initial_output
            derivative = 0.0
        wanted = proportional + integral + derivative
        minimum, maximum = range_of(self.commanded, ranges)
        limited = minimum if minimum > wanted else maximum if maximum < wanted else wanted
        if self.integral_time > 0:
            integral += gain * dt / self.integral_time * (setpoint - measured)
            integral += min(dt / self._tracking, 1.0) * (limited - wanted)
        return commands(self.commanded, limited), PIDMemory(True, integral, derivative, weighted)

    @functools.cached_property
    def _tracking(self) -> float:
        """The time constant [s] of the anti-windup."""
        return self.tracking_time or math.sqrt(self.integral_time * self.derivative_time) or self.integral_time

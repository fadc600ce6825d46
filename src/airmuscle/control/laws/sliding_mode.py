"""Sliding-mode controllers: boundary layer and super-twisting, with their sliding variable."""

from typing import ClassVar

from ...core import Reference, Value, model, ops, parameter, published
from ...engine.loop import Measurement, Memory, Sampled, SisoController, commands, range_of

SLIDING_MEMORY: Memory = {"started": 0.0, "error": 0.0, "error_rate": 0.0}
"""Whether it has started (0 or 1), the last error and its filtered derivative."""


def sliding_variable(
    memory: Memory, error: Value, sliding_time: Value, filter_time: Value, dt: Value
) -> tuple[Value, dict[str, Value]]:
    """s = e + T_s e' and the memory for the next sample; e' is 0 at the first sample.

    The derivative is filtered by a first-order lag of time constant T_f [s], by backward differences.
    """
    change = (error - memory["error"] + filter_time * memory["error_rate"]) / (filter_time + dt)
    rate = ops.where(memory["started"] > 0, change, 0.0)
    return error + sliding_time * rate, {"started": 1.0, "error": error, "error_rate": rate}


@model
class SlidingMode(SisoController):
    """u = u_0 + K sat(s/phi),   s = e + T_s e',   e = r - y.

    sat(z) = z limited to -1 to 1. Within the boundary layer |s| < phi the law is a PD controller of gain K/phi; outside
    it commands the full K. On s = 0 the error decays with the time constant T_s. e' is a backward difference with a
    first-order filter of time constant T_f. With phi = 0 the law switches at every sample (chattering).
    Reference: Slotine and Sastry (1983).
    """

    references: ClassVar[tuple[Reference, ...]] = (published("slotine-sastry-1983"),)

    amplitude: float = parameter("u", "K", "command outside the boundary layer")
    sliding_time: float = parameter("s", "T_s", "time constant of the error on s = 0", bounds=(0.0, 1e3), default=0.0)
    boundary_layer: float = parameter("y", "phi", "half width of the boundary layer", bounds=(0.0, 1e9), default=0.0)
    filter_time: float = parameter("s", "T_f", "time constant of the derivative", bounds=(0.0, 1e3), default=0.0)
    equivalent_output: float = parameter("u", "u_0", "command on the sliding surface", default=0.0)

    initial_memory: ClassVar[Memory] = SLIDING_MEMORY
    """Whether it has started (0 or 1), the last error [y] and its filtered derivative [y/s]."""

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        error = measurement.setpoints[self.measured] - measurement.columns[self.measured]
        s, later = sliding_variable(memory, error, self.sliding_time, self.filter_time, dt)
        layer = ops.where(self.boundary_layer > 0, self.boundary_layer, 1.0)
        switched = ops.where(s > 0.0, 1.0, ops.where(s < 0.0, -1.0, 0.0))
        saturated = ops.where(self.boundary_layer > 0, ops.clip(s / layer, -1.0, 1.0), switched)
        low, high = range_of(self.commanded, measurement.ranges)
        return commands(self.commanded, ops.clip(self.equivalent_output + self.amplitude * saturated, low, high)), later


@model
class SuperTwisting(SisoController):
    """u = k_1 sqrt|s| sign(s) + w,   w' = k_2 sign(s),   s = e + T_s e',   e = r - y.

    The integral w reconstructs a disturbance with bounded rate; for s' = d(t) - u with |d'| < k_2 and k_1 large enough
    s reaches 0 in finite time, and the command is continuous. By forward differences with sample time h, s remains
    within a band that shrinks with h^2. w starts at u_0 and is held while the command is at the end of its range and s
    drives it further: it never takes up what the range leaves to the sum. e' is a backward difference with a
    first-order filter of time constant T_f.
    Reference: Levant (1993).
    """

    references: ClassVar[tuple[Reference, ...]] = (published("levant-1993"),)

    proportional: float = parameter("u/y^0.5", "k_1", "gain of the square root, in SI units", bounds=(0.0, 1e12))
    integral: float = parameter("u/s", "k_2", "rate of the integral", bounds=(0.0, 1e12))
    sliding_time: float = parameter("s", "T_s", "time constant of the error on s = 0", bounds=(0.0, 1e3), default=0.0)
    filter_time: float = parameter("s", "T_f", "time constant of the derivative", bounds=(0.0, 1e3), default=0.0)
    initial_output: float = parameter("u", "u_0", "initial integral", default=0.0)

    initial_memory: ClassVar[Memory] = {**SLIDING_MEMORY, "integral": 0.0}
    """Whether it has started (0 or 1), the last error, its filtered derivative, and the integral w [u]."""

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        error = measurement.setpoints[self.measured] - measurement.columns[self.measured]
        s, later = sliding_variable(memory, error, self.sliding_time, self.filter_time, dt)
        sign = ops.where(s > 0.0, 1.0, ops.where(s < 0.0, -1.0, 0.0))
        integral = ops.where(memory["started"] > 0, memory["integral"], self.initial_output)
        low, high = range_of(self.commanded, measurement.ranges)
        wanted = self.proportional * ops.sqrt(ops.absolute_value(s)) * sign + integral
        command = ops.clip(wanted, low, high)
        rate = ops.where((wanted - command) * sign > 0.0, 0.0, self.integral * sign)
        later["integral"] = integral + dt * rate
        return commands(self.commanded, command), later

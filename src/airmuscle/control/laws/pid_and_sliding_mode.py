"""Controllers of one column: PID, two-position control, dead zone for two valves, sliding mode,
super-twisting.
"""

import functools
from typing import ClassVar

from ...core import INFINITY, ParameterError, Reference, Value, model, ops, parameter, published
from ...engine.loop import Measurement, Memory, Sampled, SisoController, commands, range_of

SLIDING_MEMORY: Memory = {"started": 0.0, "error": 0.0, "error_rate": 0.0}
"""Whether it has started (0 or 1), the last error and its filtered derivative."""
ASTROM_HAGGLUND1995 = published("astrom-hagglund-1995")


def sliding_variable(
    law: SisoController,
    memory: Memory,
    measurement: Measurement,
    sliding_time: Value,
    filter_time: Value,
    dt: Value,
) -> tuple[Value, dict[str, Value]]:
    """s = e + T_s e', e = r - y, of a law and the memory for the next sample; e' is 0 at the first
    sample.

    The derivative is filtered by a first-order lag of time constant T_f [s], by backward
    differences.
    """
    error = measurement.setpoints[law.measured] - measurement.columns[law.measured]
    change = (error - memory["error"] + filter_time * memory["error_rate"]) / (filter_time + dt)
    rate = ops.where(memory["started"] > 0, change, 0.0)
    return error + sliding_time * rate, {"started": 1.0, "error": error, "error_rate": rate}


@model
class SlidingMode(SisoController):
    """u = u_0 + K sat(s/phi),   s = e + T_s e',   e = r - y.

    sat(z) = z limited to -1 to 1. Within the boundary layer |s| < phi the law is a PD controller of
    gain K/phi; outside it commands the full K. On s = 0 the error decays with the time constant
    T_s. e' is a backward difference with a first-order filter of time constant T_f. With phi = 0
    the law switches at every sample (chattering). Reference: Slotine and Sastry (1983).
    """

    references: ClassVar[tuple[Reference, ...]] = (published("slotine-sastry-1983"),)

    amplitude: float = parameter("u", "K", "command outside the boundary layer")
    sliding_time: float = parameter(
        "s", "T_s", "time constant of the error on s = 0", bounds=(0.0, 1e3), default=0.0
    )
    boundary_layer: float = parameter(
        "y", "phi", "half width of the boundary layer", bounds=(0.0, 1e9), default=0.0
    )
    filter_time: float = parameter(
        "s", "T_f", "time constant of the derivative", bounds=(0.0, 1e3), default=0.0
    )
    equivalent_output: float = parameter("u", "u_0", "command on the sliding surface", default=0.0)

    initial_memory: ClassVar[Memory] = SLIDING_MEMORY
    """Whether it has started (0 or 1), the last error [y] and its filtered derivative [y/s]."""

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        s, later = sliding_variable(
            self, memory, measurement, self.sliding_time, self.filter_time, dt
        )
        layer = ops.where(self.boundary_layer > 0, self.boundary_layer, 1.0)
        switched = ops.where(s > 0.0, 1.0, ops.where(s < 0.0, -1.0, 0.0))
        saturated = ops.where(self.boundary_layer > 0, ops.clip(s / layer, -1.0, 1.0), switched)
        low, high = range_of(self.commanded, measurement.ranges)
        return (
            commands(
                self.commanded,
                ops.clip(self.equivalent_output + self.amplitude * saturated, low, high),
            ),
            later,
        )


@model
class SuperTwisting(SisoController):
    """u = k_1 sqrt|s| sign(s) + w,   w' = k_2 sign(s),   s = e + T_s e',   e = r - y.

    The integral w reconstructs a disturbance with bounded rate; for s' = d(t) - u with |d'| < k_2
    and k_1 large enough s reaches 0 in finite time, and the command is continuous. By forward
    differences with sample time h, s remains within a band that shrinks with h^2. w starts at u_0
    and is held while the command is at the end of its range and s drives it further: it never takes
    up what the range leaves to the sum. e' is a backward difference with a first-order filter of
    time constant T_f. Reference: Levant (1993).
    """

    references: ClassVar[tuple[Reference, ...]] = (published("levant-1993"),)

    proportional: float = parameter(
        "u/y^0.5", "k_1", "gain of the square root, in SI units", bounds=(0.0, 1e12)
    )
    integral: float = parameter("u/s", "k_2", "rate of the integral", bounds=(0.0, 1e12))
    sliding_time: float = parameter(
        "s", "T_s", "time constant of the error on s = 0", bounds=(0.0, 1e3), default=0.0
    )
    filter_time: float = parameter(
        "s", "T_f", "time constant of the derivative", bounds=(0.0, 1e3), default=0.0
    )
    initial_output: float = parameter("u", "u_0", "initial integral", default=0.0)

    initial_memory: ClassVar[Memory] = {**SLIDING_MEMORY, "integral": 0.0}
    """Whether it has started (0 or 1), the last error, its filtered derivative, and the integral w
    [u].
    """

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        s, later = sliding_variable(
            self, memory, measurement, self.sliding_time, self.filter_time, dt
        )
        sign = ops.where(s > 0.0, 1.0, ops.where(s < 0.0, -1.0, 0.0))
        integral = ops.where(memory["started"] > 0, memory["integral"], self.initial_output)
        low, high = range_of(self.commanded, measurement.ranges)
        wanted = self.proportional * ops.sqrt(ops.absolute_value(s)) * sign + integral
        command = ops.clip(wanted, low, high)
        rate = ops.where((wanted - command) * sign > 0.0, 0.0, self.integral * sign)
        later["integral"] = integral + dt * rate
        return commands(self.commanded, command), later


@model
class PID(SisoController):
    """u = K (b r - y) + I + D,   I' = K/T_i (r - y),   (T_d/N) D' + D = K T_d (c r - y)',
    standard (ISA) form.

    r set point and y measurement, in the unit of the measured column; u command, in that of the
    commanded input. At the samples t_k, h apart, I goes by forward and D by backward differences, e
    = r - y:

        D_k     = T_d/(T_d + N h) D_(k-1) + K T_d N/(T_d + N h) ((c r - y)_k - (c r - y)_(k-1))
        v_k     = K (b r_k - y_k) + I_k + D_k,      u_k = v_k limited to the range of the input
        I_(k+1) = I_k + K h/T_i e_k + min(h/T_t, 1) (u_k - v_k)

    The last term is anti-windup by back-calculation: while u is limited, I follows with the time
    constant T_t. Where T_t is 0 it is sqrt(T_i T_d), or T_i without derivative action. The start is
    bumpless: I_0 is chosen so that the first command is u_0, and D_0 = 0. Without integral action
    (T_i = 0) u_0 is a constant bias. A negative gain is for an input that lowers the measured
    column. Reference: Åström and Hägglund (1995), chapter 3.
    """

    references: ClassVar[tuple[Reference, ...]] = (ASTROM_HAGGLUND1995,)

    gain: float = parameter("u/y", "K", "proportional gain")
    integral_time: float = parameter(
        "s", "T_i", "integral time; 0: no integral", bounds=(0.0, 1e6), default=0.0
    )
    derivative_time: float = parameter(
        "s", "T_d", "derivative time; 0: no derivative", bounds=(0.0, 1e6), default=0.0
    )
    derivative_filter: float = parameter(
        "1", "N", "maximum gain of the derivative, in K", bounds=(1.0, 1e3), default=10.0
    )
    setpoint_weight: float = parameter(
        "1", "b", "set-point weight of the proportional part", bounds=(0.0, 1.0), default=1.0
    )
    derivative_weight: float = parameter(
        "1", "c", "set-point weight of the derivative", bounds=(0.0, 1.0), default=0.0
    )
    tracking_time: float = parameter(
        "s",
        "T_t",
        "tracking time of the anti-windup; 0: by the rule",
        bounds=(0.0, 1e6),
        default=0.0,
    )
    initial_output: float = parameter(
        "u", "u_0", "first command; without integral action the bias", default=0.0
    )

    initial_memory: ClassVar[Memory] = {
        "started": 0.0,
        "integral": 0.0,
        "derivative": 0.0,
        "weighted_error": 0.0,
    }
    """Whether it has started (0 or 1), I and D [u], and c r - y of the last sample [y]."""

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        setpoint = measurement.setpoints[self.measured]
        measured = measurement.columns[self.measured]
        proportional = self.gain * (self.setpoint_weight * setpoint - measured)
        weighted = self.derivative_weight * setpoint - measured
        started = memory["started"] > 0
        integrates, integral_time, tracking = self._integration
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
        values = {
            "started": 1.0,
            "integral": integral,
            "derivative": derivative,
            "weighted_error": weighted,
        }
        return commands(self.commanded, limited), values

    @functools.cached_property
    def _integration(self) -> tuple[Value, Value, Value]:
        """Whether there is integral action, and its time constant and that of the anti-windup [s];
        otherwise 1.
        """
        integrates = self.integral_time > 0
        product = self.integral_time * self.derivative_time
        by_rule = ops.where(
            product > 0, ops.sqrt(ops.where(product > 0, product, 1.0)), self.integral_time
        )
        tracking = ops.where(self.tracking_time > 0, self.tracking_time, by_rule)
        return (
            integrates,
            ops.where(integrates, self.integral_time, 1.0),
            ops.where(integrates, tracking, 1.0),
        )


@model
class OnOffController(SisoController):
    """The maximum command from y < r - H/2 on, the minimum from y > r + H/2 on, unchanged in
    between.

    r set point, y measurement, H width of the hysteresis. For an input that raises the measured
    column; the first command is the minimum. With SplitRange it fills or discharges. The measured
    column oscillates by more than H: valve, air and load continue to move after a switching, and
    switching takes place at samples only. Reference: Åström and Hägglund (1995), chapter 3, on-off
    control.
    """

    references: ClassVar[tuple[Reference, ...]] = (ASTROM_HAGGLUND1995,)

    hysteresis: float = parameter(
        "y", "H", "width between switching on and off", bounds=(0.0, INFINITY), default=0.0
    )

    initial_memory: ClassVar[Memory] = {"on": 0.0}
    """Whether the maximum is commanded (0 or 1)."""

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        error = measurement.columns[self.measured] - measurement.setpoints[self.measured]
        half = self.hysteresis / 2
        on = ops.where(error < -half, 1.0, ops.where(error > half, 0.0, memory["on"]))
        minimum, maximum = range_of(self.commanded, measurement.ranges)
        return commands(self.commanded, ops.where(on > 0, maximum, minimum)), {"on": on}


@model
class DeadZoneController(SisoController):
    """Maximum command where s > Z, minimum where s < -Z, and zero once |s| < z Z;  s = e + T_s e',
    e = r - y.

    With SplitRange it fills, discharges or closes both valves. Z half width of the dead zone, z
    share of it at which a valve closes again (hysteresis); T_s anticipates the motion during the
    delays of valve and air, so that the valve closes before the set point is reached. Within the
    dead zone nothing switches. Reference: Åström and Hägglund (1995), chapter 3, on-off control
    with dead zone.
    """

    references: ClassVar[tuple[Reference, ...]] = (ASTROM_HAGGLUND1995,)

    zone: float = parameter("y", "Z", "half width of the dead zone", bounds=(0.0, 1e9))
    release: float = parameter(
        "1", "z", "share of the dead zone at which a valve closes", bounds=(0.0, 1.0), default=0.5
    )
    lead_time: float = parameter(
        "s", "T_s", "time by which the motion is anticipated", bounds=(0.0, 1e3), default=0.0
    )
    filter_time: float = parameter(
        "s", "T_f", "time constant of the derivative", bounds=(0.0, 1e3), default=0.0
    )

    def check(self) -> None:
        if isinstance(self.commanded, str):
            raise ParameterError(
                f"DeadZoneController: commanded is the single input '{self.commanded}'; it needs"
                " two, SplitRange('fill', 'discharge')."
            )

    initial_memory: ClassVar[Memory] = {**SLIDING_MEMORY, "position": 0.0}
    """The position (-1, 0 or 1), whether it has started, the last error and its filtered
    derivative.
    """

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        s, later = sliding_variable(self, memory, measurement, self.lead_time, self.filter_time, dt)
        inner = self.release * self.zone
        held = memory["position"]
        remains = ops.where(held > 0.0, s >= inner, ops.where(held < 0.0, s <= -inner, 0.0 > 1.0))
        position = ops.where(
            s > self.zone, 1.0, ops.where(s < -self.zone, -1.0, ops.where(remains, held, 0.0))
        )
        low, high = range_of(self.commanded, measurement.ranges)
        output = ops.where(position > 0.0, high, ops.where(position < 0.0, low, 0.0))
        return commands(self.commanded, output), {**later, "position": position}

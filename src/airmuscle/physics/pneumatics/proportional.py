"""Proportional valves: 5/3 proportional directional valve and proportional pressure regulator."""

import dataclasses
from typing import ClassVar

from ...core import (
    Input,
    Reference,
    StateVariable,
    Value,
    Values,
    model,
    ops,
    parameter,
    published,
    within,
)
from ...core.declaration import forwarded
from .circuit import CircuitFlows, ValvePair
from .gas import Air, Airs, Ambient, absolute_pressure, gauge_pressure
from .valve import ISO6358, proportional_opening


@model
class SecondOrderLag:
    """Second-order lag of a position x behind a command u: x'' = w^2 (u - x) - 2 zeta w x', w = 2
    pi f.
    """

    frequency: float = parameter("Hz", "f", "natural frequency", bounds=(0.1, 1e4))
    damping_ratio: float = parameter("1", "zeta", "damping ratio", bounds=(0.05, 10.0), default=1.0)

    def rates(self, position: Value, speed: Value, command: Value) -> tuple[Value, Value]:
        """Time derivatives of position and speed."""
        w = 2.0 * ops.pi * self.frequency
        return speed, w**2 * (command - position) - 2.0 * self.damping_ratio * w * speed


@model
class ProportionalValve(ValvePair):
    """5/3 proportional directional valve for one muscle (second port plugged) or two muscles.

        opening of fill = clip((s - o)/(1 - o), 0, 1),   opening of discharge = clip((-s - o)/(1 -
                                                         o), 0, 1)

    s spool position from -1 to 1 at the first port, -s at the second; o overlap as a fraction of
    the stroke (negative for underlap, with leakage at the centre). Fill and discharge have separate
    orifices, whose areas may differ.
    """

    spool: SecondOrderLag
    overlap: float = parameter(
        "1", "o", "overlap as a fraction of the stroke", bounds=(-0.5, 0.9), default=0.0
    )
    muscle_count: int = within(1, 2, default=1)

    port_count = forwarded("muscle_count")
    inputs = (
        Input(
            "command", "1", -1.0, 1.0, "spool position: 1 fills the first muscle, -1 discharges it"
        ),
    )

    def own_states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        speed = 2.0 * ops.pi * self.spool.frequency
        return (
            StateVariable("spool", "1", 1.0, "spool position"),
            StateVariable("spool_speed", "1/s", speed, "spool speed"),
        )

    def own_steady_state(self, muscles: Airs, ambient: Ambient) -> dict[str, Value]:
        return {"spool": 0.0, "spool_speed": 0.0}

    def opening(self, position: Value) -> Value:
        """Opening of a control edge for a spool position towards this edge."""
        return proportional_opening(position - self.overlap, 1.0 - self.overlap)

    def supplied_flow(
        self, inlet: Air, muscles: Airs, state: Values, inputs: Values, ambient: Ambient
    ) -> CircuitFlows:
        spool = state["spool"]
        total = CircuitFlows(())
        for air, position in zip(muscles, (spool, -spool), strict=False):
            total += self.valve_flows(
                inlet, air, self.opening(position), self.opening(-position), ambient
            )
        speed, acceleration = self.spool.rates(spool, state["spool_speed"], inputs["command"])
        return dataclasses.replace(total, rates={"spool": speed, "spool_speed": acceleration})


@model
class ProportionalRegulator(ValvePair):
    """Proportional pressure regulator: second-order lag of the set point and a fill and a discharge
    orifice.

        opening of fill = clip((r - p)/B, 0, 1),   opening of discharge = clip((p - r)/B, 0, 1)
        r'' = w^2 (u - r) - 2 zeta w r'

    u set point, r lagged set point, p outlet pressure, B proportional band, the control error at
    full opening.
    """

    lag: SecondOrderLag
    band: float = parameter(
        "Pa",
        "B",
        "proportional band: control error at full opening",
        bounds=(100.0, 1e6),
        default=2e4,
    )
    max_setpoint: float = parameter(
        "Pa", "u_max", "maximum set point", bounds=(1e3, 5e6), fitted=False, default=1e6
    )

    holds_pressure = True

    @property
    def inputs(self) -> tuple[Input, ...]:
        return (Input("setpoint", "Pa", 0.0, self.max_setpoint, "set gauge pressure"),)

    def own_states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        rate = 1e5 * 2.0 * ops.pi * self.lag.frequency
        return (
            StateVariable("lagged_setpoint", "Pa", 1e5, "lagged set point, gauge pressure"),
            StateVariable("lagged_setpoint_rate", "Pa/s", rate, "rate of the lagged set point"),
        )

    def own_steady_state(self, muscles: Airs, ambient: Ambient) -> dict[str, Value]:
        return {
            "lagged_setpoint": gauge_pressure(muscles[0].pressure, ambient),
            "lagged_setpoint_rate": 0.0,
        }

    def supplied_flow(
        self, inlet: Air, muscles: Airs, state: Values, inputs: Values, ambient: Ambient
    ) -> CircuitFlows:
        (air,) = muscles
        setpoint = state["lagged_setpoint"]
        setpoint_rate = state["lagged_setpoint_rate"]
        error = absolute_pressure(setpoint, ambient) - air.pressure
        opened, vented = (
            proportional_opening(difference, self.band) for difference in (error, -error)
        )
        first, second = self.lag.rates(setpoint, setpoint_rate, inputs["setpoint"])
        rates = {"lagged_setpoint": first, "lagged_setpoint_rate": second}
        return dataclasses.replace(
            self.valve_flows(inlet, air, opened, vented, ambient), rates=rates
        )


DELAY_STAGES = 4
"""Number of equal lags that make up the dead time (chosen): 10 to 90 % of a step take 1.2 times the
dead time.
"""


@model
class PressureRegulator(ValvePair):
    """Electro-pneumatic pressure regulator (SMC ITV, Festo VPPM): command p_c to outlet pressure p,
    both gauge.

        delay      d_1' = 4 (p_c - d_1)/L,   d_i' = 4 (d_(i-1) - d_i)/L,  i = 2, 3, 4
        sensor     y' = (p - y)/T_f
        error      e = d_4 - y,   i' = k_i e a,   a = clip(2 - |e + i|/B, 0, 1) if e (e + i) > 0,
                   otherwise 1
        pilot      v = clip((e + i)/B, -1, 1) + o clip(2 e/epsilon - 1, -1, 1)
                   w' = 2 (v - w)/T_p,   x' = 2 (w - x)/T_p
        fill       opening clip(x - o, 0, 1) + l clip((x + o)/(2 o), 0, 1)
        discharge  opening clip(-x - o, 0, 1) + l clip((o - x)/(2 o), 0, 1)

    x position of the main valve in units of its stroke from an edge to full opening, closed for |x|
    < o apart from the leak l. The pilot stage brings it to the edge that the error needs, at rest
    to the discharge edge; after a reversal of the error it crosses the overlap 2 o within the time
    of the pilot. Hence a step after rest passes whole, a fast oscillation or a quick reversal of
    the same size hardly. Flows by the orifices, from the supply of the circuit and to the
    surroundings. The form of v is chosen, because the published models of the ITV2050 (integral
    pilot action, dead zone, leak) describe only one of the two. References: Actuated Design Lab
    (2026), ISO 6358.
    """

    references: ClassVar[tuple[Reference, ...]] = (published("actuated-design-lab2026"), ISO6358)

    band: float = parameter(
        "Pa", "B", "proportional band: control error at full opening", bounds=(100.0, 1e7)
    )
    pilot_time: float = parameter(
        "s", "T_p", "time constant of the pilot stage", bounds=(1e-3, 2.0)
    )
    overlap: float = parameter(
        "1", "o", "overlap on either side, relative to the stroke", bounds=(1e-3, 10.0)
    )
    dead_time: float = parameter(
        "s", "L", "dead time of the command", bounds=(1e-3, 0.5), default=0.02
    )
    integral_rate: float = parameter(
        "1/s", "k_i", "rate of integral action", bounds=(0.0, 100.0), default=0.0
    )
    sensitivity: float = parameter(
        "Pa",
        "epsilon",
        "error at which the pilot leaves the discharge edge for the fill edge",
        bounds=(1.0, 1e5),
        default=2e3,
    )
    leak: float = parameter(
        "1", "l", "opening by leakage within the overlap", bounds=(0.0, 0.5), default=0.0
    )
    filter_time: float = parameter(
        "s", "T_f", "time constant of the sensor", bounds=(1e-4, 1.0), default=2e-3
    )
    max_setpoint: float = parameter(
        "Pa", "u_max", "maximum set point", bounds=(1e3, 5e6), fitted=False, default=1e6
    )

    holds_pressure = True

    @property
    def inputs(self) -> tuple[Input, ...]:
        return (Input("setpoint", "Pa", 0.0, self.max_setpoint, "set gauge pressure"),)

    def own_states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        delayed = [
            StateVariable(
                f"delayed_setpoint{i}", "Pa", 1e5, f"set pressure after {i} of {DELAY_STAGES} lags"
            )
            for i in range(1, DELAY_STAGES + 1)
        ]
        return (
            *delayed,
            StateVariable("sensed_pressure", "Pa", 1e5, "gauge pressure of the sensor"),
            StateVariable(
                "integral_error", "Pa", 1e4, "integral of the control error times its rate"
            ),
            StateVariable(
                "pilot_position", "1", 1.0, "position towards which the pilot moves the main valve"
            ),
            StateVariable("valve_position", "1", 1.0, "position of the main valve"),
        )

    def own_steady_state(self, muscles: Airs, ambient: Ambient) -> dict[str, Value]:
        pressure = gauge_pressure(muscles[0].pressure, ambient)
        delayed = {f"delayed_setpoint{i}": pressure for i in range(1, DELAY_STAGES + 1)}
        rest = {
            "integral_error": 0.0,
            "pilot_position": -self.overlap,
            "valve_position": -self.overlap,
        }
        return {**delayed, "sensed_pressure": pressure, **rest}

    def openings(self, position: Value) -> tuple[Value, Value]:
        """Openings of fill and discharge at a position of the main valve."""
        return self._opening(position), self._opening(-position)

    def _opening(self, position: Value) -> Value:
        leakage = self.leak * ops.clip((position + self.overlap) / (2.0 * self.overlap), 0.0, 1.0)
        return ops.clip(position - self.overlap, 0.0, 1.0) + leakage

    def supplied_flow(
        self, inlet: Air, muscles: Airs, state: Values, inputs: Values, ambient: Ambient
    ) -> CircuitFlows:
        (air,) = muscles
        flows = self.valve_flows(inlet, air, *self.openings(state["valve_position"]), ambient)
        rates = self._rates(state, inputs["setpoint"], gauge_pressure(air.pressure, ambient))
        return dataclasses.replace(flows, rates=rates)

    def _rates(self, state: Values, setpoint: Value, pressure: Value) -> dict[str, Value]:
        chain = [setpoint, *(state[f"delayed_setpoint{i}"] for i in range(1, DELAY_STAGES + 1))]
        lag = self.dead_time / DELAY_STAGES
        rates = {
            f"delayed_setpoint{i}": (chain[i - 1] - chain[i]) / lag
            for i in range(1, DELAY_STAGES + 1)
        }
        error = chain[-1] - state["sensed_pressure"]
        sensed = state["sensed_pressure"]
        demand = (error + state["integral_error"]) / self.band
        spare = ops.clip(2.0 - ops.absolute_value(demand), 0.0, 1.0)
        edge = self.overlap * ops.clip(2.0 * error / self.sensitivity - 1.0, -1.0, 1.0)
        target = ops.clip(demand, -1.0, 1.0) + edge
        stage = self.pilot_time / 2.0
        return {
            **rates,
            "sensed_pressure": (pressure - sensed) / self.filter_time,
            "integral_error": (
                self.integral_rate * error * ops.where(demand * error > 0.0, spare, 1.0)
            ),
            "pilot_position": (target - state["pilot_position"]) / stage,
            "valve_position": (state["pilot_position"] - state["valve_position"]) / stage,
        }

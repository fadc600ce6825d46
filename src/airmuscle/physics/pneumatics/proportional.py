"""Proportional valves: 5/3 proportional directional valve and proportional pressure regulator."""

from ...core import Input, ParameterError, StateVariable, Value, Values, model, ops, parameter
from .circuit import Circuit, CircuitFlows, ambient_air
from .gas import NO_FLOW, Air, Ambient, absolute_pressure, gauge_pressure
from .supply import AirSource
from .valve import Orifice, orifice_flow, proportional_opening


@model
class SecondOrderLag:
    """Second-order lag of a position x behind a command u: x'' = w^2 (u - x) - 2 zeta w x', w = 2 pi f."""

    frequency: float = parameter("Hz", "f", "natural frequency", bounds=(0.1, 1e4))
    damping_ratio: float = parameter("1", "zeta", "damping ratio", bounds=(0.05, 10.0), default=1.0)

    def rates(self, position: Value, speed: Value, command: Value) -> tuple[Value, Value]:
        """Time derivatives of position and speed."""
        w = 2.0 * ops.pi * self.frequency
        return speed, w**2 * (command - position) - 2.0 * self.damping_ratio * w * speed


@model
class ProportionalValve(Circuit):
    """5/3 proportional directional valve for one muscle (second port plugged) or two muscles.

        opening of fill = clip((s - o)/(1 - o), 0, 1),   opening of discharge = clip((-s - o)/(1 - o), 0, 1)

    s spool position from -1 to 1 at the first port, -s at the second; o overlap as a fraction of the stroke (negative
    for underlap, with leakage at the centre). Fill and discharge have separate orifices, whose areas may differ.
    """

    supply: AirSource
    fill: Orifice
    discharge: Orifice
    spool: SecondOrderLag
    overlap: float = parameter("1", "o", "overlap as a fraction of the stroke", bounds=(-0.5, 0.9), default=0.0)
    muscle_count: int = 1
    """Number of muscles, 1 or 2."""

    def check(self) -> None:
        if isinstance(self.muscle_count, bool) or self.muscle_count not in (1, 2):
            raise ParameterError(f"ProportionalValve: muscle_count is {self.muscle_count!r}; it must be 1 or 2.")

    @property
    def port_count(self) -> int:
        return self.muscle_count

    @property
    def inputs(self) -> tuple[Input, ...]:
        return (Input("command", "1", -1.0, 1.0, "spool position: 1 fills the first muscle, -1 discharges it"),)

    def own_states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        speed = 2.0 * ops.pi * self.spool.frequency
        return (StateVariable("spool", "1", 1.0, "spool position"),
                StateVariable("spool_speed", "1/s", speed, "spool speed"))  # fmt: skip

    def own_steady_state(self, air_states: tuple[Air, ...], ambient: Ambient) -> dict[str, Value]:
        return {"spool": 0.0, "spool_speed": 0.0}

    def opening(self, position: Value) -> Value:
        """Opening of a control edge for a spool position towards this edge."""
        return proportional_opening(position - self.overlap, 1.0 - self.overlap)

    def supplied_flow(
        self, inlet: Air, air_states: tuple[Air, ...], state: Values, inputs: Values,
        ambient: Ambient,
    ) -> CircuitFlows:  # fmt: skip
        spool, flows, drawn, exhausted = state["spool"], [], NO_FLOW, NO_FLOW
        for air, position in zip(air_states, (spool, -spool), strict=False):
            inflow = orifice_flow(self.fill, inlet, air, self.opening(position))
            outflow = orifice_flow(self.discharge, air, ambient_air(ambient), self.opening(-position))
            flows.append(inflow - outflow)
            drawn, exhausted = drawn + inflow, exhausted + outflow
        speed, acceleration = self.spool.rates(spool, state["spool_speed"], inputs["command"])
        return CircuitFlows(tuple(flows), drawn, exhausted, {"spool": speed, "spool_speed": acceleration})


@model
class ProportionalRegulator(Circuit):
    """Proportional pressure regulator: second-order lag of the set point and a fill and a discharge orifice.

        opening of fill = clip((r - p)/B, 0, 1),   opening of discharge = clip((p - r)/B, 0, 1)
        r'' = w^2 (u - r) - 2 zeta w r'

    u set point, r lagged set point, p outlet pressure, B proportional band, the control error at full opening.
    """

    supply: AirSource
    fill: Orifice
    discharge: Orifice
    lag: SecondOrderLag
    band: float = parameter(
        "Pa", "B", "proportional band: control error at full opening", bounds=(100.0, 1e6), default=2e4
    )
    max_setpoint: float = parameter("Pa", "u_max", "maximum set point", bounds=(1e3, 5e6), fitted=False, default=1e6)

    @property
    def inputs(self) -> tuple[Input, ...]:
        return (Input("setpoint", "Pa", 0.0, self.max_setpoint, "set gauge pressure"),)

    def own_states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        rate = 1e5 * 2.0 * ops.pi * self.lag.frequency
        return (StateVariable("lagged_setpoint", "Pa", 1e5, "lagged set point, gauge pressure"),
                StateVariable("lagged_setpoint_rate", "Pa/s", rate, "rate of the lagged set point"))  # fmt: skip

    def own_steady_state(self, air_states: tuple[Air, ...], ambient: Ambient) -> dict[str, Value]:
        return {"lagged_setpoint": gauge_pressure(air_states[0].pressure, ambient), "lagged_setpoint_rate": 0.0}

    def supplied_flow(
        self, inlet: Air, air_states: tuple[Air, ...], state: Values, inputs: Values,
        ambient: Ambient,
    ) -> CircuitFlows:  # fmt: skip
        (air,) = air_states
        setpoint, setpoint_rate = state["lagged_setpoint"], state["lagged_setpoint_rate"]
        error = absolute_pressure(setpoint, ambient) - air.pressure
        inflow = orifice_flow(self.fill, inlet, air, proportional_opening(error, self.band))
        outflow = orifice_flow(self.discharge, air, ambient_air(ambient), proportional_opening(-error, self.band))
        first, second = self.lag.rates(setpoint, setpoint_rate, inputs["setpoint"])
        rates = {"lagged_setpoint": first, "lagged_setpoint_rate": second}
        return CircuitFlows((inflow - outflow,), inflow, outflow, rates)

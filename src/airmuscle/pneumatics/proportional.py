"""Valves that follow a command continuously: the 5/3 proportional valve and the proportional pressure regulator."""

from __future__ import annotations

from collections.abc import Mapping

from ..core import ops
from ..core.declaration import model, parameter
from ..core.errors import ParameterError
from ..core.ops import Value
from ..core.variables import Input, StateVariable
from .circuit import Circuit, CircuitFlows
from .fill_discharge import ambient_air
from .flow import orifice_flow, proportional_opening
from .gas import NO_FLOW, Air, Ambient, Flow, absolute_pressure, gauge_pressure
from .orifice import Orifice
from .supply import AirSource


@model
class SecondOrderLag:
    """A second-order lag: x'' = w^2 (u - x) - 2 zeta w x', w = 2 pi f."""

    frequency: float = parameter("Hz", "f", "natural frequency", bounds=(0.1, 1e4))
    damping_ratio: float = parameter("1", "zeta", "damping ratio", bounds=(0.05, 10.0), default=1.0)

    def rates(self, place: Value, speed: Value, command: Value) -> tuple[Value, Value]:
        """The time derivatives of place and speed."""
        w = 2.0 * ops.pi * self.frequency
        return speed, w**2 * (command - place) - 2.0 * self.damping_ratio * w * speed


@model
class ProportionalValve(Circuit):
    """A 5/3 valve whose spool follows the command; it feeds one muscle (its second port plugged) or two.

        port A: filled by (s - o)/(1 - o) of the fill orifice, discharged by (-s - o)/(1 - o) of the other; port B by -s

    s place of the spool, -1 to 1, o overlap as a share of its stroke (negative: underlap, which leaks in the middle).
    Fill and discharge have an orifice each, so that their areas may differ.
    """

    supply: AirSource
    fill: Orifice
    discharge: Orifice
    spool: SecondOrderLag
    overlap: float = parameter("1", "o", "overlap, share of the stroke", bounds=(-0.5, 0.9), default=0.0)
    muscle_count: int = 1
    """How many muscles it feeds, one or two."""

    def check(self) -> None:
        if isinstance(self.muscle_count, bool) or self.muscle_count not in (1, 2):
            raise ParameterError(f"ProportionalValve: it feeds one muscle or two, not {self.muscle_count!r}.")

    @property
    def port_count(self) -> int:
        return self.muscle_count

    @property
    def inputs(self) -> tuple[Input, ...]:
        return (Input("command", "1", -1.0, 1.0, "place of the spool: 1 fills the first muscle, -1 discharges it"),)

    def own_states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        speed = 2.0 * ops.pi * self.spool.frequency
        return (StateVariable("spool", "1", 1.0, "place of the spool"),
                StateVariable("spool_speed", "1/s", speed, "speed of the spool"))  # fmt: skip

    def own_steady_state(self, airs: tuple[Air, ...], ambient: Ambient) -> dict[str, Value]:
        return {"spool": 0.0, "spool_speed": 0.0}

    def opening(self, place: Value) -> Value:
        """Opening [1] of an edge with the spool at `place` towards it."""
        return proportional_opening(place - self.overlap, 1.0 - self.overlap)

    def supplied_flow(
        self, inlet: Air, airs: tuple[Air, ...], state: Mapping[str, Value], inputs: Mapping[str, Value],
        ambient: Ambient,
    ) -> CircuitFlows:  # fmt: skip
        place, flows, drawn, exhausted = state["spool"], [], NO_FLOW, NO_FLOW
        for air, towards in zip(airs, (place, -place), strict=False):
            incoming = orifice_flow(self.fill, inlet, air, self.opening(towards))
            outgoing = orifice_flow(self.discharge, air, ambient_air(ambient), self.opening(-towards))
            flows.append(incoming - outgoing)
            drawn, exhausted = drawn + incoming, exhausted + outgoing
        moving, pushed = self.spool.rates(place, state["spool_speed"], inputs["command"])
        return CircuitFlows(tuple(flows), drawn, exhausted, {"spool": moving, "spool_speed": pushed})


@model
class ProportionalRegulator(Circuit):
    """A pressure regulator that follows a set point: second order, with the flow that its two orifices let through.

        fill opens by clip((r - p)/B, 0, 1), discharge by clip((p - r)/B, 0, 1),   r'' = w^2 (u - r) - 2 zeta w r'

    u set point, r the pressure that it regulates to, p the pressure at its outlet, B the error at which it is fully
    open: near the set point it is slow, far from it its flow is that of the open orifice.
    """

    supply: AirSource
    fill: Orifice
    discharge: Orifice
    lag: SecondOrderLag
    band: float = parameter("Pa", "B", "error at which it is fully open", bounds=(100.0, 1e6), default=2e4)
    max_setpoint: float = parameter("Pa", "u_max", "greatest set point", bounds=(1e3, 5e6), fitted=False, default=1e6)

    @property
    def inputs(self) -> tuple[Input, ...]:
        return (Input("setpoint", "Pa", 0.0, self.max_setpoint, "gauge pressure to regulate to"),)

    def own_states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        rate = 1e5 * 2.0 * ops.pi * self.lag.frequency
        return (StateVariable("regulated", "Pa", 1e5, "gauge pressure that it regulates to"),
                StateVariable("regulated_rate", "Pa/s", rate, "rate of that pressure"))  # fmt: skip

    def own_steady_state(self, airs: tuple[Air, ...], ambient: Ambient) -> dict[str, Value]:
        return {"regulated": gauge_pressure(airs[0].pressure, ambient), "regulated_rate": 0.0}

    def supplied_flow(
        self, inlet: Air, airs: tuple[Air, ...], state: Mapping[str, Value], inputs: Mapping[str, Value],
        ambient: Ambient,
    ) -> CircuitFlows:  # fmt: skip
        (air,) = airs
        error = absolute_pressure(state["regulated"], ambient) - air.pressure
        incoming = orifice_flow(self.fill, inlet, air, proportional_opening(error, self.band))
        outgoing = orifice_flow(self.discharge, air, ambient_air(ambient), proportional_opening(-error, self.band))
        moving, pushed = self.lag.rates(state["regulated"], state["regulated_rate"], inputs["setpoint"])
        flow: Flow = incoming - outgoing
        return CircuitFlows((flow,), incoming, outgoing, {"regulated": moving, "regulated_rate": pushed})

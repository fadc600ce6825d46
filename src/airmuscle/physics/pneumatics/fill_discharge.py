"""Circuits with on/off valves for one muscle, and the closed chamber."""

from __future__ import annotations

from ...core import ops
from ...core.declaration import model
from ...core.ops import Values
from ...core.system import Input
from .circuit import Circuit, CircuitFlows
from .gas import NO_FLOW, Air, Ambient
from .supply import AirSource, Supply
from .valve import Orifice, orifice_flow


def ambient_air(ambient: Ambient) -> Air:
    """Air state of the surroundings."""
    return Air(ambient.pressure, ambient.temperature)


@model
class FillDischarge(Circuit):
    """Two on/off valves: a fill valve from the supply and a discharge valve to the surroundings."""

    supply: AirSource
    fill: Orifice
    discharge: Orifice

    @property
    def inputs(self) -> tuple[Input, ...]:
        return (Input("fill"), Input("discharge"))

    def supplied_flow(
        self, inlet: Air, air_states: tuple[Air, ...], state: Values, inputs: Values,
        ambient: Ambient,
    ) -> CircuitFlows:  # fmt: skip
        inflow = orifice_flow(self.fill, inlet, air_states[0], inputs["fill"])
        outflow = orifice_flow(self.discharge, air_states[0], ambient_air(ambient), inputs["discharge"])
        return CircuitFlows((inflow - outflow,), inflow, outflow)


@model
class ThreePositionValve(Circuit):
    """3/3 valve with closed centre and one input `valve`: 1 fill, 0 closed, -1 discharge; proportional between."""

    supply: AirSource
    fill: Orifice
    discharge: Orifice

    @property
    def inputs(self) -> tuple[Input, ...]:
        return (Input("valve", "1", -1.0, 1.0, "1 fill, 0 closed, -1 discharge"),)

    def supplied_flow(
        self, inlet: Air, air_states: tuple[Air, ...], state: Values, inputs: Values,
        ambient: Ambient,
    ) -> CircuitFlows:  # fmt: skip
        position = inputs["valve"]
        inflow = orifice_flow(self.fill, inlet, air_states[0], ops.maximum(position, 0.0))
        outflow = orifice_flow(self.discharge, air_states[0], ambient_air(ambient), ops.maximum(-position, 0.0))
        return CircuitFlows((inflow - outflow,), inflow, outflow)


@model
class ClosedChamber(Circuit):
    """Closed chamber: no flow, constant air mass."""

    supply: AirSource = Supply(0.0)

    @property
    def inputs(self) -> tuple[Input, ...]:
        return ()

    def supplied_flow(
        self, inlet: Air, air_states: tuple[Air, ...], state: Values, inputs: Values,
        ambient: Ambient,
    ) -> CircuitFlows:  # fmt: skip
        return CircuitFlows((NO_FLOW,))

"""On/off valves that fill a muscle and let it out; a muscle shut off for good."""

from __future__ import annotations

from collections.abc import Mapping

from ..core import ops
from ..core.declaration import model
from ..core.ops import Value
from ..core.variables import Input
from .circuit import Circuit, CircuitFlows
from .flow import orifice_flow
from .gas import NO_FLOW, Air, Ambient
from .orifice import Orifice
from .supply import AirSource, Supply


def ambient_air(ambient: Ambient) -> Air:
    """The air around the plant."""
    return Air(ambient.pressure, ambient.temperature)


@model
class FillDischarge(Circuit):
    """Two on/off valves: one from the supply, one to the surroundings."""

    supply: AirSource
    fill: Orifice
    discharge: Orifice

    @property
    def inputs(self) -> tuple[Input, ...]:
        return (Input("fill"), Input("discharge"))

    def supplied_flow(
        self, inlet: Air, airs: tuple[Air, ...], state: Mapping[str, Value], inputs: Mapping[str, Value],
        ambient: Ambient,
    ) -> CircuitFlows:  # fmt: skip
        incoming = orifice_flow(self.fill, inlet, airs[0], inputs["fill"])
        outgoing = orifice_flow(self.discharge, airs[0], ambient_air(ambient), inputs["discharge"])
        return CircuitFlows((incoming - outgoing,), incoming, outgoing)


@model
class ThreePositionValve(Circuit):
    """A 3/3 valve with closed centre: one input, `valve`; 1 fills, 0 shuts, -1 discharges, less is part of the area."""

    supply: AirSource
    fill: Orifice
    discharge: Orifice

    @property
    def inputs(self) -> tuple[Input, ...]:
        return (Input("valve", "1", -1.0, 1.0, "1 fill, 0 shut, -1 discharge"),)

    def supplied_flow(
        self, inlet: Air, airs: tuple[Air, ...], state: Mapping[str, Value], inputs: Mapping[str, Value],
        ambient: Ambient,
    ) -> CircuitFlows:  # fmt: skip
        place = inputs["valve"]
        incoming = orifice_flow(self.fill, inlet, airs[0], ops.maximum(place, 0.0))
        outgoing = orifice_flow(self.discharge, airs[0], ambient_air(ambient), ops.maximum(-place, 0.0))
        return CircuitFlows((incoming - outgoing,), incoming, outgoing)


@model
class ClosedChamber(Circuit):
    """No connection at all: the air mass stays what it is."""

    supply: AirSource = Supply(0.0)

    @property
    def inputs(self) -> tuple[Input, ...]:
        return ()

    def supplied_flow(
        self, inlet: Air, airs: tuple[Air, ...], state: Mapping[str, Value], inputs: Mapping[str, Value],
        ambient: Ambient,
    ) -> CircuitFlows:  # fmt: skip
        return CircuitFlows((NO_FLOW,))

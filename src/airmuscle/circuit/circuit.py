"""How valves are connected to a muscle."""

from __future__ import annotations

import abc
from collections.abc import Mapping

from ..declare import model, parameter
from ..gas import Ambient, absolute
from ..ops import Value
from .valve import Valve


@model
class Supply:
    """Air at a constant pressure."""

    pressure: float = parameter("Pa", "p_s", "gauge pressure of the supply", bounds=(-1e5, 5e6))


class Circuit(abc.ABC):
    """The pneumatic side of a muscle: inputs that open valves, and the mass flow that follows."""

    @property
    @abc.abstractmethod
    def inputs(self) -> tuple[str, ...]:
        """The names of the openings, each 0 shut to 1 open."""

    @abc.abstractmethod
    def mass_flow(self, pressure: Value, openings: Mapping[str, Value], ambient: Ambient) -> Value:
        """Mass flow [kg/s] into the muscle at its absolute pressure [Pa]."""


@model
class FillDischarge(Circuit):
    """Two on/off valves with closed centre: one from the supply, one to the surroundings."""

    supply: Supply
    fill: Valve
    discharge: Valve

    @property
    def inputs(self) -> tuple[str, ...]:
        return ("fill", "discharge")

    def mass_flow(self, pressure: Value, openings: Mapping[str, Value], ambient: Ambient) -> Value:
        source = absolute(self.supply.pressure, ambient)
        incoming = self.fill.mass_flow(source, pressure, openings["fill"], ambient.temperature)
        outgoing = self.discharge.mass_flow(pressure, ambient.pressure, openings["discharge"], ambient.temperature)
        return incoming - outgoing


@model
class ClosedChamber(Circuit):
    """No connection at all: the air mass stays what it is."""

    @property
    def inputs(self) -> tuple[str, ...]:
        return ()

    def mass_flow(self, pressure: Value, openings: Mapping[str, Value], ambient: Ambient) -> Value:
        return 0.0 * pressure

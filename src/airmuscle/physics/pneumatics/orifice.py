"""Orifice (interface): mass flow through a restriction."""

from __future__ import annotations

import abc

from ...core.ops import Value


class Orifice(abc.ABC):
    """Flow restriction between two pressures: valve, silencer, leak or port (interface).

    Flow laws are continuous, give no flow at equal pressures, and never a flow towards the higher pressure.
    """

    @abc.abstractmethod
    def mass_flow(self, upstream: Value, downstream: Value, opening: Value, temperature: Value) -> Value:
        """Mass flow [kg/s] from absolute pressure `upstream` to `downstream` [Pa] of air at `temperature` [K].

        `opening` scales the conductance from 0 (closed) to 1 (fully open). A reversed flow is negative.
        """

"""What every restriction that air flows through has in common."""

from __future__ import annotations

import abc

from ..core.ops import Value


class Orifice(abc.ABC):
    """A restriction between two pressures: a valve, a silencer, a leak, a port.

    Laws of this kind are continuous, pass nothing at equal pressures, and never pass air uphill.
    """

    @abc.abstractmethod
    def mass_flow(self, upstream: Value, downstream: Value, opening: Value, temperature: Value) -> Value:
        """Mass flow [kg/s] from absolute pressure `upstream` to `downstream` [Pa] of air at `temperature` [K].

        `opening` scales the conductance, 0 shut to 1 fully open; the flow is negative when it reverses.
        """

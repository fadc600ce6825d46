"""The wall of a muscle: volume beyond that of the geometry, which follows the pressure with a lag."""

from __future__ import annotations

import abc
from collections.abc import Mapping

from ..core import ops
from ..core.declaration import model, parameter
from ..core.ops import Value
from ..core.variables import StateVariable


class Wall:
    """What the volume of a muscle has beyond its geometry's."""

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """Its states; none, if it does not give."""
        return ()

    def settled(self, pressure: Value) -> dict[str, Value]:
        """Its states at rest at a gauge pressure [Pa]."""
        return {}

    def volume(self, state: Mapping[str, Value]) -> Value:
        """Volume [m3] that it adds."""
        return 0.0

    def rates(self, state: Mapping[str, Value], pressure: Value) -> dict[str, Value]:
        """The time derivative of its states at a gauge pressure [Pa]."""
        return {}


@model
class RigidWall(Wall):
    """The volume is the geometry's."""


class _Lagging(Wall):
    """V_w' = (V_s(p) - V_w)/tau."""

    lag: float

    @abc.abstractmethod
    def settled_volume(self, pressure: Value) -> Value:
        """Volume [m3] that it comes to at a gauge pressure [Pa]."""

    @property
    def states(self) -> tuple[StateVariable, ...]:
        return (StateVariable("wall_volume", "m3", 1e-6, "volume that the wall adds"),)

    def settled(self, pressure: Value) -> dict[str, Value]:
        return {"wall_volume": self.settled_volume(pressure)}

    def volume(self, state: Mapping[str, Value]) -> Value:
        return state["wall_volume"]

    def rates(self, state: Mapping[str, Value], pressure: Value) -> dict[str, Value]:
        return {"wall_volume": (self.settled_volume(pressure) - state["wall_volume"]) / self.lag}


@model
class LaggingWall(_Lagging):
    """An elastic wall that gives way with a lag: V_w' = (c p - V_w)/tau, a spring and a damper in parallel.

    p gauge pressure, c compliance, tau lag. It is passive: of the work p V_w' it stores V_w^2/(2 c), and the rest,
    tau V_w'^2/c, is heat.
    """

    compliance: float = parameter("m3/Pa", "c", "volume that the wall adds for each pascal", bounds=(0.0, 1e-8))
    lag: float = parameter("s", "tau", "time by which the wall lags", bounds=(1e-4, 100.0))

    def settled_volume(self, pressure: Value) -> Value:
        return self.compliance * pressure


@model
class SwellingWall(_Lagging):
    """An unloaded muscle whose length nobody recorded: its volume grows between a threshold and a limit of pressure.

        V_w' = (V_g g(p) - V_w)/tau,   g = 1/(1 + exp(-(p - p_h)/p_w)) less its value at p = 0

    V_g growth to the shortest length, p_h gauge pressure in the middle of that growth, p_w its breadth, tau lag. A
    lumped description, chosen; the contraction of the plant's muscle is then held, and its force means nothing.
    """

    growth_volume: float = parameter("m3", "V_g", "growth of the volume to the shortest length", bounds=(0.0, 1e-1))
    middle: float = parameter("Pa", "p_h", "gauge pressure in the middle of the growth", bounds=(0.0, 1e6))
    breadth: float = parameter("Pa", "p_w", "breadth in pressure of the growth", bounds=(1e3, 1e6))
    lag: float = parameter("s", "tau", "time by which the wall lags", bounds=(1e-4, 100.0))

    def settled_volume(self, pressure: Value) -> Value:
        return self.growth_volume * (self._share(pressure) - self._share(0.0))

    def _share(self, pressure: Value) -> Value:
        # Beyond 50 breadths the share is 0 or 1 to the last digit; the exponential and its slope stay finite.
        return 1.0 / (1.0 + ops.exp(ops.clip((self.middle - pressure) / self.breadth, -50.0, 50.0)))

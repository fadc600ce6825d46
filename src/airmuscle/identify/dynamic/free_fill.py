"""An unloaded muscle filled through a valve and a line: the plant that a fill without a displacement can determine."""

from __future__ import annotations

from collections.abc import Mapping

from ... import ops
from ...circuit import Supply, Valve
from ...declare import model, parameter
from ...gas import Ambient, Polytropic, Process, absolute, gauge
from ...ops import Value
from ...program import StateVariable


@model
class FreeFill:
    """Supply -> valve -> line -> muscle, whose wall follows the pressure with a lag; states are masses and volume.

        m_l' = q_valve - q_line,  m' = q_line,  V' = (V_s(p) - V)/tau,  V_s = V_0 + V_g g(p)
        g = 1/(1 + exp(-(p - p_h)/p_w)) less its value at p = 0

    V_0 volume at rest, V_g its growth to the shortest length, p_h gauge pressure in the middle of that growth, p_w
    its breadth. `line.pressure` is sensed before the muscle, `pressure` inside it. A lumped description, chosen: a
    muscle without load goes through its free contraction between a threshold and a limit of pressure.
    """

    supply: Supply
    valve: Valve
    line: Valve
    line_volume: float = parameter("m3", "V_l", "volume of the line", bounds=(1e-8, 1e-2))
    rest_volume: float = parameter("m3", "V_0", "volume of the muscle at rest", bounds=(1e-7, 1e-1))
    growth_volume: float = parameter("m3", "V_g", "growth of the volume to the shortest length", bounds=(0.0, 1e-1))
    middle: float = parameter("Pa", "p_h", "gauge pressure in the middle of the growth", bounds=(0.0, 1e6))
    breadth: float = parameter("Pa", "p_w", "breadth in pressure of the growth", bounds=(1e3, 1e6))
    lag: float = parameter("s", "tau", "time by which the wall lags", bounds=(1e-4, 10.0))
    gas: Process = Polytropic()
    ambient: Ambient = Ambient()

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """Air in line and muscle, and the muscle's volume."""
        return (
            StateVariable("line_mass", "kg", self._mass(self.line_volume), "mass of the air in the line"),
            StateVariable("air_mass", "kg", self._mass(self.rest_volume), "mass of the air in the muscle"),
            StateVariable("volume", "m3", self.rest_volume, "volume of the muscle"),
        )

    @property
    def inputs(self) -> tuple[str, ...]:
        """The opening of the valve."""
        return ("fill",)

    def _mass(self, volume: Value) -> Value:
        return self.gas.air_mass(self.ambient.pressure, volume, self.ambient)

    def settled_volume(self, pressure: Value) -> Value:
        """Volume [m3] that the muscle comes to at a gauge pressure [Pa]."""
        at, none = (ops.exp(-(p - self.middle) / self.breadth) for p in (pressure, 0.0))
        return self.rest_volume + self.growth_volume * (1.0 / (1.0 + at) - 1.0 / (1.0 + none))

    def _pressures(self, state: Mapping[str, Value]) -> tuple[Value, Value]:
        before = self.gas.pressure(state["line_mass"], self.line_volume, self.ambient)
        return before, self.gas.pressure(state["air_mass"], state["volume"], self.ambient)

    def rates(self, state: Mapping[str, Value], inputs: Mapping[str, Value]) -> dict[str, Value]:
        """Flows into line and muscle, and the wall on its way."""
        before, inside = self._pressures(state)
        source, warm = absolute(self.supply.pressure, self.ambient), self.ambient.temperature
        into = self.valve.mass_flow(source, before, inputs["fill"], warm)
        along = self.line.mass_flow(before, inside, 1.0, warm)
        settled = self.settled_volume(gauge(inside, self.ambient))
        rates = {"line_mass": into - along, "air_mass": along}
        return {**rates, "volume": (settled - state["volume"]) / self.lag}

    def outputs(self, state: Mapping[str, Value], inputs: Mapping[str, Value]) -> dict[str, Value]:
        """Gauge pressure in the line and in the muscle."""
        before, inside = self._pressures(state)
        return {"line.pressure": gauge(before, self.ambient), "pressure": gauge(inside, self.ambient)}

    def guess(self, pressure: float) -> dict[str, float]:
        """The state that rests at a gauge pressure [Pa]."""
        inside, volume = absolute(pressure, self.ambient), float(self.settled_volume(pressure))
        masses = [float(self.gas.air_mass(inside, v, self.ambient)) for v in (self.line_volume, volume)]
        return {"line_mass": masses[0], "air_mass": masses[1], "volume": volume}

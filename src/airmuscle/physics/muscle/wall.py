"""Wall models: volume in addition to that of the geometry, dependent on pressure."""

import abc

from ...core import StateVariable, Value, Values, model, ops, parameter


class Wall:
    """Wall whose deformation adds volume to that of the geometry (base class: no added volume)."""

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """State variables; none for a rigid wall."""
        return ()

    def steady_state(self, pressure: Value) -> dict[str, Value]:
        """Steady state at a gauge pressure [Pa]."""
        return {}

    def volume(self, state: Values) -> Value:
        """Added volume [m3]."""
        return 0.0

    def rates(self, state: Values, pressure: Value) -> dict[str, Value]:
        """Time derivatives of the states at a gauge pressure [Pa]."""
        return {}


@model
class RigidWall(Wall):
    """Rigid wall: the volume is that of the geometry."""


class _FirstOrderWall(Wall):
    """First-order lag of the added volume: V_w' = (V_s(p) - V_w)/tau."""

    time_constant: float

    @abc.abstractmethod
    def steady_volume(self, pressure: Value) -> Value:
        """Added volume [m3] in the steady state at a gauge pressure [Pa]."""

    @property
    def states(self) -> tuple[StateVariable, ...]:
        return (StateVariable("wall_volume", "m3", 1e-6, "volume added by the wall"),)

    def steady_state(self, pressure: Value) -> dict[str, Value]:
        return {"wall_volume": self.steady_volume(pressure)}

    def volume(self, state: Values) -> Value:
        return state["wall_volume"]

    def rates(self, state: Values, pressure: Value) -> dict[str, Value]:
        return {"wall_volume": (self.steady_volume(pressure) - state["wall_volume"]) / self.time_constant}


@model
class ViscoelasticWall(_FirstOrderWall):
    """Viscoelastic (Kelvin-Voigt) wall: V_w' = (c p - V_w)/tau, a spring and a damper in parallel.

    p gauge pressure, c compliance, tau time constant. The wall is passive: the power p V_w' is the rate of the stored
    energy V_w^2/(2 c) plus the dissipated power tau V_w'^2/c.
    """

    compliance: float = parameter("m3/Pa", "c", "compliance: added volume per pressure", bounds=(0.0, 1e-8))
    time_constant: float = parameter("s", "tau", "time constant of the wall", bounds=(1e-4, 100.0))

    def steady_volume(self, pressure: Value) -> Value:
        return self.compliance * pressure


@model
class SwellingWall(_FirstOrderWall):
    """Sigmoidal volume increase of an unloaded muscle whose length was not recorded.

        V_w' = (V_g g(p) - V_w)/tau,   g(p) = s(p) - s(0),   s(p) = 1/(1 + exp(-(p - p_h)/p_w))

    V_g volume increase up to the shortest length, p_h gauge pressure at the midpoint of the increase, p_w its width in
    pressure, tau time constant. This lumped model is chosen, not published. Fix the contraction of the muscle
    (`Isometric`) when it is used; the force of the muscle then has no meaning.
    """

    growth_volume: float = parameter("m3", "V_g", "volume increase up to the shortest length", bounds=(0.0, 1e-1))
    midpoint_pressure: float = parameter("Pa", "p_h", "gauge pressure at the midpoint", bounds=(0.0, 1e6))
    pressure_width: float = parameter("Pa", "p_w", "width of the increase in pressure", bounds=(1e3, 1e6))
    time_constant: float = parameter("s", "tau", "time constant of the wall", bounds=(1e-4, 100.0))

    def steady_volume(self, pressure: Value) -> Value:
        return self.growth_volume * (self._sigmoid(pressure) - self._sigmoid(0.0))

    def _sigmoid(self, pressure: Value) -> Value:
        # Beyond 50 widths the sigmoid is 0 or 1 to machine precision; the clip keeps exp and its derivative finite.
        return 1.0 / (1.0 + ops.exp(ops.clip((self.midpoint_pressure - pressure) / self.pressure_width, -50.0, 50.0)))

"""Passive elements of a muscle: springs, dampers, creep elements and end stops in parallel, and the
wall's volume.
"""

import abc

from ...core import ParameterError, StateVariable, Value, Values, model, ops, parameter
from ..mechanism.end_stops import HuntCrossley


class Spring(abc.ABC):
    """Parallel spring that opposes contraction (interface)."""

    @abc.abstractmethod
    def force(self, pressure: Value, contraction: Value, resting_length: Value) -> Value:
        """Spring force [N] against contraction at gauge pressure [Pa], contraction and resting
        length [m].
        """


@model
class LinearSpring(Spring):
    """Linear spring: F_PP = k y with y = eps L0, the constant stiffness of Hošovský et al."""

    stiffness: float = parameter(
        "N/m", "k_PP", "stiffness of the parallel spring", bounds=(0.0, 1e7)
    )

    def force(self, pressure: Value, contraction: Value, resting_length: Value) -> Value:
        return self.stiffness * contraction * resting_length


@model
class CubicSpring(Spring):
    """Cubic spring: F_PP = k y (1 + h eps^2) with y = eps L0; the stiffness depends on
    contraction.
    """

    stiffness: float = parameter(
        "N/m", "k_PP", "stiffness at the resting length", bounds=(0.0, 1e7)
    )
    hardening: float = parameter(
        "1", "h", "hardening coefficient of the squared contraction", bounds=(-10.0, 1e4)
    )

    def force(self, pressure: Value, contraction: Value, resting_length: Value) -> Value:
        return (
            self.stiffness * contraction * resting_length * (1.0 + self.hardening * contraction**2)
        )


class Damper(abc.ABC):
    """Viscous damper with one damping coefficient [N s/m] for each direction of motion
    (interface).
    """

    @abc.abstractmethod
    def coefficients(self, pressure: Value, contraction: Value) -> tuple[Value, Value]:
        """Damping coefficients [N s/m] for shortening and lengthening at gauge pressure [Pa] and
        contraction.
        """

    def force(self, pressure: Value, contraction: Value, speed: Value) -> Value:
        """Damping force [N] that opposes shortening at a speed [m/s]."""
        shortening, lengthening = self.coefficients(pressure, contraction)
        if shortening is lengthening:
            return shortening * speed
        return ops.where(speed >= 0, shortening, lengthening) * speed

    def speed(
        self, pressure: Value, contraction: Value, force: Value, extra_damping: Value = 0.0
    ) -> Value:
        """Speed of shortening [m/s] at which the damper balances a force [N].

        `extra_damping` [N s/m] is the coefficient of another damper in parallel.
        """
        shortening, lengthening = self.coefficients(pressure, contraction)
        if shortening is lengthening:
            return force / (shortening + extra_damping)
        return force / (ops.where(force >= 0, shortening, lengthening) + extra_damping)


@model
class LinearDamper(Damper):
    """Linear damper: F_TL = b v with a constant coefficient b."""

    damping: float = parameter("N s/m", "b", "damping coefficient", bounds=(0.0, 1e6))

    def coefficients(self, pressure: Value, contraction: Value) -> tuple[Value, Value]:
        return self.damping, self.damping


@model
class PressureDamper(Damper):
    """Pressure-dependent damper: F_TL = max(b_0 + b_p p, 0) v with gauge pressure p."""

    damping: float = parameter(
        "N s/m", "b_0", "damping coefficient at ambient pressure", bounds=(0.0, 1e6)
    )
    damping_slope: float = parameter(
        "N s/(m Pa)", "b_p", "slope of the coefficient over gauge pressure", bounds=(0.0, 1.0)
    )

    def coefficients(self, pressure: Value, contraction: Value) -> tuple[Value, Value]:
        coefficient = ops.maximum(self.damping + self.damping_slope * pressure, 0.0)
        return coefficient, coefficient


@model
class DirectionalDamper(Damper):
    """Direction-dependent damper: F_TL = b(p) v with b = max(b_0 + b_p p, 0), separate for
    shortening and lengthening.

    p gauge pressure. Reynolds et al. (2003) identify damping in this form: `Reynolds2003Damper` has
    their values, `Serres2009Damper` has those of a Festo muscle. The force is continuous at zero
    speed.
    """

    shortening: float = parameter(
        "N s/m", "b_c0", "shortening coefficient at ambient pressure", bounds=(0.0, 1e6)
    )
    lengthening: float = parameter(
        "N s/m", "b_r0", "lengthening coefficient at ambient pressure", bounds=(0.0, 1e6)
    )
    shortening_slope: float = parameter(
        "N s/(m Pa)",
        "b_cp",
        "slope of the shortening coefficient over pressure",
        bounds=(-1.0, 1.0),
        default=0.0,
    )
    lengthening_slope: float = parameter(
        "N s/(m Pa)",
        "b_rp",
        "slope of the lengthening coefficient over pressure",
        bounds=(-1.0, 1.0),
        default=0.0,
    )

    def coefficients(self, pressure: Value, contraction: Value) -> tuple[Value, Value]:
        shortening = self.shortening + self.shortening_slope * pressure
        lengthening = self.lengthening + self.lengthening_slope * pressure
        return ops.maximum(shortening, 0.0), ops.maximum(lengthening, 0.0)


@model
class CreepElements:
    """Maxwell elements: F = Sum k_i z_i,  z_i' = v - z_i/tau_i; each is a spring in series with a
    damper.

    z_i stretch of spring i [m], k_i its stiffness, tau_i its relaxation time. After a step in
    length the force relaxes to that of the muscle without these elements; under a constant load the
    contraction increases with time. Passive.
    """

    stiffnesses: tuple[float, ...] = parameter(
        "N/m", "k_i", "stiffness of each spring", bounds=(0.0, 1e7), default=()
    )
    relaxation_times: tuple[float, ...] = parameter(
        "s", "tau_i", "relaxation time of each element", bounds=(1e-3, 1e5), default=()
    )

    def check(self) -> None:
        if len(self.stiffnesses) != len(self.relaxation_times):
            raise ParameterError(
                f"CreepElements: {len(self.stiffnesses)} stiffnesses and"
                f" {len(self.relaxation_times)} relaxation times are given; give one of each for"
                " every element."
            )

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """Stretch of each spring [m]."""
        numbers = range(1, len(self.relaxation_times) + 1)
        meaning = "stretch of the spring of creep element"
        return tuple(StateVariable(f"creep{i}", "m", 1e-3, f"{meaning} {i}") for i in numbers)

    def force(self, state: Values) -> Value:
        """Force against contraction [N]."""
        return sum(
            (k * state[s.name] for k, s in zip(self.stiffnesses, self.states, strict=True)), 0.0
        )

    def rates(self, state: Values, speed: Value) -> dict[str, Value]:
        """Time derivative of each stretch [m/s] at a speed of shortening [m/s]."""
        return {
            s.name: speed - state[s.name] / tau
            for s, tau in zip(self.states, self.relaxation_times, strict=True)
        }


class Stop(abc.ABC):
    """Element that limits the contraction of a muscle by a pushing force (interface)."""

    @abc.abstractmethod
    def force(self, contraction: Value, speed: Value, resting_length: Value) -> Value:
        """Force [N] against contraction at a speed of shortening [m/s]."""

    @abc.abstractmethod
    def static_force_and_damping(
        self, contraction: Value, resting_length: Value
    ) -> tuple[Value, Value]:
        """Force [N] at zero speed, and the slope of the force over the speed of shortening [N
        s/m].
        """


@model
class NoStop(Stop):
    """No end stop: the contraction is limited by the force law alone."""

    def force(self, contraction: Value, speed: Value, resting_length: Value) -> Value:
        return 0.0

    def static_force_and_damping(
        self, contraction: Value, resting_length: Value
    ) -> tuple[Value, Value]:
        return 0.0, 0.0


@model
class EndStop(Stop):
    """End stop: a Hunt-Crossley contact that begins at a given contraction."""

    contraction: float = parameter(
        "1", "eps_s", "contraction at which the contact begins", bounds=(-0.5, 0.95)
    )
    contact: HuntCrossley

    def force(self, contraction: Value, speed: Value, resting_length: Value) -> Value:
        return self.contact.force(self.depth(contraction, resting_length), speed)

    def static_force_and_damping(
        self, contraction: Value, resting_length: Value
    ) -> tuple[Value, Value]:
        static_force = self.contact.elastic_force(self.depth(contraction, resting_length))
        return static_force, self.contact.damping * static_force

    def depth(self, contraction: Value, resting_length: Value) -> Value:
        """Contact depth [m]; 0 without contact."""
        return ops.maximum(contraction - self.contraction, 0.0) * resting_length


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

    states = (StateVariable("wall_volume", "m3", 1e-6, "volume added by the wall"),)

    def steady_state(self, pressure: Value) -> dict[str, Value]:
        return {"wall_volume": self.steady_volume(pressure)}

    def volume(self, state: Values) -> Value:
        return state["wall_volume"]

    def rates(self, state: Values, pressure: Value) -> dict[str, Value]:
        return {
            "wall_volume": (
                (self.steady_volume(pressure) - state["wall_volume"]) / self.time_constant
            )
        }


@model
class ViscoelasticWall(_FirstOrderWall):
    """Viscoelastic (Kelvin-Voigt) wall: V_w' = (c p - V_w)/tau, a spring and a damper in parallel.

    p gauge pressure, c compliance, tau time constant. The wall is passive: the power p V_w' is the
    rate of the stored energy V_w^2/(2 c) plus the dissipated power tau V_w'^2/c.
    """

    compliance: float = parameter(
        "m3/Pa", "c", "compliance: added volume per pressure", bounds=(0.0, 1e-8)
    )
    time_constant: float = parameter("s", "tau", "time constant of the wall", bounds=(1e-4, 100.0))

    def steady_volume(self, pressure: Value) -> Value:
        return self.compliance * pressure


@model
class SwellingWall(_FirstOrderWall):
    """Sigmoidal volume increase of an unloaded muscle whose length was not recorded.

        V_w' = (V_g g(p) - V_w)/tau,   g(p) = s(p) - s(0),   s(p) = 1/(1 + exp(-(p - p_h)/p_w))

    p gauge pressure. This lumped model is chosen, not published. Fix the contraction of the muscle
    (`Isometric`) when it is used; the force of the muscle then has no meaning.
    """

    growth_volume: float = parameter(
        "m3", "V_g", "volume increase up to the shortest length", bounds=(0.0, 1e-1)
    )
    midpoint_pressure: float = parameter(
        "Pa", "p_h", "gauge pressure at the midpoint", bounds=(0.0, 1e6)
    )
    pressure_width: float = parameter(
        "Pa", "p_w", "width of the increase in pressure", bounds=(1e3, 1e6)
    )
    time_constant: float = parameter("s", "tau", "time constant of the wall", bounds=(1e-4, 100.0))

    def steady_volume(self, pressure: Value) -> Value:
        return self.growth_volume * (self._sigmoid(pressure) - self._sigmoid(0.0))

    def _sigmoid(self, pressure: Value) -> Value:
        # Beyond 50 widths the sigmoid is 0 or 1 to machine precision; the clip keeps exp and its
        # derivative finite.
        return 1.0 / (
            1.0
            + ops.exp(
                ops.clip((self.midpoint_pressure - pressure) / self.pressure_width, -50.0, 50.0)
            )
        )

"""Stick-slip of joints: dry friction that holds at rest and grows with the tensions of the muscles."""

from collections.abc import Sequence

from ...core import ParameterError, StateVariable, Value, Values, check_structure, model, ops, parameter
from .base import Coordinate, Mechanism
from .wrapper import MechanismWrapper


@model
class StickSlip:
    """Dry friction of one joint: Q_f = -T (z + w/w_1)/(1 + |w|/w_1),   z' = (w - |w| z)/(theta_s (1 + |w|/w_1)).

        T = (T_c + sum_i mu_i F_i) (1 + s/(1 + (w/w_s)^2)),   w_1 = theta_s/tau

    w angular speed, z deflection of the bristle relative to its sliding value, F_i tension of muscle i. At rest the
    bristle holds like a spring up to T_c (1 + s); sliding faster than w_s, the friction is T_c. The friction of
    tendons, sheaths and bearings grows with their load: mu_i is a moment arm of the friction of tendon i. Above w_1 the
    torque follows the sign of the speed itself, so that the rate of z is bounded by 1/tau and a step of that length is
    stable. For constant tension and s = 0 the energy T theta_s z^2/2 of the bristle never grows by more than the work
    done on it. The normalised form of Dahl's model (Dahl 1968) with these additions, which are chosen.
    """

    coulomb_torque: float = parameter("N m", "T_c", "friction torque without load", bounds=(1e-9, 1e5))
    load_arms: tuple[float, ...] = parameter(
        "m", "mu_i", "friction torque per tension of each muscle", bounds=(0.0, 10.0), default=()
    )
    static_excess: float = parameter(
        "1", "s", "static friction above that of sliding, relative to it", bounds=(0.0, 20.0), default=0.0
    )
    stribeck_speed: float = parameter(
        "rad/s", "w_s", "speed at which half of the excess is left", bounds=(1e-3, 1e3), default=1.0
    )
    presliding_angle: float = parameter(
        "rad", "theta_s", "angle over which the bristle deflects before sliding", bounds=(1e-5, 1.0), default=2e-3
    )
    turnover_time: float = parameter(
        "s", "tau", "shortest time in which the bristle turns over", bounds=(1e-5, 0.1), fitted=False, default=2e-3
    )

    def level(self, load: Value, speed: Value) -> Value:
        """Friction torque [N m] in sliding at an angular speed [rad/s]; `load` is the sum of mu_i F_i [N m]."""
        return (self.coulomb_torque + load) * (1.0 + self.static_excess / (1.0 + (speed / self.stribeck_speed) ** 2))

    def torque(self, bristle: Value, load: Value, speed: Value) -> Value:
        """Friction torque [N m] on the joint, positive in the direction of the angle."""
        fast = self.turnover_time / self.presliding_angle
        share = (bristle + fast * speed) / (1.0 + fast * ops.absolute_value(speed))
        return 0.0 - self.level(load, speed) * share

    def bristle_rate(self, bristle: Value, speed: Value) -> Value:
        """Time derivative of the relative deflection of the bristle [1/s]."""
        magnitude = ops.absolute_value(speed)
        return (speed - magnitude * bristle) / (self.presliding_angle + self.turnover_time * magnitude)


@model
class WithStickSlip(MechanismWrapper):
    """Mechanism whose joints have the friction of `elements`, one for each of its angles; the bristles are states.

    Equilibria are those with relaxed bristles. A caller of `acceleration` who gives torques alone has the friction
    without load.
    """

    inner: Mechanism
    elements: tuple[StickSlip, ...]

    def check(self) -> None:
        check_structure(self)
        angles, owner = self._angles, type(self.inner).__name__
        if len(angles) != len(self.elements) or not angles:
            raise ParameterError(
                f"WithStickSlip: {owner} has {len(angles)} angles and {len(self.elements)} elements are given; give "
                "one for each angle."
            )
        for element in self.elements:
            if element.load_arms and self.muscle_count not in (None, len(element.load_arms)):
                raise ParameterError(
                    f"WithStickSlip: {owner} takes {self.muscle_count} muscles, and {len(element.load_arms)} load_arms "
                    "are given; give one for each muscle, or none."
                )

    @property
    def _angles(self) -> list[Coordinate]:
        return [c for c in self.inner.coordinates if c.unit == "rad"]

    @property
    def inner_states(self) -> tuple[StateVariable, ...]:
        own = (StateVariable(_bristle(c), "1", 1.0, f"bristle of the friction of {c.name}") for c in self._angles)
        return (*self.inner.inner_states, *own)

    def inner_rates(self, q: Values, v: Values, forces: Values) -> dict[str, Value]:
        own = {
            _bristle(c): element.bristle_rate(q.get(_bristle(c), 0.0), v[c.speed])
            for c, element in zip(self._angles, self.elements, strict=True)
        }
        return {**self.inner.inner_rates(q, v, forces), **own}

    def generalised_forces(
        self, q: Values, tensions: Sequence[Value], resting_lengths: Sequence[Value]
    ) -> dict[str, Value]:
        """Those of the inner mechanism, and for each angle the load of its friction [N m]."""
        loads = {
            _load(c): sum((mu * tension for mu, tension in zip(element.load_arms, tensions, strict=False)), 0.0)
            for c, element in zip(self._angles, self.elements, strict=True)
        }
        return {**self.inner.generalised_forces(q, tensions, resting_lengths), **loads}

    def acceleration(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        return self.inner.acceleration(q, v, {**forces, **self._with_friction(q, v, forces)}, inputs)

    def _with_friction(self, q: Values, v: Values, forces: Values) -> dict[str, Value]:
        return {c.name: forces[c.name] + torque for c, torque in self._friction(q, v, forces)}

    def _friction(self, q: Values, v: Values, forces: Values) -> list[tuple[Coordinate, Value]]:
        return [
            (c, element.torque(q.get(_bristle(c), 0.0), forces.get(_load(c), 0.0), v[c.speed]))
            for c, element in zip(self._angles, self.elements, strict=True)
        ]

    def dissipated_power(self, q: Values, v: Values, forces: Values, inputs: Values) -> Value:
        inner = self.inner.dissipated_power(q, v, {**forces, **self._with_friction(q, v, forces)}, inputs)
        return inner - sum(torque * v[c.speed] for c, torque in self._friction(q, v, forces))


def _bristle(coordinate: Coordinate) -> str:
    return f"{coordinate.name.removesuffix('angle')}friction_bristle"


def _load(coordinate: Coordinate) -> str:
    return f"{coordinate.name}.friction_load"

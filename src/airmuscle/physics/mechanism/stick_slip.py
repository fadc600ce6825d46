"""Stick-slip of joints: dry friction that holds at rest and grows with the tensions of the
muscles.
"""

from collections.abc import Mapping, Sequence
from typing import cast

from ...core import ParameterError, StateVariable, Value, Values, model, ops, parameter
from .base import Coordinate, EnergyAccount, Mechanism
from .serial_arm import SerialArm
from .wrapper import ForceWrapper

BRISTLE = "bristle"
RESIDUAL = "residual"
"""Names of the stores of energy of a WithStickSlip."""


@model
class StickSlip:
    """Dry friction of one joint: Q_f = -T (z + w/w_1)/(1 + |w|/w_1),   z' = (w - |w| z)/(theta_s (1
    + |w|/w_1)).

        T = (T_c + sum_i mu_i F_i + r_1 R_r + r_2 R_a) (1 + s/(1 + (w/w_s)^2)),   w_1 = theta_s/tau

    w angular speed, z deflection of the bristle relative to its sliding value, F_i tension of
    muscle i. At rest the bristle holds like a spring up to T_c (1 + s); sliding faster than w_s,
    the friction is T_c. The friction of tendons, sheaths and bearings grows with their load: mu_i
    is a moment arm of the friction of tendon i, r_1 and r_2 are those of the bearing, which carries
    and accelerates the links beyond the joint with the forces R_r across its axis and R_a along it.
    They are computed at the accelerations of the other joints without this share of friction, and
    at none of the joint's own: what holds at rest is exact, and so is a link balanced about its
    axis. Above w_1 the torque follows the sign of the speed itself, so that the rate of z is
    bounded by 1/tau and a step of that length is stable. At constant T the energy T theta_s z^2/2
    of the bristle never grows by more than the work done on it. A load that rises while the bristle
    is bent stiffens it, and nothing pays for that: the energy grows by the integral of theta_s
    z^2/2 over T. Apart from it the friction takes energy in every motion, as the meters of a plant
    book: `bristle_work` is `bristle_heat`, which never falls, plus the growth of `bristle_energy`,
    minus `bristle_energy_unpaid`. The normalised form of Dahl's model (Dahl 1968) with these
    additions, which are chosen.
    """

    coulomb_torque: float = parameter(
        "N m", "T_c", "friction torque without load", bounds=(1e-9, 1e5)
    )
    load_arms: tuple[float, ...] = parameter(
        "m", "mu_i", "friction torque per tension of each muscle", bounds=(0.0, 10.0), default=()
    )
    static_excess: float = parameter(
        "1",
        "s",
        "static friction above that of sliding, relative to it",
        bounds=(0.0, 20.0),
        default=0.0,
    )
    stribeck_speed: float = parameter(
        "rad/s", "w_s", "speed at which half of the excess is left", bounds=(1e-3, 1e3), default=1.0
    )
    presliding_angle: float = parameter(
        "rad",
        "theta_s",
        "angle over which the bristle deflects before sliding",
        bounds=(1e-5, 1.0),
        default=2e-3,
    )
    bearing_arms: tuple[float, ...] = parameter(
        "m",
        "r_k",
        "friction torque per force across the axis of the joint, and along it",
        bounds=(0.0, 10.0),
        default=(),
    )
    turnover_time: float = parameter(
        "s",
        "tau",
        "shortest time in which the bristle turns over",
        bounds=(1e-5, 0.1),
        fitted=False,
        default=2e-3,
    )

    def level(self, load: Value, speed: Value) -> Value:
        """Friction torque [N m] in sliding at an angular speed [rad/s]; `load` is the sum of mu_i
        F_i [N m].
        """
        return (self.coulomb_torque + load) * (
            1.0 + self.static_excess / (1.0 + (speed / self.stribeck_speed) ** 2)
        )

    def torque(self, bristle: Value, load: Value, speed: Value) -> Value:
        """Friction torque [N m] on the joint, positive in the direction of the angle."""
        fast = self.turnover_time / self.presliding_angle
        share = (bristle + fast * speed) / (1.0 + fast * ops.absolute_value(speed))
        return 0.0 - self.level(load, speed) * share

    def energy_account(self, bristle: Value, load: Value, speed: Value) -> EnergyAccount:
        """The energy of the bristle, the power of the joint into the friction, and its heat, 0 or
        more.
        """
        stiffness = self.level(load, speed) * self.presliding_angle
        received = 0.0 - self.torque(bristle, load, speed) * speed
        growth = stiffness * bristle * self.bristle_rate(bristle, speed)
        return EnergyAccount(0.5 * stiffness * bristle**2, received, received - growth)

    def bristle_rate(self, bristle: Value, speed: Value) -> Value:
        """Time derivative of the relative deflection of the bristle [1/s]."""
        magnitude = ops.absolute_value(speed)
        return (speed - magnitude * bristle) / (
            self.presliding_angle + self.turnover_time * magnitude
        )


@model
class GaussianResidual:
    """Torques and friction that physics leaves, as Gaussian functions of angles and pressures,
    which fade out.

        phi_k = exp(-sum_i (x_i/s_i - c_ki)^2/(2 d)),   tau_j = -dV/dtheta_j,   V = sum_k E_k phi_k,
        T_j = f_j T_j,physics,   f_j = exp(sum_k g_jk phi_k)

    x the J angles of a mechanism and the gauge pressures `pressures` (names in a plant,
    `m0.pressure`), d their number. Passive at constant pressures: V is then a bounded
    potential of the angles, whose torques give no energy in a closed cycle, and the friction,
    multiplied by a positive factor, takes some. Where the pressures follow the angles, as those of
    shut air do, a closed cycle gives the integral of dV/dp dp, of either sign. The air would pay
    for it if it had the further volume -dV/dp_i in muscle i (Maxwell relation: dtau_j/dp_i is then
    the slope of that volume by theta_j). Pressure would follow from an equation that has no
    explicit solution, so that a Plant does not have this volume and refuses the residual unless its
    circuits hold the pressures (`Circuit.holds_pressure`). The meters of a plant book what the
    changes of the pressures give: `residual_energy_unpaid`. Far from all centres tau is 0 and f is
    1: the physics alone. A caller who gives angles without pressures has the residual at the mean
    of its centres. The form is chosen.
    """

    pressures: tuple[str, ...]
    angle_scales: tuple[float, ...] = parameter(
        "rad", "s_i", "scale of each angle", bounds=(1e-6, 1e3), fitted=False
    )
    pressure_scales: tuple[float, ...] = parameter(
        "Pa", "s_i", "scale of each pressure", bounds=(1.0, 1e8), fitted=False
    )
    centres: tuple[float, ...] = parameter(
        "1",
        "c_ki",
        "centres relative to the scales, one after the other",
        bounds=(-1e3, 1e3),
        fitted=False,
    )
    energies: tuple[float, ...] = parameter("J", "E_k", "energy of each centre", bounds=(-1e4, 1e4))
    friction_logs: tuple[float, ...] = parameter(
        "1",
        "g_jk",
        "logarithmic factor of the friction of each centre, joint after joint",
        bounds=(-10.0, 10.0),
    )

    def check(self) -> None:
        count = len(self.energies)
        joints = len(self.angle_scales)
        wanted = (len(self.pressures), count * (joints + len(self.pressures)), count * joints)
        sizes = (len(self.pressure_scales), len(self.centres), len(self.friction_logs))
        if sizes != wanted or not count:
            raise ParameterError(
                f"GaussianResidual: {count} energies, {joints} angle_scales and"
                f" {len(self.pressures)} pressures need {wanted[0]} pressure_scales, {wanted[1]}"
                f" centres and {wanted[2]} friction_logs; there are {sizes[0]}, {sizes[1]} and"
                f" {sizes[2]}."
            )

    def evaluate(self, angles: Sequence[Value], q: Values) -> tuple[list[Value], list[Value]]:
        """Torque [N m] on every joint and the factor of its friction, at its angles [rad] and the
        pressures in q.
        """
        joints = len(angles)
        count = len(self.energies)
        torques: list[Value] = [0.0] * joints
        logs: list[Value] = [0.0] * joints
        levels = self._levels(angles, q)
        for k in range(count):
            level, away = levels[k]
            stiffness = self.energies[k] * level / self._size
            for j in range(joints):
                torques[j] = torques[j] + stiffness * away[j] / self.angle_scales[j]
                logs[j] = logs[j] + self.friction_logs[j * count + k] * level
        return torques, [ops.exp(log) for log in logs]

    def potential(self, angles: Sequence[Value], q: Values) -> Value:
        """Potential V [J] at the angles [rad] and the pressures in q."""
        levels = self._levels(angles, q)
        return sum(energy * level for energy, (level, _) in zip(self.energies, levels, strict=True))

    @property
    def _size(self) -> int:
        return len(self.angle_scales) + len(self.pressures)

    def _levels(self, angles: Sequence[Value], q: Values) -> list[tuple[Value, list[Value]]]:
        """Value phi_k of each Gaussian function, and the distances from its centre relative to the
        scales.
        """
        size = self._size
        place: list[Value] = []
        for angle, scale in zip(angles, self.angle_scales, strict=True):
            place.append(angle / scale)
        for name, scale in zip(self.pressures, self.pressure_scales, strict=True):
            if name in q:
                place.append(q[name] / scale)
            else:
                column = self.centres[len(place) :: size]
                place.append(sum(column) / len(self.energies))
        levels: list[tuple[Value, list[Value]]] = []
        for k in range(len(self.energies)):
            centre = self.centres[size * k : size * (k + 1)]
            away = [x - c for x, c in zip(place, centre, strict=True)]
            distance = sum(a * a for a in away)
            levels.append((ops.exp(-distance / (2.0 * size)), away))
        return levels


@model
class WithStickSlip(ForceWrapper):
    """Mechanism whose joints have the friction of `elements`, one for each of its angles; the
    bristles are states.

    Equilibria are those with relaxed bristles. A caller of `acceleration` who gives torques alone
    has the friction without load. A `residual` adds its torques to those of the muscles and
    multiplies the friction.
    """

    inner: Mechanism
    elements: tuple[StickSlip, ...]
    residual: GaussianResidual | None = None

    def check(self) -> None:
        angles = self._angles
        owner = type(self.inner).__name__
        if len(angles) != len(self.elements) or not angles:
            raise ParameterError(
                f"WithStickSlip: {owner} has {len(angles)} angles and {len(self.elements)} elements"
                " are given; give one for each angle."
            )
        if {_bristle(c) for c in angles} & {state.name for state in self.inner.inner_states}:
            raise ParameterError(
                f"WithStickSlip: {owner} has the bristles of a WithStickSlip already. Give one"
                " WithStickSlip with one element for each angle, whose torques are the sums."
            )
        if self.residual is not None and len(self.residual.angle_scales) != len(angles):
            raise ParameterError(
                f"WithStickSlip: the residual has {len(self.residual.angle_scales)} angles, {owner}"
                f" has {len(angles)}; give one scale for each angle."
            )
        for element in self.elements:
            if len(element.bearing_arms) > 2 * isinstance(self.inner, SerialArm):
                raise ParameterError(
                    f"WithStickSlip: {len(element.bearing_arms)} bearing_arms are given for a joint"
                    f" of {owner}; a SerialArm takes one or two, across and along the axis, any"
                    " other mechanism none."
                )
            if element.load_arms and self.muscle_count not in (None, len(element.load_arms)):
                raise ParameterError(
                    f"WithStickSlip: {owner} takes {self.muscle_count} muscles, and"
                    f" {len(element.load_arms)} load_arms are given; give one for each muscle, or"
                    " none."
                )

    @property
    def _angles(self) -> list[Coordinate]:
        return [c for c in self.inner.coordinates if c.unit == "rad"]

    @property
    def inner_states(self) -> tuple[StateVariable, ...]:
        bristles = (
            StateVariable(_bristle(c), "1", 1.0, f"bristle of the friction of {c.name}")
            for c in self._angles
        )
        return (*self.inner.inner_states, *bristles)

    def inner_rates(self, q: Values, v: Values, forces: Values) -> dict[str, Value]:
        joints = zip(self._angles, self.elements, strict=True)
        rates = {
            _bristle(c): element.bristle_rate(q.get(_bristle(c), 0.0), v[c.speed])
            for c, element in joints
        }
        return {**self.inner.inner_rates(q, v, forces), **rates}

    def generalised_forces(
        self, q: Values, tensions: Sequence[Value], resting_lengths: Sequence[Value]
    ) -> Values:
        """Those of the inner mechanism, and for each angle the load of its friction [N m]; with the
        residual.
        """
        forces = dict(self.inner.generalised_forces(q, tensions, resting_lengths))
        for c, element in zip(self._angles, self.elements, strict=True):
            forces[friction_load(c)] = sum(
                (mu * t for mu, t in zip(element.load_arms, tensions, strict=False)), 0.0
            )
        if self.residual is not None:
            further = zip(
                *self.residual.evaluate([q[c.name] for c in self._angles], q), strict=True
            )
            for c, element, (torque, factor) in zip(
                self._angles, self.elements, further, strict=True
            ):
                forces[c.name] = forces[c.name] + torque
                loaded = element.coulomb_torque + forces[friction_load(c)]
                forces[friction_load(c)] = factor * loaded - element.coulomb_torque
        return forces

    def with_own_forces(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        return self._with_friction(q, v, self._with_bearings(q, v, forces, inputs))

    def bearing_load(self, joint: int, q: Values, v: Values, accelerations: Values) -> Value:
        """Friction torque [N m] of a joint, from 0, by its bearing, at the accelerations of the
        other joints.
        """
        without_joint = {**accelerations, self._angles[joint].name: 0.0}
        forces = cast(SerialArm, self.inner).bearing_force(joint, q, v, without_joint)
        return sum(
            r * force for r, force in zip(self.elements[joint].bearing_arms, forces, strict=False)
        )

    def _with_bearings(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        """The forces, in whose friction loads are those of the bearings."""
        loaded = {
            j: friction_load(c) for j, c in enumerate(self._angles) if self.elements[j].bearing_arms
        }
        if not loaded:
            return forces
        free = self.inner.acceleration(q, v, self._with_friction(q, v, forces), inputs)
        loads = {
            name: forces.get(name, 0.0) + self.bearing_load(j, q, v, free)
            for j, name in loaded.items()
        }
        return {**forces, **loads}

    def _with_friction(self, q: Values, v: Values, forces: Values) -> dict[str, Value]:
        return {
            **forces,
            **{c.name: forces[c.name] + torque for c, torque in self._friction(q, v, forces)},
        }

    def _friction(self, q: Values, v: Values, forces: Values) -> list[tuple[Coordinate, Value]]:
        return [
            (
                c,
                element.torque(
                    q.get(_bristle(c), 0.0), forces.get(friction_load(c), 0.0), v[c.speed]
                ),
            )
            for c, element in zip(self._angles, self.elements, strict=True)
        ]

    @property
    def needs_held_pressures(self) -> bool:
        return self.residual is not None or self.inner.needs_held_pressures

    @property
    def account_names(self) -> tuple[str, ...]:
        residual = () if self.residual is None else (RESIDUAL,)
        return (BRISTLE, *residual, *self.inner.account_names)

    def energy_accounts(
        self, q: Values, v: Values, forces: Values, inputs: Values
    ) -> Mapping[str, EnergyAccount]:
        """The bristles of all joints, the residual, and the stores of the inner mechanism."""
        loaded = self._with_bearings(q, v, forces, inputs)
        bristles = [
            element.energy_account(
                q.get(_bristle(c), 0.0), loaded.get(friction_load(c), 0.0), v[c.speed]
            )
            for c, element in zip(self._angles, self.elements, strict=True)
        ]
        accounts = {BRISTLE: EnergyAccount(*map(sum, zip(*bristles, strict=True)))}
        if self.residual is not None:
            angles = [q[c.name] for c in self._angles]
            torques, _ = self.residual.evaluate(angles, q)
            given = sum(
                torque * v[c.speed] for c, torque in zip(self._angles, torques, strict=True)
            )
            accounts[RESIDUAL] = EnergyAccount(self.residual.potential(angles, q), -given, 0.0)
        on_inner = self._with_friction(q, v, loaded)
        return {**self.inner.energy_accounts(q, v, on_inner, inputs), **accounts}

    def own_loss(self, q: Values, v: Values, forces: Values, inputs: Values) -> Value:
        """Power [W] that friction takes, less that of the torques of the residual."""
        forces = self._with_bearings(q, v, forces, inputs)
        taken = -sum(torque * v[c.speed] for c, torque in self._friction(q, v, forces))
        if self.residual is None:
            return taken
        torques, _ = self.residual.evaluate([q[c.name] for c in self._angles], q)
        return taken - sum(
            torque * v[c.speed] for c, torque in zip(self._angles, torques, strict=True)
        )


def _bristle(coordinate: Coordinate) -> str:
    return f"{coordinate.name.removesuffix('angle')}friction_bristle"


def friction_load(coordinate: Coordinate) -> str:
    """Name, among the generalised forces, of the load of the friction of an angle [N m]."""
    return f"{coordinate.name}.friction_load"

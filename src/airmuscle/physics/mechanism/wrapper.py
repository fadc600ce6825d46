"""Wrappers of a mechanism: latch, contraction offsets, friction of a joint, torque from outside."""

import abc
import itertools
from collections.abc import Mapping, Sequence
from typing import ClassVar

from ...core import Input, ParameterError, Value, Values, model, ops, parameter
from ...core.declaration import forwarded
from .base import Coordinate, EnergyAccount, Mechanism, gravity_parameter


class MechanismWrapper(Mechanism):
    """Wrapper that forwards everything to the inner mechanism; subclasses override forces or
    contractions.
    """

    inner: Mechanism

    coordinates = forwarded("inner.coordinates")
    inputs = forwarded("inner.inputs")
    muscle_count = forwarded("inner.muscle_count")
    inner_states = forwarded("inner.inner_states")
    inner_rates = forwarded("inner.inner_rates")
    contractions = forwarded("inner.contractions")
    contraction_speeds = forwarded("inner.contraction_speeds")
    generalised_forces = forwarded("inner.generalised_forces")
    acceleration = forwarded("inner.acceleration")
    dissipated_power = forwarded("inner.dissipated_power")
    potential_energy = forwarded("inner.potential_energy")
    kinetic_energy = forwarded("inner.kinetic_energy")
    account_names = forwarded("inner.account_names")
    energy_accounts = forwarded("inner.energy_accounts")
    needs_held_pressures = forwarded("inner.needs_held_pressures")


@model
class WithLatch(MechanismWrapper):
    """Mechanism with a latch: while the input `latched` is 1, all accelerations are 0; at 0 the
    mechanism is free.

    The latch carries the unbalanced forces. Start the simulation at rest and switch the input in a
    single step.
    """

    inner: Mechanism

    @property
    def inputs(self) -> tuple[Input, ...]:
        return (Input("latched", meaning="1 latched, 0 released"), *self.inner.inputs)

    def acceleration(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        free = self.inner.acceleration(q, v, forces, inputs)
        return {name: (1.0 - inputs["latched"]) * value for name, value in free.items()}


@model
class WithOffsets(MechanismWrapper):
    """Contraction offsets: eps_i = eps_0i + eps_i,inner; a negative offset is a pre-stretch."""

    inner: Mechanism
    offsets: tuple[float, ...] = parameter(
        "1", "eps_0i", "contraction offset of each muscle", bounds=(-0.5, 0.9)
    )

    def check(self) -> None:
        if self.inner.muscle_count not in (None, len(self.offsets)):
            raise ParameterError(
                f"WithOffsets: {type(self.inner).__name__} takes {self.inner.muscle_count} muscles;"
                f" {len(self.offsets)} offsets are given. Give one for each muscle."
            )

    @property
    def muscle_count(self) -> int | None:
        return len(self.offsets)

    def contractions(self, q: Values, resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        inner = self.inner.contractions(q, resting_lengths)
        return tuple(
            offset + contraction for offset, contraction in zip(self.offsets, inner, strict=True)
        )


class ForceWrapper(MechanismWrapper):
    """Wrapper that adds generalised forces to those of the muscles on its inner mechanism (base
    class).
    """

    @abc.abstractmethod
    def with_own_forces(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        """The forces on the inner mechanism: those of the muscles with those of this wrapper."""

    @abc.abstractmethod
    def own_loss(self, q: Values, v: Values, forces: Values, inputs: Values) -> Value:
        """Power [W] that leaves the mechanism through this wrapper, at these forces of the
        muscles.
        """

    def acceleration(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        return self.inner.acceleration(q, v, self.with_own_forces(q, v, forces, inputs), inputs)

    def energy_accounts(
        self, q: Values, v: Values, forces: Values, inputs: Values
    ) -> Mapping[str, EnergyAccount]:
        on_inner = self.with_own_forces(q, v, forces, inputs)
        return self.inner.energy_accounts(q, v, on_inner, inputs)

    def dissipated_power(self, q: Values, v: Values, forces: Values, inputs: Values) -> Value:
        inner = self.inner.dissipated_power(
            q, v, self.with_own_forces(q, v, forces, inputs), inputs
        )
        return inner + self.own_loss(q, v, forces, inputs)


class CoordinateWrapper(ForceWrapper):
    """Wrapper that acts on one coordinate, which is named if several have its unit (base class)."""

    coordinate: str
    unit: ClassVar[str]
    what: ClassVar[str]
    """What acts on the coordinate, in messages."""

    def check(self) -> None:
        name = type(self).__name__
        inner = type(self.inner).__name__
        unit = self.unit
        candidates = [c.name for c in self.inner.coordinates if c.unit == unit]
        if self.coordinate and self.coordinate not in candidates:
            raise ParameterError(
                f"{name}: no coordinate '{self.coordinate}' in {unit}; {inner} has"
                f" {', '.join(candidates) or 'none'}."
            )
        if not candidates:
            raise ParameterError(
                f"{name}: {inner} has no coordinate in {unit}; use another mechanism."
            )
        if not self.coordinate and len(candidates) > 1:
            raise ParameterError(
                f"{name}: {inner} has {len(candidates)} coordinates in {unit}; set coordinate to"
                f" the one with {self.what}: {' or '.join(candidates)}."
            )

    @property
    def acted_on(self) -> Coordinate:
        """The coordinate on which the wrapper acts."""
        return next(
            c
            for c in self.inner.coordinates
            if c.unit == self.unit and self.coordinate in ("", c.name)
        )


@model
class JointWithFriction(CoordinateWrapper):
    """Regularised Coulomb friction of a joint: Q_f = -T_c w/sqrt(w^2 + w_0^2).

    w angular speed, T_c friction torque, w_0 regularising speed: above about 3 w_0 the torque is
    within 5 % of T_c. The friction torque is zero at rest, so that a joint under load creeps with a
    speed below w_0 instead of sticking; equilibria are those without friction. Viscous friction is
    a parameter of the inner mechanism.
    """

    inner: Mechanism
    friction_torque: float = parameter("N m", "T_c", "friction torque", bounds=(0.0, 1e4))
    regularising_speed: float = parameter(
        "rad/s", "w_0", "regularising speed", bounds=(1e-6, 10.0), fitted=False, default=0.01
    )
    coordinate: str = ""
    """Name of the angle with friction; required if several coordinates are angles."""

    unit: ClassVar[str] = "rad"
    what: ClassVar[str] = "friction"

    def friction(self, angular_speed: Value) -> Value:
        """Generalised friction force [N m] at an angular speed [rad/s]."""
        return (
            -self.friction_torque
            * angular_speed
            / ops.sqrt(angular_speed**2 + self.regularising_speed**2)
        )

    def with_own_forces(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        name = self.acted_on.name
        return {**forces, name: forces[name] + self.friction(v[self.acted_on.speed])}

    def own_loss(self, q: Values, v: Values, forces: Values, inputs: Values) -> Value:
        speed = v[self.acted_on.speed]
        return -self.friction(speed) * speed


@model
class JointWithExternalTorque(ForceWrapper):
    """M theta'' = Q + tau_e: the input `external_torque` tau_e adds to the torque Q of the muscles
    on a joint.

    It is a load that is picked up, a push, or the torque of a test bench; positive in the direction
    of the angle. Its power is part of the power that leaves the mechanism. The mechanism has one
    coordinate, an angle.
    """

    inner: Mechanism

    def check(self) -> None:
        coordinates = self.inner.coordinates
        if len(coordinates) != 1 or coordinates[0].unit != "rad":
            names = ", ".join(f"{c.name} [{c.unit}]" for c in coordinates) or "none"
            raise ParameterError(
                f"JointWithExternalTorque: the coordinates of {type(self.inner).__name__} are"
                f" {names}; it needs a mechanism with one angle, such as AntagonisticJoint."
            )

    @property
    def inputs(self) -> tuple[Input, ...]:
        torque = Input("external_torque", "N m", -1e4, 1e4, "torque on the joint from outside")
        return (torque, *self.inner.inputs)

    def with_own_forces(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        name = self.inner.coordinates[0].name
        return {**forces, name: forces[name] + inputs["external_torque"]}

    def own_loss(self, q: Values, v: Values, forces: Values, inputs: Values) -> Value:
        return -inputs["external_torque"] * v[self.inner.coordinates[0].speed]


@model
class MusclesInSeries(MechanismWrapper):
    """Muscles in series: m_i x_i'' = F_i - F_(i+1) - m_i g - d x_i' for each node; the last muscle
    acts on `inner`.

        L_i eps_i = x_i - x_(i-1),   x_0 = 0,   x_n = L eps(q) of the inner mechanism, with L = sum
                                     L_i

    x_i displacement of node i towards the first fitting from the position at which all muscles have
    their resting lengths, m_i node mass, d damping coefficient of the nodes. The chain acts on the
    inner mechanism like one muscle of resting length L.
    """

    inner: Mechanism
    node_masses: tuple[float, ...] = parameter("kg", "m_i", "mass of each node", bounds=(1e-4, 1e4))
    damping: float = parameter(
        "N s/m", "d", "damping coefficient of each node", bounds=(0.0, 1e6), default=0.0
    )
    gravity: float = gravity_parameter()

    def check(self) -> None:
        if not self.node_masses:
            raise ParameterError(
                "MusclesInSeries: node_masses is empty; give the mass of each node. Two muscles"
                " have one node."
            )
        if self.inner.muscle_count not in (None, 1):
            raise ParameterError(
                "MusclesInSeries: the inner mechanism must take one muscle, because the chain acts"
                f" like one; {type(self.inner).__name__} takes {self.inner.muscle_count}."
            )

    @property
    def muscle_count(self) -> int | None:
        return len(self.node_masses) + 1

    @property
    def nodes(self) -> tuple[Coordinate, ...]:
        """Coordinates of the nodes."""
        count = range(1, len(self.node_masses) + 1)
        return tuple(
            Coordinate(f"node{i}.position", f"node{i}.speed", "m", 0.01, 0.1) for i in count
        )

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        return (*self.nodes, *self.inner.coordinates)

    def contractions(self, q: Values, resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        total = sum(resting_lengths)
        (last,) = self.inner.contractions(q, [total])
        positions = [0.0, *(q[node.name] for node in self.nodes), total * last]
        return tuple(
            (positions[i + 1] - positions[i]) / length for i, length in enumerate(resting_lengths)
        )

    def contraction_speeds(
        self, q: Values, v: Values, resting_lengths: Sequence[Value]
    ) -> tuple[Value, ...]:
        speeds = [0.0, *(v[node.speed] for node in self.nodes)]
        speeds += self.inner.contraction_speeds(q, v, [sum(resting_lengths)])
        return tuple(after - before for before, after in itertools.pairwise(speeds))

    def generalised_forces(
        self, q: Values, tensions: Sequence[Value], resting_lengths: Sequence[Value]
    ) -> Values:
        nodes = {node.name: tensions[i] - tensions[i + 1] for i, node in enumerate(self.nodes)}
        return {**nodes, **self.inner.generalised_forces(q, tensions[-1:], [sum(resting_lengths)])}

    def acceleration(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        nodes = {
            node.name: (forces[node.name] - self.damping * v[node.speed]) / mass - self.gravity
            for node, mass in zip(self.nodes, self.node_masses, strict=True)
        }
        return {**nodes, **self.inner.acceleration(q, v, forces, inputs)}

    def dissipated_power(self, q: Values, v: Values, forces: Values, inputs: Values) -> Value:
        nodes = sum(self.damping * v[node.speed] ** 2 for node in self.nodes)
        return nodes + self.inner.dissipated_power(q, v, forces, inputs)

    def potential_energy(self, q: Values) -> Value:
        mass_moment = sum(
            mass * q[node.name] for node, mass in zip(self.nodes, self.node_masses, strict=True)
        )
        return self.gravity * mass_moment + self.inner.potential_energy(q)

    def kinetic_energy(self, q: Values, v: Values) -> Value:
        nodes = sum(
            0.5 * mass * v[node.speed] ** 2
            for node, mass in zip(self.nodes, self.node_masses, strict=True)
        )
        return nodes + self.inner.kinetic_energy(q, v)

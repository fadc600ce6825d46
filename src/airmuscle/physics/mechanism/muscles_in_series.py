"""Muscles in series, with a mass at each connection node."""

import itertools
from collections.abc import Sequence

from ...core import STANDARD_GRAVITY, ParameterError, Value, Values, check_structure, model, parameter
from .base import Coordinate, Mechanism
from .wrapper import MechanismWrapper


@model
class MusclesInSeries(MechanismWrapper):
    """Muscles in series: m_i x_i'' = F_i - F_(i+1) - m_i g - d x_i' for each node; the last muscle acts on `inner`.

        L_i eps_i = x_i - x_(i-1),   x_0 = 0,   x_n = L eps(q) of the inner mechanism, with L = sum L_i

    x_i displacement of node i towards the first fitting from the position at which all muscles have their resting
    lengths, m_i node mass, d damping coefficient of the nodes. The chain acts on the inner mechanism like one muscle of
    resting length L.
    """

    inner: Mechanism
    node_masses: tuple[float, ...] = parameter("kg", "m_i", "mass of each node", bounds=(1e-4, 1e4))
    damping: float = parameter("N s/m", "d", "damping coefficient of each node", bounds=(0.0, 1e6), default=0.0)
    gravity: float = parameter(
        "m/s^2", "g", "acceleration of gravity", bounds=(0.0, 20.0), fitted=False, default=STANDARD_GRAVITY
    )

    def check(self) -> None:
        check_structure(self)
        if not self.node_masses:
            raise ParameterError(
                "MusclesInSeries: node_masses is empty; give the mass of each node. Two muscles have one node."
            )
        if self.inner.muscle_count not in (None, 1):
            raise ParameterError(
                "MusclesInSeries: the inner mechanism must take one muscle, because the chain acts like one; "
                f"{type(self.inner).__name__} takes {self.inner.muscle_count}."
            )

    @property
    def muscle_count(self) -> int | None:
        return len(self.node_masses) + 1

    @property
    def nodes(self) -> tuple[Coordinate, ...]:
        """Coordinates of the nodes."""
        count = range(1, len(self.node_masses) + 1)
        return tuple(Coordinate(f"node{i}.position", f"node{i}.speed", "m", 0.01, 0.1) for i in count)

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        return (*self.nodes, *self.inner.coordinates)

    def contractions(self, q: Values, resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        total = sum(resting_lengths)
        (last,) = self.inner.contractions(q, [total])
        positions = [0.0, *(q[node.name] for node in self.nodes), total * last]
        return tuple((positions[i + 1] - positions[i]) / length for i, length in enumerate(resting_lengths))

    def contraction_speeds(self, q: Values, v: Values, resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        speeds = [0.0, *(v[node.speed] for node in self.nodes)]
        speeds += self.inner.contraction_speeds(q, v, [sum(resting_lengths)])
        return tuple(after - before for before, after in itertools.pairwise(speeds))

    def generalised_forces(
        self, q: Values, tensions: Sequence[Value], resting_lengths: Sequence[Value]
    ) -> dict[str, Value]:
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
        mass_moment = sum(mass * q[node.name] for node, mass in zip(self.nodes, self.node_masses, strict=True))
        return self.gravity * mass_moment + self.inner.potential_energy(q)

    def kinetic_energy(self, q: Values, v: Values) -> Value:
        nodes = sum(0.5 * mass * v[node.speed] ** 2 for node, mass in zip(self.nodes, self.node_masses, strict=True))
        return nodes + self.inner.kinetic_energy(q, v)

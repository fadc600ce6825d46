"""Several muscles one after the other, with a mass at each place where two of them meet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..core.constants import STANDARD_GRAVITY
from ..core.declaration import check_structure, model, parameter
from ..core.errors import ParameterError
from ..core.ops import Value
from .base import Coordinate, Mechanism
from .wrapper import MechanismWrapper


@model
class MusclesInSeries(MechanismWrapper):
    """m_i x_i'' = F_i - F_(i+1) - m_i g - d x_i' for every node, and the inner mechanism under the last muscle.

        L_i eps_i = x_i - x_(i-1),   x_0 = 0,   x_n = L eps(q) of the inner mechanism, with L = sum L_i

    x_i way of node i towards the first fitting, from where all muscles have their resting lengths; m_i its mass, d
    damping of the nodes. The chain pulls at the inner mechanism as one muscle of length L would.
    """

    inner: Mechanism
    node_masses: tuple[float, ...] = parameter("kg", "m_i", "mass of each node between two muscles", bounds=(1e-4, 1e4))
    damping: float = parameter("N s/m", "d", "damping coefficient of every node", bounds=(0.0, 1e6), default=0.0)
    gravity: float = parameter(
        "m/s^2", "g", "acceleration of gravity", bounds=(0.0, 20.0), fitted=False, default=STANDARD_GRAVITY
    )

    def check(self) -> None:
        check_structure(self)
        if not self.node_masses:
            raise ParameterError("MusclesInSeries: give the mass of each node; two muscles have one node between them.")
        if self.inner.muscles not in (None, 1):
            raise ParameterError(
                f"MusclesInSeries: the inner mechanism must take one muscle, as which the chain acts; "
                f"{type(self.inner).__name__} takes {self.inner.muscles}."
            )

    @property
    def muscles(self) -> int | None:
        return len(self.node_masses) + 1

    @property
    def nodes(self) -> tuple[Coordinate, ...]:
        """The coordinates of the nodes."""
        count = range(1, len(self.node_masses) + 1)
        return tuple(Coordinate(f"node{i}.position", f"node{i}.speed", "m", 0.01, 0.1) for i in count)

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        return (*self.nodes, *self.inner.coordinates)

    def contractions(self, q: Mapping[str, Value], resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        total = sum(resting_lengths)
        (last,) = self.inner.contractions(q, [total])
        places = [0.0, *(q[node.name] for node in self.nodes), total * last]
        return tuple((places[i + 1] - places[i]) / length for i, length in enumerate(resting_lengths))

    def generalised_forces(
        self, q: Mapping[str, Value], tensions: Sequence[Value], resting_lengths: Sequence[Value]
    ) -> dict[str, Value]:
        nodes = {node.name: tensions[i] - tensions[i + 1] for i, node in enumerate(self.nodes)}
        return {**nodes, **self.inner.generalised_forces(q, tensions[-1:], [sum(resting_lengths)])}

    def acceleration(
        self, q: Mapping[str, Value], v: Mapping[str, Value], pulls: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        nodes = {
            node.name: (pulls[node.name] - self.damping * v[node.speed]) / mass - self.gravity
            for node, mass in zip(self.nodes, self.node_masses, strict=True)
        }
        return {**nodes, **self.inner.acceleration(q, v, pulls, inputs)}

    def dissipated_power(
        self, q: Mapping[str, Value], v: Mapping[str, Value], pulls: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Value:
        own = sum(self.damping * v[node.speed] ** 2 for node in self.nodes)
        return own + self.inner.dissipated_power(q, v, pulls, inputs)

    def potential_energy(self, q: Mapping[str, Value]) -> Value:
        lifted = sum(mass * q[node.name] for node, mass in zip(self.nodes, self.node_masses, strict=True))
        return self.gravity * lifted + self.inner.potential_energy(q)

    def kinetic_energy(self, q: Mapping[str, Value], v: Mapping[str, Value]) -> Value:
        own = sum(0.5 * mass * v[node.speed] ** 2 for node, mass in zip(self.nodes, self.node_masses, strict=True))
        return own + self.inner.kinetic_energy(q, v)

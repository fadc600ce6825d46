"""A mechanism in generalised coordinates: how far it shortens each muscle, and how it moves under their pull."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Mapping, Sequence

from ..core import autodiff
from ..core.ops import Value
from ..core.variables import Input

INFINITY = float("inf")


@dataclasses.dataclass(frozen=True)
class Coordinate:
    """One generalised coordinate with the name of its speed; `nominal` are sizes below which errors do not matter.

    `least` and `greatest` say where a search for rest may look; they are no stops.
    """

    name: str
    speed: str
    unit: str
    nominal: float
    nominal_speed: float
    lower_limit: float = -INFINITY
    upper_limit: float = INFINITY

    @property
    def acceleration(self) -> str:
        """The name of its acceleration: that of its speed with the one word for the other."""
        found = self.speed.replace("speed", "acceleration")
        return found if found != self.speed else f"{self.name}.acceleration"


class Mechanism(abc.ABC):
    """What muscles pull at. Coordinates q and speeds v are mappings by the names of `coordinates`."""

    @property
    @abc.abstractmethod
    def coordinates(self) -> tuple[Coordinate, ...]:
        """The generalised coordinates, in order."""

    @property
    def inputs(self) -> tuple[Input, ...]:
        """The inputs that act on the mechanism."""
        return ()

    @property
    def muscles(self) -> int | None:
        """How many muscles it takes; None for any number."""
        return None

    @abc.abstractmethod
    def contractions(self, q: Mapping[str, Value], resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        """Contraction [1] of every muscle, of resting lengths [m], at coordinates q."""

    def contraction_speeds(
        self, q: Mapping[str, Value], v: Mapping[str, Value], resting_lengths: Sequence[Value]
    ) -> tuple[Value, ...]:
        """Speed of shortening [m/s] of every muscle, derived from `contractions`."""
        names = [c.name for c in self.coordinates]
        if not names:
            return tuple(0.0 for _ in resting_lengths)
        rates = autodiff.jvp(
            lambda x: self.contractions(dict(zip(names, x, strict=True)), resting_lengths),
            [q[name] for name in names],
            [v[c.speed] for c in self.coordinates],
        )
        return tuple(length * rate for length, rate in zip(resting_lengths, rates, strict=True))

    def generalised_forces(
        self, q: Mapping[str, Value], tensions: Sequence[Value], resting_lengths: Sequence[Value]
    ) -> dict[str, Value]:
        """Generalised force of the muscles' tensions [N] on every coordinate: virtual work, J^T F, from `contractions`.

        Newtons for a coordinate in metres, newton metres for an angle.
        """
        names = [c.name for c in self.coordinates]
        if not names:
            return {}
        found = autodiff.vjp(
            lambda x: self.contractions(dict(zip(names, x, strict=True)), resting_lengths),
            [q[name] for name in names],
            [tension * length for tension, length in zip(tensions, resting_lengths, strict=True)],
        )
        return dict(zip(names, found, strict=True))

    @abc.abstractmethod
    def acceleration(
        self, q: Mapping[str, Value], v: Mapping[str, Value], pulls: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        """Acceleration of every coordinate under the generalised forces `pulls` and the mechanism's own."""

    def dissipated_power(
        self, q: Mapping[str, Value], v: Mapping[str, Value], pulls: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Value:
        """Power [W] that leaves it otherwise than to the muscles: by its own dampers, stops and drives."""
        return 0.0

    def potential_energy(self, q: Mapping[str, Value]) -> Value:
        """Energy of position [J]."""
        return 0.0

    def kinetic_energy(self, q: Mapping[str, Value], v: Mapping[str, Value]) -> Value:
        """Energy of motion [J]."""
        return 0.0

"""Mechanism (interface) in generalised coordinates: muscle contractions and equations of motion."""

import abc
import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from ...core import STANDARD_GRAVITY, Input, StateVariable, Value, Values, autodiff, parameter
from ...core.declaration import forwarded

INFINITY = float("inf")


def gravity_parameter() -> Any:
    """Declare the acceleration of gravity of a mechanism."""
    return parameter(
        "m/s^2",
        "g",
        "acceleration of gravity",
        bounds=(0.0, 20.0),
        fitted=False,
        default=STANDARD_GRAVITY,
    )


def angle_limit(symbol: str, meaning: str, default: float) -> Any:
    """Declare a limit of an angle [rad], which is not fitted."""
    return parameter("rad", symbol, meaning, bounds=(-10.0, 10.0), fitted=False, default=default)


@dataclasses.dataclass(frozen=True)
class Coordinate:
    """One generalised coordinate and the name of its speed.

    `nominal` and `nominal_speed` are the scales of the absolute tolerances. `lower_limit` and
    `upper_limit` bound the search for equilibria; they are not end stops.
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
        """Name of the acceleration: the name of the speed with "acceleration" instead of
        "speed".
        """
        name = self.speed.replace("speed", "acceleration")
        return name if name != self.speed else f"{self.name}.acceleration"

    @property
    def states(self) -> tuple[StateVariable, StateVariable]:
        """The coordinate and its speed, as states of a plant."""
        return (
            StateVariable(self.name, self.unit, self.nominal, f"{self.name} of the load"),
            StateVariable(
                self.speed, f"{self.unit}/s", self.nominal_speed, f"{self.speed} of the load"
            ),
        )


class EnergyAccount(NamedTuple):
    """A store of energy in a mechanism whose law depends on a further quantity, such as a load or
    a pressure: the energy in it [J], the power of the motion into it and the power that becomes
    heat [W].

    What the energy grows by beyond the powers, nothing pays: the further quantity has changed.
    """

    stored: Value
    received: Value
    dissipated: Value


class Mechanism(abc.ABC):
    """Mechanical load of one or more muscles (interface).

    Coordinates q and speeds v are mappings from the names in `coordinates` to values.
    """

    @property
    @abc.abstractmethod
    def coordinates(self) -> tuple[Coordinate, ...]:
        """Generalised coordinates, in order."""

    @property
    def inputs(self) -> tuple[Input, ...]:
        """Inputs of the mechanism."""
        return ()

    @property
    def muscle_count(self) -> int | None:
        """Number of muscles that act on the mechanism; None for any number."""
        return None

    @property
    def inner_states(self) -> tuple[StateVariable, ...]:
        """States besides coordinates and speeds, 0 when relaxed, such as the bristles of a
        friction.
        """
        return ()

    def inner_rates(self, q: Values, v: Values, forces: Values) -> Mapping[str, Value]:
        """Time derivatives of `inner_states`, which are found in q by their names."""
        return {}

    @property
    def account_names(self) -> tuple[str, ...]:
        """Names of the stores of `energy_accounts`."""
        return ()

    def energy_accounts(
        self, q: Values, v: Values, forces: Values, inputs: Values
    ) -> Mapping[str, EnergyAccount]:
        """Stores of energy whose law depends on loads or pressures, by their names."""
        return {}

    @property
    def needs_held_pressures(self) -> bool:
        """Whether its torques depend on pressures without a volume that pays for it, so that
        circuits must hold the pressures.
        """
        return False

    @abc.abstractmethod
    def contractions(self, q: Values, resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        """Contraction of each muscle at coordinates q, for resting lengths [m]."""

    def contraction_speeds(
        self, q: Values, v: Values, resting_lengths: Sequence[Value]
    ) -> tuple[Value, ...]:
        """Speed of shortening [m/s] of each muscle, the time derivative of `contractions` times the
        resting length.
        """
        names = [c.name for c in self.coordinates]
        if not names:
            return tuple(0.0 for _ in resting_lengths)
        at = [q[name] for name in names]
        speeds = [v[c.speed] for c in self.coordinates]
        rates = autodiff.jvp(
            lambda x: self.contractions(dict(zip(names, x, strict=True)), resting_lengths),
            at,
            speeds,
        )
        return tuple(length * rate for length, rate in zip(resting_lengths, rates, strict=True))

    def generalised_forces(
        self, q: Values, tensions: Sequence[Value], resting_lengths: Sequence[Value]
    ) -> Values:
        """Generalised force on each coordinate from the muscle tensions [N], by virtual work: J^T
        F.

        J is the Jacobian of the muscle shortenings by the coordinates, from `contractions`. Units:
        [N] for a coordinate in metres, [N m] for an angle.
        """
        names = [c.name for c in self.coordinates]
        if not names:
            return {}
        pulls = [
            tension * length for tension, length in zip(tensions, resting_lengths, strict=True)
        ]
        at = [q[name] for name in names]
        forces = autodiff.vjp(
            lambda x: self.contractions(dict(zip(names, x, strict=True)), resting_lengths),
            at,
            pulls,
        )
        return dict(zip(names, forces, strict=True))

    @abc.abstractmethod
    def acceleration(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        """Acceleration of each coordinate under the generalised muscle forces and the forces of the
        mechanism.
        """

    def driving_force(self, q: Values, v: Values, acceleration: Value) -> Value:
        """Generalised force of the muscles for an acceleration of the only coordinate, without
        inputs.
        """
        (coordinate,) = self.coordinates
        inputs = {each.name: 0.0 for each in self.inputs}
        free, driven = (
            self.acceleration(q, v, {coordinate.name: f}, inputs)[coordinate.name]
            for f in (0.0, 1.0)
        )
        return (acceleration - free) / (driven - free)

    def dissipated_power(self, q: Values, v: Values, forces: Values, inputs: Values) -> Value:
        """Power [W] that leaves the mechanism through its dampers, end stops, drives and external
        loads.
        """
        return 0.0

    def potential_energy(self, q: Values) -> Value:
        """Potential energy [J]."""
        return 0.0

    def kinetic_energy(self, q: Values, v: Values) -> Value:
        """Kinetic energy [J]."""
        return 0.0


class DampedCoordinate(Mechanism, abc.ABC):
    """Mechanism of one coordinate with an inertia and viscous friction (base class)."""

    damping: float = 0.0

    @property
    @abc.abstractmethod
    def total_inertia(self) -> Value:
        """Mass [kg] of a position, or moment of inertia [kg m^2] of an angle."""

    def dissipated_power(self, q: Values, v: Values, forces: Values, inputs: Values) -> Value:
        return self.damping * v[self.coordinates[0].speed] ** 2

    def kinetic_energy(self, q: Values, v: Values) -> Value:
        return 0.5 * self.total_inertia * v[self.coordinates[0].speed] ** 2


class Translation(DampedCoordinate):
    """One coordinate: the position y [m], which is the shortening of the muscles from their resting
    length.
    """

    mass: float

    total_inertia = forwarded("mass")
    coordinates = (Coordinate("position", "speed", "m", 0.01, 0.1),)

    def contractions(self, q: Values, resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        return tuple(q["position"] / length for length in resting_lengths)

    def generalised_forces(
        self, q: Values, tensions: Sequence[Value], resting_lengths: Sequence[Value]
    ) -> Values:
        return {"position": sum(tensions, 0.0)}

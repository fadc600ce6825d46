"""Muscles of a plant at one instant, and the plant at rest: muscles, circuits, mechanism and
ambient air.
"""

import functools
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

from ...core import (
    ParameterError,
    StateVariable,
    System,
    Value,
    Values,
    check_known,
    select_prefix,
    with_prefix,
)
from ..mechanism import Mechanism
from ..muscle import Muscle
from ..pneumatics import Air, Ambient, Circuit, CircuitFlows, Flow, Gas, port_prefix
from ..pneumatics.gas import absolute_pressure, gauge_pressure
from .validation import as_quantity, check_pressures

_TYPICAL_CONTRACTION = 0.05
"""Contraction whose muscle volume defines the nominal value of the air mass (chosen)."""


class MuscleState(NamedTuple):
    """One muscle at one instant: contraction [1], shortening speed [m/s], volume [m3], pressures
    [Pa], forces [N].

    `inner_contraction` and `inner_speed` belong to the contractile part; with a series spring they
    differ from those of the fittings. `states` are the states of the muscle and of its air, without
    prefix; `rates` the rates of the former.
    """

    contraction: Value
    speed: Value
    volume: Value
    air: Air
    pressure: Value
    tension: Value
    friction: Value
    inner_contraction: Value
    inner_speed: Value
    volume_rate: Value
    states: Values
    rates: Values


def states_of_muscle(
    prefix: str, muscle: Muscle, states: tuple[StateVariable, ...]
) -> list[StateVariable]:
    """States of a muscle by their names in the plant."""
    return [
        StateVariable(f"{prefix}{s.name}", s.unit, s.nominal, f"{s.meaning} of {muscle.name}")
        for s in states
    ]


def air_states(muscle: Muscle, gas: Gas, ambient: Ambient) -> tuple[StateVariable, ...]:
    """States of the air in a muscle, by their own names."""
    return gas.states(muscle.geometry.volume(_TYPICAL_CONTRACTION), ambient)


class PlantEvaluation(NamedTuple):
    """Muscles and circuits of a plant at one instant; forces [N] or [N m] and accelerations by
    coordinate.
    """

    muscles: tuple[MuscleState, ...]
    circuits: tuple[CircuitFlows, ...]
    forces: Values
    accelerations: Values

    @property
    def flows(self) -> list[Flow]:
        """The flow into every muscle."""
        return [flow for circuit in self.circuits for flow in circuit.flows]


class MuscleSystem(System):
    """Muscles that act on a mechanism (base class)."""

    muscle: Muscle | tuple[Muscle, ...]
    mechanism: Mechanism

    @functools.cached_property
    def muscles(self) -> tuple[Muscle, ...]:
        """The muscles, one or more."""
        return self.muscle if isinstance(self.muscle, tuple) else (self.muscle,)

    @functools.cached_property
    def prefixes(self) -> tuple[str, ...]:
        """Prefixes of the names of each muscle's quantities."""
        return ("",) if len(self.muscles) == 1 else tuple(f"{m.name}." for m in self.muscles)

    @property
    def resting_lengths(self) -> list[Value]:
        """Resting lengths of the muscles [m]."""
        return [m.geometry.resting_length for m in self.muscles]

    @functools.cached_property
    def inputs(self) -> tuple[str, ...]:
        """The names of all inputs."""
        return tuple(i.name for i in self.input_variables)


class StaticPlant(MuscleSystem):
    """Muscles that circuits fill and that act on a mechanism (base class of Plant): what an
    equilibrium needs.
    """

    circuit: Circuit | tuple[Circuit, ...]
    gas: Gas
    ambient: Ambient

    @functools.cached_property
    def circuits(self) -> tuple[Circuit, ...]:
        """The circuits: one for each muscle, or a single one for all."""
        return self.circuit if isinstance(self.circuit, tuple) else (self.circuit,)

    @property
    def circuit_prefixes(self) -> tuple[str, ...]:
        """Prefixes of the names of each circuit's quantities."""
        return ("",) if self._shared else self.prefixes

    @property
    def _shared(self) -> bool:
        return len(self.circuits) < len(self.muscles)

    def _circuits(self) -> Iterator[tuple[str, Circuit]]:
        return zip(self.circuit_prefixes, self.circuits, strict=True)

    def _by_circuit(self, air_states: list[Air]) -> list[tuple[Air, ...]]:
        return [tuple(air_states)] if self._shared else [(air,) for air in air_states]

    def _outside(self, prefix: str, values: Mapping[str, Any]) -> dict[str, Any]:
        """Values under a circuit's own names, by the plant's names: of a shared one, port i is that
        of muscle i.
        """
        if not self._shared:
            return with_prefix(prefix, values)
        muscles = {port_prefix(number): prefix for number, prefix in enumerate(self.prefixes, 1)}
        named = {}
        for name, value in values.items():
            port, dot, rest = name.partition(".")
            named[muscles[port + dot] + rest if port + dot in muscles else name] = value
        return named

    def _within(self, prefix: str, values: Values) -> Values:
        """Values under the plant's names, by a circuit's own names: of a shared one, of muscle i
        also by port i.
        """
        if not self._shared:
            return select_prefix(prefix, values)
        named = dict(values)
        for number, muscle in enumerate(self.prefixes, 1):
            named |= with_prefix(port_prefix(number), select_prefix(muscle, values))
        return named

    def muscle_states(
        self, state: Values, inputs: Values = MappingProxyType({})
    ) -> tuple[MuscleState, ...]:
        """Every muscle at a state; `inputs` are required if shortenings are inputs."""
        place = {**inputs, **state}
        contractions = self.mechanism.contractions(place, self.resting_lengths)
        speeds = self.mechanism.contraction_speeds(place, place, self.resting_lengths)
        instants = []
        for muscle, prefix, contraction, v in zip(
            self.muscles, self.prefixes, contractions, speeds, strict=True
        ):
            states = select_prefix(prefix, state)
            inner = muscle.inner_contraction(contraction, states)
            volume = muscle.volume(inner, states)
            air = self.gas.air(states, volume, self.ambient)
            pressure = gauge_pressure(air.pressure, self.ambient)
            tension, friction, speed = muscle.compute_force(pressure, inner, contraction, v, states)
            rates = muscle.rates(states, pressure, speed)
            growth = (
                muscle.geometry.volume_derivative(inner) * speed / muscle.geometry.resting_length
            )
            growth = sum((rates[s.name] for s in muscle.wall.states), growth)
            instants.append(
                MuscleState(
                    contraction,
                    v,
                    volume,
                    air,
                    pressure,
                    tension,
                    friction,
                    inner,
                    speed,
                    growth,
                    states,
                    rates,
                )
            )
        return tuple(instants)

    def state_at(
        self, *, pressure: float | str | Sequence[float | str], **values: float | str
    ) -> dict[str, float]:
        """A state by the gauge pressure [Pa] of the muscle (or of each), and by states by name;
        also texts with a unit.

        Coordinates and speeds that are not given are 0; walls, tubes, tanks and series springs are
        in steady state at this pressure, bristles relaxed. Names with a dot are passed as
        `**{"left.bristle": 1e-4}`. Raises ParameterError for a pressure below absolute zero,
        another number of pressures than muscles, an unknown name, or a volume that is not positive;
        GeometryLimitError for an impossible contraction.
        """
        pressures = check_pressures(pressure, len(self.muscles), self.ambient)
        muscles = zip(self.prefixes, self.muscles, strict=True)
        air = {f"{p}{s.name}" for p, m in muscles for s in air_states(m, self.gas, self.ambient)}
        units = {s.name: s.unit for s in self.states if s.name not in air}
        check_known("Plant: no coordinate", values, list(units))
        stated = {
            n: as_quantity(f"Plant: the {n} of a state", v, units[n], self.ambient)
            for n, v in values.items()
        }
        state: dict[str, Value] = {
            n: 0.0 for c in self.mechanism.coordinates for n in (c.name, c.speed)
        } | stated
        contractions = self.mechanism.contractions(state, self.resting_lengths)
        for muscle, contraction in zip(self.muscles, contractions, strict=True):
            muscle.geometry.check_contraction(contraction)
        state, volumes = self.settle_muscles(pressures, state)
        for muscle, level, volume in zip(self.muscles, pressures, volumes, strict=True):
            if not volume > 0.0:
                raise ParameterError(
                    f"Plant: the volume of {muscle.name} would be {volume:.4g} m3 at"
                    f" {level:.4g} Pa; its wall deforms too far."
                )
        state = self.fill_muscles(pressures, volumes, state)
        return {s.name: float(state[s.name]) for s in self.states}

    def settle_muscles(
        self, pressures: Sequence[Value], state: Values
    ) -> tuple[dict[str, Value], list[Value]]:
        """`state` with the muscles' own states, in steady state unless they are given, and the
        volume [m3] of each.

        Nothing is checked, and values and parameters may be arrays that broadcast.
        """
        settled = {**{s.name: 0.0 for s in self.mechanism.inner_states}, **state}
        volumes = []
        contractions = self.mechanism.contractions(state, self.resting_lengths)
        for muscle, prefix, pressure, eps in zip(
            self.muscles, self.prefixes, pressures, contractions, strict=True
        ):
            muscle_states = {**muscle.steady_state(pressure, eps), **select_prefix(prefix, state)}
            volumes.append(
                muscle.volume(muscle.inner_contraction(eps, muscle_states), muscle_states)
            )
            settled = {**with_prefix(prefix, muscle_states), **settled}
        return settled, volumes

    def fill_muscles(
        self, pressures: Sequence[Value], volumes: Sequence[Value], state: Values
    ) -> dict[str, Value]:
        """`state` with air at these gauge pressures [Pa] in muscles of these volumes [m3], and
        circuits settled.
        """
        filled = dict(state)
        air_states = []
        for prefix, pressure, volume in zip(self.prefixes, pressures, volumes, strict=True):
            content = self.gas.state_at(
                absolute_pressure(pressure, self.ambient), volume, self.ambient
            )
            air_states.append(self.gas.air(content, volume, self.ambient))
            filled |= with_prefix(prefix, content)
        for (prefix, circuit), air in zip(
            self._circuits(), self._by_circuit(air_states), strict=True
        ):
            filled = {**self._outside(prefix, circuit.steady_state(air, self.ambient)), **filled}
        return filled

"""Plant at rest: muscles with their circuits, mechanism and ambient air, states by pressures."""

import functools
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from ...core import System, Value, Values, check_known, select_prefix, with_prefix
from ..mechanism import Mechanism
from ..muscle import Muscle
from ..pneumatics import Air, Ambient, Circuit, Gas, absolute_pressure, key_by_muscle, key_by_port
from .diagnostics import check_volumes
from .muscle_state import MuscleState, air_states, muscle_state
from .validation import as_quantity, check_pressures


class StaticPlant(System):
    """Muscles that circuits fill and that act on a mechanism (base class of Plant): what an equilibrium needs."""

    muscle: Muscle | tuple[Muscle, ...]
    circuit: Circuit | tuple[Circuit, ...]
    mechanism: Mechanism
    gas: Gas
    ambient: Ambient

    @functools.cached_property
    def muscles(self) -> tuple[Muscle, ...]:
        """The muscles, one or more."""
        return self.muscle if isinstance(self.muscle, tuple) else (self.muscle,)

    @functools.cached_property
    def circuits(self) -> tuple[Circuit, ...]:
        """The circuits: one for each muscle, or a single one for all."""
        return self.circuit if isinstance(self.circuit, tuple) else (self.circuit,)

    @functools.cached_property
    def prefixes(self) -> tuple[str, ...]:
        """Prefixes of the names of each muscle's quantities."""
        return ("",) if len(self.muscles) == 1 else tuple(f"{m.name}." for m in self.muscles)

    @property
    def circuit_prefixes(self) -> tuple[str, ...]:
        """Prefixes of the names of each circuit's quantities."""
        return ("",) if self._shared else self.prefixes

    @property
    def _shared(self) -> bool:
        return len(self.circuits) < len(self.muscles)

    @property
    def resting_lengths(self) -> list[Value]:
        """Resting lengths of the muscles [m]."""
        return [m.geometry.resting_length for m in self.muscles]

    def _circuits(self) -> Iterator[tuple[str, Circuit]]:
        return zip(self.circuit_prefixes, self.circuits, strict=True)

    def _by_circuit(self, airs: list[Air]) -> list[tuple[Air, ...]]:
        return [tuple(airs)] if self._shared else [(air,) for air in airs]

    def _outside(self, prefix: str, values: Mapping[str, Any]) -> dict[str, Any]:
        """Values under a circuit's own names, by the plant's names."""
        return key_by_muscle(self.prefixes, values) if self._shared else with_prefix(prefix, values)

    def _within(self, prefix: str, values: Values) -> Values:
        """Values under the plant's names, by a circuit's own names."""
        return key_by_port(self.prefixes, values) if self._shared else select_prefix(prefix, values)

    def muscle_states(self, state: Values, inputs: Values = MappingProxyType({})) -> tuple[MuscleState, ...]:
        """Every muscle at a state; `inputs` are required if shortenings are inputs."""
        place = {**inputs, **state}
        contractions = self.mechanism.contractions(place, self.resting_lengths)
        speeds = self.mechanism.contraction_speeds(place, place, self.resting_lengths)
        return tuple(
            muscle_state(m, select_prefix(prefix, state), contraction, speed, self.gas, self.ambient)
            for m, prefix, contraction, speed in zip(self.muscles, self.prefixes, contractions, speeds, strict=True)
        )

    def state_at(self, *, pressure: float | str | Sequence[float | str], **values: float | str) -> dict[str, float]:
        """A state by the gauge pressure [Pa] of the muscle (or of each), and by states by name; also texts with a unit.

        Coordinates and speeds that are not given are 0; walls, tubes, tanks and series springs are in steady state at
        this pressure, bristles relaxed. Names with a dot are passed as `**{"left.bristle": 1e-4}`. Raises
        ParameterError for a pressure below absolute zero, another number of pressures than muscles, an unknown name, or
        a volume that is not positive; GeometryLimitError for an impossible contraction.
        """
        pressures = check_pressures(pressure, len(self.muscles), self.ambient)
        muscles = zip(self.prefixes, self.muscles, strict=True)
        air = {f"{p}{s.name}" for p, m in muscles for s in air_states(m, self.gas, self.ambient)}
        units = {s.name: s.unit for s in self.states if s.name not in air}
        check_known("Plant: no coordinate", values, list(units))
        given = {n: as_quantity(f"Plant: the {n} of a state", v, units[n], self.ambient) for n, v in values.items()}
        state: dict[str, Value] = {n: 0.0 for c in self.mechanism.coordinates for n in (c.name, c.speed)} | given
        contractions = self.mechanism.contractions(state, self.resting_lengths)
        for muscle, contraction in zip(self.muscles, contractions, strict=True):
            muscle.geometry.check_contraction(contraction)
        state, volumes = self.settle_muscles(pressures, state)
        check_volumes(self.muscles, pressures, volumes)
        state = self.fill_muscles(pressures, volumes, state)
        return {s.name: float(state[s.name]) for s in self.states}

    def settle_muscles(self, pressures: Sequence[Value], state: Values) -> tuple[dict[str, Value], list[Value]]:
        """`state` with the muscles' own states, in steady state unless they are given, and the volume [m3] of each.

        Nothing is checked, and values and parameters may be arrays that broadcast.
        """
        settled, volumes = {**{s.name: 0.0 for s in self.mechanism.inner_states}, **state}, []
        contractions = self.mechanism.contractions(state, self.resting_lengths)
        for muscle, prefix, pressure, eps in zip(self.muscles, self.prefixes, pressures, contractions, strict=True):
            own = {**muscle.steady_state(pressure, eps), **select_prefix(prefix, state)}
            volumes.append(muscle.volume(muscle.inner_contraction(eps, own), own))
            settled = {**with_prefix(prefix, own), **settled}
        return settled, volumes

    def fill_muscles(self, pressures: Sequence[Value], volumes: Sequence[Value], state: Values) -> dict[str, Value]:
        """`state` with air at these gauge pressures [Pa] in muscles of these volumes [m3], and circuits settled."""
        filled, airs = dict(state), []
        for prefix, pressure, volume in zip(self.prefixes, pressures, volumes, strict=True):
            content = self.gas.state_at(absolute_pressure(pressure, self.ambient), volume, self.ambient)
            airs.append(self.gas.air(content, volume, self.ambient))
            filled |= with_prefix(prefix, content)
        for (prefix, circuit), air in zip(self._circuits(), self._by_circuit(airs), strict=True):
            filled = {**self._outside(prefix, circuit.steady_state(air, self.ambient)), **filled}
        return filled

"""A plant: muscles, the circuits that feed them, the mechanism that they pull at, and the air around."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from ..compile import StateVariable
from ..core.declaration import as_finite_float, check_structure, model
from ..core.errors import ParameterError, TraceError
from ..core.ops import Value
from ..core.variables import Input, add_prefix, select_prefix, with_prefix
from ..mechanism import Mechanism
from ..muscle import Muscle
from ..pneumatics import Circuit, CircuitFlows
from ..pneumatics.gas import Air, Ambient, Flow, Gas, Polytropic, absolute_pressure, check_above_vacuum
from ..pneumatics.ports import key_by_muscle, key_by_port
from ..pneumatics.supply import check_not_shared
from .muscle_state import MuscleState, muscle_state


@model
class Plant:
    """Ordinary differential equations of muscles, valves and load. Air mass [kg] is the state, pressure an output.

    `muscle` is one or a tuple. `circuit` is a tuple with one for each muscle, or a single one that feeds them all.
    With one muscle the names are plain (`air_mass`, `pressure`, `bristle`); with several they carry its name
    (`left.pressure`), as does what belongs to a circuit in a tuple, or to a muscle's tube in a circuit for all.
    """

    muscle: Muscle | tuple[Muscle, ...]
    circuit: Circuit | tuple[Circuit, ...]
    mechanism: Mechanism
    gas: Gas = Polytropic()
    ambient: Ambient = Ambient()

    def check(self) -> None:
        parts: list[Any] = [("mechanism", self.mechanism, Mechanism), ("gas", self.gas, Gas)]
        parts += [("ambient", self.ambient, Ambient)]
        parts += [("muscle", m, Muscle) for m in self.muscles] + [("circuit", c, Circuit) for c in self.circuits]
        for field, part, kind in parts:
            if not isinstance(part, kind):
                hint = " Several stand in a tuple." if isinstance(part, list) else ""
                hint = f" It has one: give its .{field}." if hasattr(part, field) else hint
                raise ParameterError(f"Plant: its {field} must be a {kind.__name__}; it is {str(part)[:80]}.{hint}")
        self._check_closed_form()
        check_structure((self.muscles, self.circuits, self.mechanism))
        for circuit in self.circuits:
            check_not_shared(f"Plant: its {type(circuit).__name__}", circuit.supply)
        names = [m.name for m in self.muscles]
        if not names:
            raise ParameterError("Plant: it has no muscle; give one, or a tuple of them.")
        ports = sum(c.port_count for c in self.circuits)
        if ports != len(names):
            raise ParameterError(f"Plant: its circuits feed {ports} muscles; {len(names)} are given.")
        taken = self.mechanism.muscle_count
        if taken not in (None, len(names)):
            owner = type(self.mechanism).__name__
            raise ParameterError(f"Plant: {owner} takes {taken} muscles; {len(names)} are given.")
        if isinstance(self.circuit, tuple) and any(c.port_count != 1 for c in self.circuit):
            raise ParameterError("Plant: a circuit that feeds several muscles stands alone, not in a tuple.")
        if len(set(names)) < len(names):
            raise ParameterError(f"Plant: muscles need different names; they are {names}.")
        self._check_unique_names()

    def _check_closed_form(self) -> None:
        for muscle in self.muscles:
            for part in (muscle.contractile, muscle.geometry):
                if not part.traceable:
                    raise TraceError(
                        f"{type(part).__name__} of {muscle.name} is not closed-form and cannot enter a plant. Use "
                        "as_force_law(law, validity range) for a characteristic, as_polynomial(geometry) for a "
                        "geometry."
                    )

    def _check_unique_names(self) -> None:
        names = [*(s.name for s in self.states), *self.inputs]
        for name in (n for n in names if names.count(n) > 1):
            raise ParameterError(f"Plant: two of its parts use the name '{name}'; rename one of them.")

    @property
    def muscles(self) -> tuple[Muscle, ...]:
        """The muscles, one or more."""
        return self.muscle if isinstance(self.muscle, tuple) else (self.muscle,)

    @property
    def circuits(self) -> tuple[Circuit, ...]:
        """The circuits: one for each muscle, or a single one for all."""
        return self.circuit if isinstance(self.circuit, tuple) else (self.circuit,)

    @property
    def prefixes(self) -> tuple[str, ...]:
        """What the names of each muscle's quantities begin with."""
        return ("",) if len(self.muscles) == 1 else tuple(f"{m.name}." for m in self.muscles)

    @property
    def circuit_prefixes(self) -> tuple[str, ...]:
        """What the names of each circuit's quantities begin with."""
        return ("",) if self._shared else self.prefixes

    @property
    def _shared(self) -> bool:
        return len(self.circuits) < len(self.muscles)

    @property
    def resting_lengths(self) -> list[Value]:
        """Of every muscle [m]."""
        return [m.geometry.resting_length for m in self.muscles]

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """What the muscles' air holds, the mechanism's coordinates and speeds, then states of muscles and circuits."""
        air, inner = [], []
        for prefix, muscle in zip(self.prefixes, self.muscles, strict=True):
            of_air = self.gas.states(muscle.geometry.volume(0.05), self.ambient)
            air += _of_muscle(prefix, muscle, of_air)
            inner += _of_muscle(prefix, muscle, muscle.states)
        moving = []
        for c in self.mechanism.coordinates:
            moving.append(StateVariable(c.name, c.unit, c.nominal, f"{c.name} of the load"))
            moving.append(StateVariable(c.speed, f"{c.unit}/s", c.nominal_speed, f"{c.speed} of the load"))
        own = [(prefix, s) for prefix, circuit in self._circuits() for s in circuit.states(self.ambient)]
        circuits = [replace(s, name=name) for prefix, s in own for name in self._outside(prefix, {s.name: s})]
        return (*air, *moving, *inner, *circuits)

    @property
    def commands(self) -> tuple[Input, ...]:
        """Inputs of the circuits, then of the mechanism, with what may be commanded."""
        return (*(i for p, c in self._circuits() for i in add_prefix(p, c.inputs)), *self.mechanism.inputs)

    @property
    def inputs(self) -> tuple[str, ...]:
        """The names of all inputs."""
        return tuple(i.name for i in self.commands)

    def _circuits(self) -> Iterator[tuple[str, Circuit]]:
        return zip(self.circuit_prefixes, self.circuits, strict=True)

    def _shares(self, airs: list[Air]) -> list[tuple[Air, ...]]:
        return [tuple(airs)] if self._shared else [(air,) for air in airs]

    def _outside(self, prefix: str, values: Mapping[str, Any]) -> dict[str, Any]:
        """What a circuit calls by its own names, by the plant's."""
        return key_by_muscle(self.prefixes, values) if self._shared else with_prefix(prefix, values)

    def _within(self, prefix: str, values: Mapping[str, Value]) -> Mapping[str, Value]:
        """What the plant calls by its names, by a circuit's own."""
        return key_by_port(self.prefixes, values) if self._shared else select_prefix(prefix, values)

    def ports(self, state: Mapping[str, Value]) -> tuple[MuscleState, ...]:
        """Every muscle at a state."""
        contractions = self.mechanism.contractions(state, self.resting_lengths)
        speeds = self.mechanism.contraction_speeds(state, state, self.resting_lengths)
        return tuple(
            muscle_state(muscle, select_prefix(prefix, state), contraction, speed, self.gas, self.ambient)
            for muscle, prefix, contraction, speed in zip(
                self.muscles, self.prefixes, contractions, speeds, strict=True
            )
        )

    def responses(
        self, ports: tuple[MuscleState, ...], state: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> tuple[CircuitFlows, ...]:
        """What every circuit does."""
        shares = self._shares([port.air for port in ports])
        return tuple(
            circuit.compute_flows(share, self._within(prefix, state), select_prefix(prefix, inputs), self.ambient)
            for (prefix, circuit), share in zip(self._circuits(), shares, strict=True)
        )

    def rates(self, state: Mapping[str, Value], inputs: Mapping[str, Value]) -> dict[str, Value]:
        """The time derivative of every state."""
        ports = self.ports(state)
        done = self.responses(ports, state, inputs)
        rates: dict[str, Value] = {}
        for port, prefix, flow in zip(ports, self.prefixes, _flows(done), strict=True):
            rates |= with_prefix(prefix, self.gas.rates(port.states, port.air, flow, port.volume_rate, self.ambient))
            rates |= with_prefix(prefix, port.rates)
        accelerations = self._accelerations(state, ports, inputs)
        for c in self.mechanism.coordinates:
            rates |= {c.name: state[c.speed], c.speed: accelerations[c.name]}
        for (prefix, _), response in zip(self._circuits(), done, strict=True):
            rates |= self._outside(prefix, response.rates)
        return rates

    def _accelerations(
        self, state: Mapping[str, Value], ports: tuple[MuscleState, ...], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        pulls = self.mechanism.generalised_forces(state, [port.tension for port in ports], self.resting_lengths)
        return self.mechanism.acceleration(state, state, pulls, inputs)

    def outputs(self, state: Mapping[str, Value], inputs: Mapping[str, Value]) -> dict[str, Value]:
        """Gauge pressure, contraction, tension, volume, mass flow of every muscle (temperature where the gas keeps
        account of it, friction where there is any), what circuits show, and accelerations."""
        ports = self.ports(state)
        done = self.responses(ports, state, inputs)
        found: dict[str, Value] = {}
        for muscle, prefix, port, flow in zip(self.muscles, self.prefixes, ports, _flows(done), strict=True):
            found[f"{prefix}pressure"] = port.pressure
            found[f"{prefix}contraction"] = port.contraction
            found[f"{prefix}force"] = port.tension
            found[f"{prefix}volume"] = port.volume
            found[f"{prefix}mass_flow"] = flow.mass
            if muscle.friction.states:
                found[f"{prefix}friction"] = port.friction
            if "internal_energy" in port.states:
                found[f"{prefix}temperature"] = port.air.temperature
        for (prefix, _), response in zip(self._circuits(), done, strict=True):
            found |= self._outside(prefix, response.outputs)
        accelerations = self._accelerations(state, ports, inputs)
        for c in self.mechanism.coordinates:
            found[c.acceleration] = accelerations[c.name]
        return found

    def state_at(self, *, pressure: float | tuple[float, ...], **values: float) -> dict[str, float]:
        """A state by what is known of it: gauge pressure [Pa] of the muscle (or of each), and states by name.

        Coordinates and speeds that are not named are 0; walls, tubes, tanks and series springs are settled at this
        pressure, bristles relaxed. Names with a dot are passed as `**{"left.bristle": 1e-4}`. Raises ParameterError
        for a pressure below absolute zero, another number of pressures than muscles, an unknown name, or a wall that
        takes all volume away.
        """
        given = pressure if isinstance(pressure, tuple) else (pressure,) * len(self.muscles)
        pressures = [as_finite_float("Plant: the pressure of a state", p) for p in given]
        values = {name: as_finite_float(f"Plant: the {name} of a state", value) for name, value in values.items()}
        if len(pressures) != len(self.muscles):
            raise ParameterError(f"Plant: {len(pressures)} pressures are given for {len(self.muscles)} muscles.")
        air = {f"{p}{s.name}" for p, m in zip(self.prefixes, self.muscles, strict=True)
               for s in self.gas.states(m.geometry.volume(0.05), self.ambient)}  # fmt: skip
        order = [s.name for s in self.states]
        free = [name for name in order if name not in air]
        for name in values:
            if name not in free:
                raise ParameterError(f"Plant: no coordinate '{name}'; there are {', '.join(free) or 'none'}.")
        state: dict[str, Value] = {n: 0.0 for c in self.mechanism.coordinates for n in (c.name, c.speed)} | values
        contractions = self.mechanism.contractions(state, self.resting_lengths)
        for muscle, p, eps in zip(self.muscles, pressures, contractions, strict=True):
            check_above_vacuum(p, self.ambient)
            muscle.geometry.check_contraction(eps)
        state, volumes = self.settled_muscles(pressures, state)
        for muscle, p, volume in zip(self.muscles, pressures, volumes, strict=True):
            if not volume > 0.0:
                raise ParameterError(
                    f"Plant: {muscle.name} encloses {volume:g} m3 at {p:g} Pa; its wall gives too much."
                )
        state = self.filled(pressures, volumes, state)
        return {name: float(state[name]) for name in order}

    def settled_muscles(
        self, pressures: Sequence[Value], state: Mapping[str, Value]
    ) -> tuple[dict[str, Value], list[Value]]:
        """The muscles' own states added to `state`, settled at these gauge pressures [Pa] unless they are there, and
        the volume [m3] of each. Nothing is refused; values and parameters of the plant may be arrays that broadcast.
        """
        found, volumes = dict(state), []
        contractions = self.mechanism.contractions(state, self.resting_lengths)
        for muscle, prefix, p, eps in zip(self.muscles, self.prefixes, pressures, contractions, strict=True):
            own = {**muscle.steady_state(p, eps), **select_prefix(prefix, state)}
            volumes.append(muscle.volume(muscle.inner_contraction(eps, own), own))
            found = {**with_prefix(prefix, own), **found}
        return found, volumes

    def filled(
        self, pressures: Sequence[Value], volumes: Sequence[Value], state: Mapping[str, Value]
    ) -> dict[str, Value]:
        """The state with air at these gauge pressures [Pa] in muscles of these volumes [m3], and circuits settled."""
        found, airs = dict(state), []
        for prefix, p, volume in zip(self.prefixes, pressures, volumes, strict=True):
            content = self.gas.state_at(absolute_pressure(p, self.ambient), volume, self.ambient)
            airs.append(self.gas.air(content, volume, self.ambient))
            found |= with_prefix(prefix, content)
        for (prefix, circuit), share in zip(self._circuits(), self._shares(airs), strict=True):
            found = {**self._outside(prefix, circuit.steady_state(share, self.ambient)), **found}
        return found


def _of_muscle(prefix: str, muscle: Muscle, states: tuple[StateVariable, ...]) -> list[StateVariable]:
    return [StateVariable(f"{prefix}{s.name}", s.unit, s.nominal, f"{s.meaning} of {muscle.name}") for s in states]


def _flows(responses: tuple[CircuitFlows, ...]) -> list[Flow]:
    return [flow for response in responses for flow in response.flows]


def total_air(state: Mapping[str, Any]) -> Value:
    """Mass of all air that is in a plant [kg]: what its muscles, tubes and tanks hold."""
    return sum(value for name, value in state.items() if name.endswith("air_mass"))

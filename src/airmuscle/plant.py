"""A plant: muscles, the circuits that feed them, the mechanism that they pull at, and the air around."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from .circuit import Circuit
from .declare import model
from .errors import ParameterError, TraceError
from .gas import Ambient, Gas, Polytropic, absolute, gauge, refuse_vacuum
from .mechanism import Mechanism
from .muscle import Muscle
from .ops import Value
from .program import StateVariable


class Port(NamedTuple):
    """One muscle at one moment: contraction [1], shortening speed [m/s], volume [m3], pressures [Pa], forces [N]."""

    contraction: Value
    speed: Value
    volume: Value
    absolute_pressure: Value
    pressure: Value
    tension: Value
    friction: Value
    bristles: Mapping[str, Value]


@model
class Plant:
    """Ordinary differential equations of muscles, valves and load. Air mass [kg] is the state, pressure an output.

    `muscle` and `circuit` are one each, or tuples of the same length. With one muscle the names are plain
    (`air_mass`, `pressure`, `bristle`); with several they carry its name (`left.pressure`, `left.bristle`).
    """

    muscle: Muscle | tuple[Muscle, ...]
    circuit: Circuit | tuple[Circuit, ...]
    mechanism: Mechanism
    gas: Gas = Polytropic()
    ambient: Ambient = Ambient()

    def check(self) -> None:
        names = [m.name for m in self.muscles]
        if len(self.circuits) != len(names):
            raise ParameterError(f"Plant: {len(names)} muscles need as many circuits; {len(self.circuits)} given.")
        if len(set(names)) < len(names):
            raise ParameterError(f"Plant: muscles need different names; they are {names}.")
        for muscle in self.muscles:
            for part in (muscle.contractile, muscle.geometry):
                if not part.traceable:
                    raise TraceError(
                        f"{type(part).__name__} of {muscle.name} is not closed-form and cannot enter a plant. Use "
                        "as_force_law(law, box) for a characteristic, as_polynomial(geometry) for a geometry."
                    )

    @property
    def muscles(self) -> tuple[Muscle, ...]:
        """The muscles, one or more."""
        return self.muscle if isinstance(self.muscle, tuple) else (self.muscle,)

    @property
    def circuits(self) -> tuple[Circuit, ...]:
        """The circuit of each muscle."""
        return self.circuit if isinstance(self.circuit, tuple) else (self.circuit,)

    @property
    def prefixes(self) -> tuple[str, ...]:
        """What the names of each muscle's quantities begin with."""
        return ("",) if len(self.muscles) == 1 else tuple(f"{m.name}." for m in self.muscles)

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """Air masses, the mechanism's coordinates and their speeds, then the bristles of the muscles' friction."""
        air, bristles = [], []
        for prefix, muscle in zip(self.prefixes, self.muscles, strict=True):
            size = self.gas.air_mass(self.ambient.pressure, muscle.geometry.volume(0.05), self.ambient)
            air.append(StateVariable(f"{prefix}air_mass", "kg", size, f"mass of the air in {muscle.name}"))
            for b in muscle.friction.states:
                bristles.append(StateVariable(f"{prefix}{b.name}", b.unit, b.nominal, f"{b.meaning} of {muscle.name}"))
        moving = []
        for c in self.mechanism.coordinates:
            moving.append(StateVariable(c.name, c.unit, c.nominal, f"{c.name} of the load"))
            moving.append(StateVariable(c.speed, f"{c.unit}/s", c.nominal_speed, f"{c.speed} of the load"))
        return (*air, *moving, *bristles)

    @property
    def inputs(self) -> tuple[str, ...]:
        """Openings of the valves, then inputs of the mechanism."""
        valves = [f"{p}{name}" for p, c in zip(self.prefixes, self.circuits, strict=True) for name in c.inputs]
        return (*valves, *self.mechanism.inputs)

    def ports(self, state: Mapping[str, Value]) -> tuple[Port, ...]:
        """Every muscle at a state."""
        lengths = [m.geometry.resting_length for m in self.muscles]
        contractions = self.mechanism.contractions(state, lengths)
        speeds = self.mechanism.contraction_speeds(state, state, lengths)
        return tuple(
            self._port(m, state[f"{prefix}air_mass"], contraction, speed, _bristles(m, prefix, state))
            for m, prefix, contraction, speed in zip(self.muscles, self.prefixes, contractions, speeds, strict=True)
        )

    def _port(
        self, muscle: Muscle, air_mass: Value, contraction: Value, speed: Value, bristles: Mapping[str, Value]
    ) -> Port:
        volume = muscle.geometry.volume(contraction)
        inside = self.gas.pressure(air_mass, volume, self.ambient)
        pressure = gauge(inside, self.ambient)
        tension = muscle.tension(pressure, contraction, speed, bristles)
        friction = muscle.friction_force(speed, bristles)
        return Port(contraction, speed, volume, inside, pressure, tension, friction, bristles)

    def mass_flows(self, ports: tuple[Port, ...], inputs: Mapping[str, Value]) -> tuple[Value, ...]:
        """Mass flow [kg/s] into every muscle."""
        flows = []
        for port, circuit, prefix in zip(ports, self.circuits, self.prefixes, strict=True):
            openings = {name: inputs[f"{prefix}{name}"] for name in circuit.inputs}
            flows.append(circuit.mass_flow(port.absolute_pressure, openings, self.ambient))
        return tuple(flows)

    def rates(self, state: Mapping[str, Value], inputs: Mapping[str, Value]) -> dict[str, Value]:
        """The time derivative of every state."""
        ports = self.ports(state)
        rates = {f"{p}air_mass": q for p, q in zip(self.prefixes, self.mass_flows(ports, inputs), strict=True)}
        pulls = self.mechanism.acceleration(state, state, [port.tension for port in ports], inputs)
        for c in self.mechanism.coordinates:
            rates[c.name] = state[c.speed]
            rates[c.speed] = pulls[c.name]
        for muscle, prefix, port in zip(self.muscles, self.prefixes, ports, strict=True):
            bending = muscle.friction.rates(port.bristles, port.speed)
            rates |= {f"{prefix}{name}": rate for name, rate in bending.items()}
        return rates

    def outputs(self, state: Mapping[str, Value], inputs: Mapping[str, Value]) -> dict[str, Value]:
        """Gauge pressure, contraction, tension, friction, volume and mass flow of every muscle; accelerations."""
        ports = self.ports(state)
        found: dict[str, Value] = {}
        flows = self.mass_flows(ports, inputs)
        for muscle, prefix, port, flow in zip(self.muscles, self.prefixes, ports, flows, strict=True):
            found[f"{prefix}pressure"] = port.pressure
            found[f"{prefix}contraction"] = port.contraction
            found[f"{prefix}force"] = port.tension
            found[f"{prefix}volume"] = port.volume
            found[f"{prefix}mass_flow"] = flow
            if muscle.friction.states:
                found[f"{prefix}friction"] = port.friction
        pulls = self.mechanism.acceleration(state, state, [port.tension for port in ports], inputs)
        for c in self.mechanism.coordinates:
            found["acceleration" if len(pulls) == 1 else f"{c.name}.acceleration"] = pulls[c.name]
        return found

    def state_at(self, *, pressure: float | tuple[float, ...], **coordinates: float) -> dict[str, float]:
        """A state by what is known of it: gauge pressure [Pa] of the muscle (or of each), coordinates, speeds.

        What is not named is 0, bristles too. Raises ParameterError for a pressure below absolute zero or an unknown
        name.
        """
        pressures = pressure if isinstance(pressure, tuple) else (pressure,) * len(self.muscles)
        moving = {s.name: 0.0 for s in self.states[len(self.muscles) :]}
        for name in coordinates:
            if name not in moving:
                raise ParameterError(f"Plant: no coordinate '{name}'; there are {', '.join(moving) or 'none'}.")
        moving |= coordinates
        lengths = [m.geometry.resting_length for m in self.muscles]
        contractions = self.mechanism.contractions(moving, lengths)
        air = {}
        for muscle, prefix, p, contraction in zip(self.muscles, self.prefixes, pressures, contractions, strict=True):
            refuse_vacuum(p, self.ambient)
            muscle.geometry.refuse_out_of_reach(contraction)
            volume = muscle.geometry.volume(contraction)
            air[f"{prefix}air_mass"] = float(self.gas.air_mass(absolute(p, self.ambient), volume, self.ambient))
        return {**air, **moving}


def _bristles(muscle: Muscle, prefix: str, state: Mapping[str, Value]) -> dict[str, Value]:
    """A muscle's bristles by their own names, taken from the plant's state."""
    return {b.name: state[f"{prefix}{b.name}"] for b in muscle.friction.states}

"""Energy books: a plant that also integrates what its parts take and give, so that each balance can be checked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from . import trace
from .declare import model
from .ops import Value
from .plant import Plant, Port
from .program import StateVariable

_METERS = {
    "work_of_tension": "work of all tensions on the mechanism",
    "work_of_air": "work of the air on its enclosures, against their absolute pressure",
    "energy_of_flow": "energy that came in with the air",
    "damping_heat": "work that the dampers turned into heat",
}
_FRICTION = {"friction_work": "work done against friction: heat, and what its bristles hold"}


@model
class Metered:
    """A plant with four meters [J] as further states, five where a muscle has friction, and its energies as outputs.

    Two books must close. Mechanical: kinetic + potential energy grow by `work_of_tension`, as long as the latch does
    no work. Air: `air_energy` grows by `energy_of_flow` less `work_of_air`.
    """

    plant: Plant

    @property
    def meters(self) -> dict[str, str]:
        """Name and meaning of every meter."""
        return _METERS | (_FRICTION if any(m.friction.states for m in self.plant.muscles) else {})

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """The plant's states, then the meters."""
        return (*self.plant.states, *(StateVariable(name, "J", 1.0, meaning) for name, meaning in self.meters.items()))

    @property
    def inputs(self) -> tuple[str, ...]:
        """The plant's inputs."""
        return self.plant.inputs

    def rates(self, state: Mapping[str, Value], inputs: Mapping[str, Value]) -> dict[str, Value]:
        """The plant's rates, and the power that each meter integrates."""
        plant = self.plant
        ports = plant.ports(state)
        rates = dict.fromkeys(self.meters, 0.0)
        flows = plant.mass_flows(ports, inputs)
        for muscle, prefix, port, flow in zip(plant.muscles, plant.prefixes, ports, flows, strict=True):
            per_length = muscle.geometry.volume_growth(port.contraction) / muscle.geometry.resting_length
            rates["work_of_tension"] += port.tension * port.speed
            rates["work_of_air"] += port.absolute_pressure * per_length * port.speed
            rates["energy_of_flow"] += self._potential(state[f"{prefix}air_mass"], port) * flow
            rates["damping_heat"] += muscle.damper.force(port.pressure, port.speed) * port.speed
            if muscle.friction.states:
                rates["friction_work"] += port.friction * port.speed
        return {**plant.rates(state, inputs), **rates}

    def _potential(self, air_mass: Value, port: Port) -> Value:
        """Energy that a kilogram brings along [J/kg]: the slope of the air's energy by its mass."""
        gas, ambient = self.plant.gas, self.plant.ambient
        return trace.directional(lambda x: [gas.energy(x[0], port.volume, ambient)], [air_mass], [1.0])[0]

    def outputs(self, state: Mapping[str, Value], inputs: Mapping[str, Value]) -> dict[str, Any]:
        """The plant's outputs, and kinetic, potential and air energy [J]."""
        plant = self.plant
        air: Value = 0.0
        for prefix, port in zip(plant.prefixes, plant.ports(state), strict=True):
            air = air + plant.gas.energy(state[f"{prefix}air_mass"], port.volume, plant.ambient)
        return {
            **plant.outputs(state, inputs),
            "kinetic_energy": plant.mechanism.kinetic_energy(state, state),
            "potential_energy": plant.mechanism.potential_energy(state),
            "air_energy": air,
        }

"""Books: a plant that also integrates what its parts take and give, so that each balance can be checked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from ..core.declaration import model
from ..core.ops import Value
from ..core.variables import StateVariable
from ..muscle import Muscle, SeriesSpring
from .muscle_state import MuscleState
from .plant import Plant, total_air

_METERS = (
    StateVariable("work_of_tension", "J", 1.0, "work of all tensions on the mechanism"),
    StateVariable("work_of_air", "J", 1.0, "work of the air on its enclosures, against their absolute pressure"),
    StateVariable("energy_of_flow", "J", 1.0, "energy that came into the muscles with the air"),
    StateVariable("heat_to_air", "J", 1.0, "heat that the walls gave to the air in the muscles"),
    StateVariable("damping_heat", "J", 1.0, "work that the dampers turned into heat"),
    StateVariable("work_of_contractile", "J", 1.0, "work of the contractile elements"),
    StateVariable("element_work", "J", 1.0, "work done against springs, creep and end stops: heat, and what they hold"),
    StateVariable("mechanism_loss", "J", 1.0, "work that the mechanism lost to its dampers, stops and drives"),
    StateVariable("air_supplied", "kg", 1e-3, "air that came from outside the plant"),
    StateVariable("air_exhausted", "kg", 1e-3, "air that went to the surroundings"),
)
_FRICTION = StateVariable("friction_work", "J", 1.0, "work done against friction: heat, and what its bristles hold")


@model
class WithEnergyMeters:
    """A plant with meters as further states, and its energies and its air as outputs.

    Four books must close. Mechanical: kinetic + potential energy grow by `work_of_tension`, which counts the push of an
    end stop, less `mechanism_loss`, as long as a latch moves only from rest. Muscle: `work_of_contractile` is
    `work_of_tension` + `damping_heat` + `element_work` + `friction_work` (where there is friction), as long as no
    muscle hangs slack: a slack one passes nothing on. Air: `air_energy`, of the air in the muscles, grows by
    `energy_of_flow` + `heat_to_air` less `work_of_air`. Mass: `air_total`, of all air, grows by `air_supplied` less
    `air_exhausted`.
    """

    from_file: ClassVar[bool] = False

    plant: Plant

    @property
    def meters(self) -> tuple[StateVariable, ...]:
        """Every meter."""
        return (*_METERS, _FRICTION) if any(m.friction.states for m in self.plant.muscles) else _METERS

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """The plant's states, then the meters."""
        return (*self.plant.states, *self.meters)

    @property
    def inputs(self) -> tuple[str, ...]:
        """The plant's inputs."""
        return self.plant.inputs

    def reset(self, state: Mapping[str, float]) -> dict[str, float]:
        """A state of the plant with every meter at zero."""
        return {**state, **{meter.name: 0.0 for meter in self.meters}}

    def rates(self, state: Mapping[str, Value], inputs: Mapping[str, Value]) -> dict[str, Value]:
        """The plant's rates, and the power that each meter integrates."""
        plant = self.plant
        ports = plant.ports(state)
        powers: dict[str, Value] = dict.fromkeys((meter.name for meter in self.meters), 0.0)
        responses = plant.responses(ports, state, inputs)
        flows = [flow for response in responses for flow in response.flows]
        for muscle, port, flow in zip(plant.muscles, ports, flows, strict=True):
            powers["work_of_tension"] += port.tension * port.speed
            powers["work_of_air"] += port.air.pressure * port.volume_rate
            powers["energy_of_flow"] += plant.gas.energy_flow(port.states, flow, port.volume, plant.ambient)
            powers["heat_to_air"] += plant.gas.heat_flow(port.air, plant.ambient)
            for name, power in _muscle_powers(muscle, port).items():
                powers[name] += power
        pulls = plant.mechanism.generalised_forces(state, [port.tension for port in ports], plant.resting_lengths)
        powers["mechanism_loss"] += plant.mechanism.dissipated_power(state, state, pulls, inputs)
        for response in responses:
            powers["air_supplied"] += response.drawn.mass
            powers["air_exhausted"] += response.exhausted.mass
        return {**plant.rates(state, inputs), **powers}

    def outputs(self, state: Mapping[str, Value], inputs: Mapping[str, Value]) -> dict[str, Any]:
        """The plant's outputs; kinetic, potential and the muscles' air energy [J]; mass of all air [kg]."""
        plant = self.plant
        own = {s.name: state[s.name] for s in plant.states}
        return {
            **plant.outputs(state, inputs),
            "kinetic_energy": plant.mechanism.kinetic_energy(state, state),
            "potential_energy": plant.mechanism.potential_energy(state),
            "air_energy": sum(self._stored(port) for port in plant.ports(state)),
            "air_total": total_air(own),
        }

    def _stored(self, port: MuscleState) -> Value:
        return self.plant.gas.available_energy(port.states, port.volume, self.plant.ambient)


def _muscle_powers(muscle: Muscle, port: MuscleState) -> dict[str, Value]:
    """What the elements inside a muscle give and take [W]."""
    pressure, inner, speed = port.pressure, port.inner_contraction, port.inner_speed
    length = muscle.geometry.resting_length
    against = muscle.spring.force(pressure, inner, length) + muscle.stop.force(inner, speed, length)
    if muscle.creep.states:
        against = against + muscle.creep.force(port.states)
    held = against * speed
    if isinstance(muscle.series, SeriesSpring):
        held = held + port.tension * (speed - port.speed)
    found = {
        "work_of_contractile": muscle.contractile.force(pressure, inner) * speed,
        "element_work": held,
        "damping_heat": muscle.damper.force(pressure, inner, speed) * speed,
    }
    return {**found, "friction_work": port.friction * speed} if muscle.friction.states else found

"""WithEnergyMeters: a plant with integrated powers of its components, for checks of its energy
balances.
"""

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from ...core import StateVariable, System, Value, Values, model
from ...core.declaration import forwarded
from ..muscle import ElasticSeriesElement, Muscle
from ..muscle.friction import NoFriction
from .plant import Plant
from .static_plant import MuscleState

_METERS = (
    StateVariable("work_of_tension", "J", 1.0, "work of all tensions on the mechanism"),
    StateVariable(
        "work_of_air",
        "J",
        1.0,
        "work of the air on its enclosures, against their absolute pressure",
    ),
    StateVariable("energy_of_flow", "J", 1.0, "energy that flowed into the muscles with the air"),
    StateVariable("heat_to_air", "J", 1.0, "heat from the walls to the air in the muscles"),
    StateVariable("damping_heat", "J", 1.0, "work dissipated by the dampers"),
    StateVariable("work_of_contractile", "J", 1.0, "work of the contractile elements"),
    StateVariable(
        "element_work",
        "J",
        1.0,
        "work done on springs, creep and end stops: dissipated, and stored",
    ),
    StateVariable(
        "mechanism_loss",
        "J",
        1.0,
        "work of the mechanism on dampers, stops, drives and external loads",
    ),
    StateVariable("air_supplied", "kg", 1e-3, "air mass that entered the plant"),
    StateVariable("air_exhausted", "kg", 1e-3, "air mass that left the plant to the surroundings"),
)
_FRICTION = StateVariable(
    "friction_work", "J", 1.0, "work done against friction: dissipated, and stored in bristles"
)


def _account_meters(name: str) -> tuple[StateVariable, StateVariable]:
    """The meters of a store of energy of the mechanism."""
    return (
        StateVariable(f"{name}_work", "J", 1.0, f"work of the motion on the store '{name}'"),
        StateVariable(f"{name}_heat", "J", 1.0, f"heat from the store '{name}'"),
    )


@model
class WithEnergyMeters(System):
    """A plant with energy and mass meters as further states, and its energies and its air mass as
    outputs.

    Four balances must close. Mechanical: kinetic + potential energy increase by `work_of_tension`,
    which includes the contact force of an end stop, minus `mechanism_loss`, provided that a latch
    is operated at rest only; the energies of an ExternalLoad are outside the plant, and the work on
    it is part of `mechanism_loss`, from which the work of the torques of a residual is subtracted.
    A store of the mechanism (`energy_accounts`: bristles, a residual) has the meters `NAME_work`
    and `NAME_heat` and the outputs `NAME_energy` and `NAME_energy_unpaid`, by which the energy has
    grown beyond work minus heat: a load or a pressure on which the store depends has changed, and
    nothing pays for that.
    Muscle: `work_of_contractile` is `work_of_tension` + `damping_heat` + `element_work` +
    `friction_work` (with friction), provided that no muscle is slack. Air: `air_energy`, of the air
    in the muscles, increases by `energy_of_flow` + `heat_to_air` minus `work_of_air`. Mass:
    `air_total`, of all air, increases by `air_supplied` minus `air_exhausted`.
    """

    from_file: ClassVar[bool] = False

    plant: Plant

    @property
    def meters(self) -> tuple[StateVariable, ...]:
        """All meters."""
        frictionless = all(isinstance(muscle.friction, NoFriction) for muscle in self.plant.muscles)
        stores = [meter for name in self.stores for meter in _account_meters(name)]
        return (*_METERS, *(() if frictionless else (_FRICTION,)), *stores)

    @property
    def stores(self) -> tuple[str, ...]:
        """Names of the stores of energy of the mechanism."""
        return self.plant.mechanism.account_names

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """The plant's states, then the meters."""
        return (*self.plant.states, *self.meters)

    inputs = forwarded("plant.inputs")
    input_variables = forwarded("plant.input_variables")
    positive_outputs = forwarded("plant.positive_outputs")
    column_limits = forwarded("plant.column_limits")
    constants = forwarded("plant.constants")
    check_state = forwarded("plant.check_state")
    describe = forwarded("plant.describe")
    diagnose = forwarded("plant.diagnose")
    failure_hint = forwarded("plant.failure_hint")

    @property
    def output_units(self) -> Mapping[str, str]:
        """The units of the plant's outputs, of energies [J] and of the air mass [kg]."""
        names = ["kinetic_energy", "potential_energy", "air_energy"]
        names += [f"{name}_energy{end}" for name in self.stores for end in ("", "_unpaid")]
        energies = dict.fromkeys(names, "J")
        return {**self.plant.output_units, **energies, "air_total": "kg"}

    @property
    def state_lower_bounds(self) -> Sequence[float]:
        """The bounds of the plant; meters have none."""
        return [*self.plant.state_lower_bounds, *(-float("inf") for _ in self.meters)]

    def default_state(self) -> dict[str, float]:
        """The default initial state of the plant with every meter at zero."""
        return self.extend_state(self.plant.default_state())

    def extend_state(self, state: Mapping[str, float]) -> dict[str, float]:
        """A state of the plant with every meter at zero."""
        return {**state, **{meter.name: 0.0 for meter in self.meters}}

    def rates(self, state: Values, inputs: Values) -> dict[str, Value]:
        """The plant's rates, and the power that each meter integrates."""
        return self.rates_and_outputs(state, inputs)[0]

    def outputs(self, state: Values, inputs: Values) -> dict[str, Any]:
        """The plant's outputs; kinetic, potential and the muscles' air energy [J]; mass of all air
        [kg].
        """
        return self.rates_and_outputs(state, inputs)[1]

    def rates_and_outputs(
        self, state: Values, inputs: Values
    ) -> tuple[dict[str, Value], dict[str, Any]]:
        """Both from one evaluation of the plant."""
        plant = self.plant
        at = self.plant.evaluate(state, inputs)
        powers: dict[str, Value] = dict.fromkeys((meter.name for meter in self.meters), 0.0)
        for part, muscle, flow in zip(plant.muscles, at.muscles, at.flows, strict=True):
            powers["work_of_tension"] += muscle.tension * muscle.speed
            powers["work_of_air"] += muscle.air.pressure * muscle.volume_rate
            powers["energy_of_flow"] += plant.gas.energy_flow(
                muscle.states, flow, muscle.volume, plant.ambient
            )
            powers["heat_to_air"] += plant.gas.heat_flow(muscle.states, muscle.air, plant.ambient)
            for name, power in _muscle_powers(part, muscle).items():
                powers[name] += power
        place = {
            **state,
            **{f"{p}pressure": m.pressure for p, m in zip(plant.prefixes, at.muscles, strict=True)},
        }
        powers["mechanism_loss"] += plant.mechanism.dissipated_power(
            place, state, at.forces, inputs
        )
        stores = plant.mechanism.energy_accounts(place, state, at.forces, inputs)
        for name, store in stores.items():
            powers[f"{name}_work"] += store.received
            powers[f"{name}_heat"] += store.dissipated
        for circuit in at.circuits:
            powers["air_supplied"] += circuit.drawn.mass
            powers["air_exhausted"] += circuit.exhausted.mass
        energies = {
            "kinetic_energy": plant.mechanism.kinetic_energy(state, state),
            "potential_energy": plant.mechanism.potential_energy(state),
            "air_energy": sum(
                plant.gas.available_energy(m.states, m.volume, plant.ambient) for m in at.muscles
            ),
            "air_total": total_air({s.name: state[s.name] for s in plant.states}),
        }
        for name, store in stores.items():
            paid = state[f"{name}_work"] - state[f"{name}_heat"]
            energies[f"{name}_energy"] = store.stored
            energies[f"{name}_energy_unpaid"] = store.stored - paid
        return {**plant.rates_of(at, state), **powers}, {**plant.outputs_of(at), **energies}


def total_air(state: Mapping[str, Any]) -> Value:
    """Mass of all air in a plant [kg]: that of its muscles, tubes and tanks."""
    return sum(value for name, value in state.items() if name.endswith("air_mass"))


def _muscle_powers(part: Muscle, muscle: MuscleState) -> dict[str, Value]:
    """Power that the elements of a muscle deliver and absorb [W]."""
    pressure = muscle.pressure
    inner = muscle.inner_contraction
    speed = muscle.inner_speed
    length = part.geometry.resting_length
    opposing = part.spring.force(pressure, inner, length) + part.stop.force(inner, speed, length)
    if part.creep.states:
        opposing = opposing + part.creep.force(muscle.states)
    absorbed = opposing * speed
    if isinstance(part.series, ElasticSeriesElement):
        absorbed = absorbed + muscle.tension * (speed - muscle.speed)
    powers = {
        "work_of_contractile": part.contractile_force(pressure, inner) * speed,
        "element_work": absorbed,
        "damping_heat": part.damper.force(pressure, inner, speed) * speed,
    }
    if not isinstance(part.friction, NoFriction):
        powers["friction_work"] = muscle.friction * speed
    return powers

"""State of the muscles of a plant: one instant, steady state, evaluation of the whole plant."""

from typing import NamedTuple

from ...core import StateVariable, Value, Values
from ..muscle import Muscle
from ..muscle.friction import NoFriction
from ..pneumatics import Air, Ambient, CircuitFlows, Flow, Gas, gauge_pressure

_TYPICAL_CONTRACTION = 0.05
"""Contraction whose muscle volume defines the nominal value of the air mass (chosen)."""


class MuscleState(NamedTuple):
    """One muscle at one instant: contraction [1], shortening speed [m/s], volume [m3], pressures [Pa], forces [N].

    `inner_contraction` and `inner_speed` belong to the contractile part; with a series spring they differ from those of
    the fittings. `states` are the states of the muscle and of its air, without prefix; `rates` the rates of the former.
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


def muscle_state(
    muscle: Muscle, state: Values, contraction: Value, speed: Value, gas: Gas, ambient: Ambient
) -> MuscleState:
    """A muscle with its own state and that of its air, at a contraction and a shortening speed of its fittings."""
    inner = muscle.inner_contraction(contraction, state)
    volume = muscle.volume(inner, state)
    air = gas.air(state, volume, ambient)
    pressure = gauge_pressure(air.pressure, ambient)
    pull = muscle.compute_force(pressure, inner, contraction, speed, state)
    rates = muscle.rates(state, pressure, pull.inner_speed)
    growth = muscle.geometry.volume_derivative(inner) * pull.inner_speed / muscle.geometry.resting_length
    growth = sum((rates[s.name] for s in muscle.wall.states), growth)
    return MuscleState(
        contraction, speed, volume, air, pressure, pull.tension, pull.friction, inner, pull.inner_speed, growth, state,
        rates,
    )  # fmt: skip


def muscle_outputs(muscle: Muscle, instant: MuscleState, mass_flow: Value) -> dict[str, Value]:
    """The outputs of a muscle by their own names: those of every muscle, and those of the elements that it has."""
    outputs = {
        "pressure": instant.pressure, "contraction": instant.contraction, "force": instant.tension,
        "volume": instant.volume, "mass_flow": mass_flow,
    }  # fmt: skip
    if not isinstance(muscle.friction, NoFriction):
        outputs["friction"] = instant.friction
    if muscle.friction.identified_range is not None:
        outputs["shortening_speed"] = instant.inner_speed
    if "internal_energy" in instant.states:
        outputs["temperature"] = instant.air.temperature
    return outputs


def states_of_muscle(prefix: str, muscle: Muscle, states: tuple[StateVariable, ...]) -> list[StateVariable]:
    """States of a muscle by their names in the plant."""
    return [StateVariable(f"{prefix}{s.name}", s.unit, s.nominal, f"{s.meaning} of {muscle.name}") for s in states]


def air_states(muscle: Muscle, gas: Gas, ambient: Ambient) -> tuple[StateVariable, ...]:
    """States of the air in a muscle, by their own names."""
    return gas.states(muscle.geometry.volume(_TYPICAL_CONTRACTION), ambient)


class PlantEvaluation(NamedTuple):
    """Muscles and circuits of a plant at one instant; forces [N] or [N m] and accelerations by coordinate."""

    muscles: tuple[MuscleState, ...]
    circuits: tuple[CircuitFlows, ...]
    forces: Values
    accelerations: Values

    @property
    def flows(self) -> list[Flow]:
        """The flow into every muscle."""
        return [flow for circuit in self.circuits for flow in circuit.flows]

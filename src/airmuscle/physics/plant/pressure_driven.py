"""Plants with ports: muscles whose pressures are inputs, and a load that another simulator
carries.
"""

import functools
from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar, NamedTuple

from ...core import Array, ParameterError, Value, Values, check_known, model, parameter
from ...core.system import Input, StateVariable, select_prefix, with_prefix
from ..mechanism import ExternalLoad, Mechanism
from ..muscle import Muscle
from ..muscle.muscle import MuscleForce
from .plant import Plant
from .static_plant import MuscleSystem, states_of_muscle


class MusclePull(NamedTuple):
    """A muscle at a state of the plant: its contraction, its forces and its states."""

    contraction: Value
    force: MuscleForce
    states: dict[str, Value]


@model
class PressureDriven(MuscleSystem):
    """Muscles and a mechanism at given pressures: p_i' = (p_m,i - p_i)/T_i for each muscle i.

    p_m,i the input `NAME.measured_pressure` (gauge), p_i the pressure that acts, T_i its lag behind
    the reading: the time of the air in the muscle, less the delay of the sensor. The equations of
    muscles and mechanism are those of a Plant. It serves where pressures are recorded:
    identification of a joint, or its simulation along a record.
    """

    from_file: ClassVar[bool] = False

    muscle: tuple[Muscle, ...]
    mechanism: Mechanism
    lags: tuple[float, ...] = parameter(
        "s", "T_i", "lag of each pressure behind its reading", bounds=(1e-3, 10.0)
    )

    def check(self) -> None:
        count = self.mechanism.muscle_count
        if len(self.lags) != len(self.muscle) or count not in (None, len(self.muscle)):
            raise ParameterError(
                f"PressureDriven: {len(self.muscle)} muscles, {len(self.lags)} lags and a mechanism"
                f" for {'any number' if count is None else count} of muscles are given; give as"
                " many of each."
            )
        if len({m.name for m in self.muscle}) < len(self.muscle):
            raise ParameterError(
                "PressureDriven: two muscles have the same name; give each one of its own."
            )

    @functools.cached_property
    def states(self) -> tuple[StateVariable, ...]:
        """Coordinates and speeds, states of the mechanism, pressures, states of the muscles."""
        moving = [state for coordinate in self.mechanism.coordinates for state in coordinate.states]
        pressures = [
            StateVariable(f"{p}pressure", "Pa", 1e5, "gauge pressure that acts")
            for p in self.prefixes
        ]
        inner = [
            s
            for p, m in zip(self.prefixes, self.muscle, strict=True)
            for s in states_of_muscle(p, m, m.states)
        ]
        return (*moving, *self.mechanism.inner_states, *pressures, *inner)

    @functools.cached_property
    def input_variables(self) -> tuple[Input, ...]:
        """The measured pressures, then the inputs of the mechanism."""
        infinity = float("inf")
        measured = (
            Input(f"{p}measured_pressure", "Pa", -infinity, infinity, "gauge pressure")
            for p in self.prefixes
        )
        return (*measured, *self.mechanism.inputs)

    def _pulls(self, state: Values) -> list[MusclePull]:
        """The contraction, the forces and the own states of every muscle."""
        contractions = self.mechanism.contractions(state, self.resting_lengths)
        speeds = self.mechanism.contraction_speeds(state, state, self.resting_lengths)
        pulls = []
        for prefix, muscle, eps, v in zip(
            self.prefixes, self.muscle, contractions, speeds, strict=True
        ):
            muscle_states = select_prefix(prefix, state)
            pressure = state[f"{prefix}pressure"]
            force = muscle.compute_force(
                pressure, muscle.inner_contraction(eps, muscle_states), eps, v, muscle_states
            )
            pulls.append(MusclePull(eps, force, muscle_states))
        return pulls

    def rates(self, state: Values, inputs: Values) -> dict[str, Value]:
        rates = dict[str, Value]()
        pulls = self._pulls(state)
        for prefix, muscle, lag, pull in zip(
            self.prefixes, self.muscle, self.lags, pulls, strict=True
        ):
            pressure = state[f"{prefix}pressure"]
            inner_rates = muscle.rates(pull.states, pressure, pull.force.inner_speed)
            rates |= with_prefix(prefix, inner_rates)
            measured = inputs[f"{prefix}measured_pressure"]
            rates[f"{prefix}pressure"] = (measured - pressure) / lag
        tensions = [pull.force.tension for pull in pulls]
        forces = self.mechanism.generalised_forces(state, tensions, self.resting_lengths)
        accelerations = self.mechanism.acceleration(state, state, forces, inputs)
        for c in self.mechanism.coordinates:
            rates[c.name] = state[c.speed]
            rates[c.speed] = accelerations[c.name]
        rates |= self.mechanism.inner_rates(state, state, forces)
        return rates

    def outputs(self, state: Values, inputs: Values) -> dict[str, Value]:
        """Contraction and tension of every muscle."""
        outputs: dict[str, Value] = {}
        for prefix, pull in zip(self.prefixes, self._pulls(state), strict=True):
            outputs[f"{prefix}contraction"] = pull.contraction
            outputs[f"{prefix}force"] = pull.force.tension
        return outputs

    def state_at(self, pressures: Sequence[float] | Array, **values: float) -> dict[str, float]:
        """A state by the gauge pressure [Pa] of each muscle and states by name; the others are 0,
        muscles settled.
        """
        if len(pressures) != len(self.muscle):
            raise ParameterError(
                f"PressureDriven: {len(pressures)} pressures are given for {len(self.muscle)}"
                " muscles; give one each."
            )
        known = [s.name for s in self.states]
        check_known("PressureDriven: no state", values, known)
        state: dict[str, Value] = dict.fromkeys(known, 0.0)
        contractions = self.mechanism.contractions({**state, **values}, self.resting_lengths)
        for prefix, muscle, p, eps in zip(
            self.prefixes, self.muscle, pressures, contractions, strict=True
        ):
            state |= with_prefix(prefix, muscle.steady_state(p, eps))
            state[f"{prefix}pressure"] = p
        return {name: float(value) for name, value in {**state, **values}.items()}


def open_plant(plant: Plant, shortenings: Sequence[float] = ()) -> Plant:
    """The plant with shortenings [m] and their speeds [m/s] as inputs, and the tensions of its
    muscles as outputs.

    shortenings  of the muscles [m], from their resting lengths, in states without inputs; 0 by
                 default

    With one muscle the inputs are `shortening` and `shortening_speed`, and the output is `force`;
    with several, the name of the muscle precedes them. Raises ParameterError for another number of
    shortenings than muscles.
    """
    names = tuple(muscle.name for muscle in plant.muscles) if len(plant.muscles) > 1 else ()
    return replace(plant, mechanism=ExternalLoad(names, tuple(shortenings)))

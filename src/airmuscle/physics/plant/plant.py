"""Plant: muscles, the circuits that feed them, the mechanism that they act on, and the ambient
air.
"""

import functools
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from ...core import Array, GeometryLimitError, ParameterError, Value, Values, model
from ...core.diagnostics import ColumnLimit, Columns, Diagnostic, DiagnosticCode
from ...core.system import Input, StateVariable, add_prefix, select_prefix, with_prefix
from ...engine import compile as compilation
from .. import equilibrium
from ..mechanism import Mechanism
from ..muscle import Muscle
from ..muscle.friction import NoFriction
from ..pneumatics import DEFAULT_GAS, Ambient, Circuit, CircuitFlows, Gas
from . import diagnostics
from .display import PlantDisplay
from .static_plant import MuscleState, PlantEvaluation, StaticPlant, air_states, states_of_muscle
from .validation import check_parts, convert_pressures

_AIR_STATES = ("air_mass", "internal_energy")
_ROUNDING = 1e-3
"""Fraction of its nominal value by which an air mass may become negative within the tolerance
(chosen).
"""


@model
class Plant(PlantDisplay, StaticPlant):
    """Ordinary differential equations of muscles, valves and load. Air mass [kg] is the state,
    pressure an output.

    `muscle` is one or a tuple. `circuit` is a tuple with one for each muscle, or a single one that
    feeds them all. With one muscle, names have no prefix (`air_mass`, `pressure`, `bristle`); with
    several, the muscle's name is the prefix (`left.pressure`), also for a circuit in a tuple and
    for the tube of a muscle in a shared circuit.
    """

    checks_structure: ClassVar[bool] = True

    muscle: Muscle | tuple[Muscle, ...]
    circuit: Circuit | tuple[Circuit, ...]
    mechanism: Mechanism
    gas: Gas = DEFAULT_GAS
    ambient: Ambient = Ambient()

    def check(self) -> None:
        check_parts(self)
        convert_pressures(self)
        names = [*(s.name for s in self.states), *self.inputs]
        for name in (n for n in names if names.count(n) > 1):
            raise ParameterError(
                f"Plant: two of its parts use the name '{name}'; rename one of them."
            )

    @functools.cached_property
    def states(self) -> tuple[StateVariable, ...]:
        """Air in the muscles, the mechanism's coordinates and speeds, then states of muscles and
        circuits.
        """
        air = []
        inner = []
        for prefix, muscle in zip(self.prefixes, self.muscles, strict=True):
            air += states_of_muscle(prefix, muscle, air_states(muscle, self.gas, self.ambient))
            inner += states_of_muscle(prefix, muscle, muscle.states)
        moving = [state for coordinate in self.mechanism.coordinates for state in coordinate.states]
        circuit_states = [
            (prefix, s)
            for prefix, circuit in self._circuits()
            for s in circuit.states(self.ambient)
        ]
        circuits = [
            replace(s, name=name)
            for prefix, s in circuit_states
            for name in self._outside(prefix, {s.name: s})
        ]
        return (*air, *moving, *self.mechanism.inner_states, *inner, *circuits)

    @functools.cached_property
    def input_variables(self) -> tuple[Input, ...]:
        """Inputs of the circuits, then of the mechanism, with their ranges."""
        return (
            *(i for p, c in self._circuits() for i in add_prefix(p, c.inputs)),
            *self.mechanism.inputs,
        )

    @property
    def output_units(self) -> Mapping[str, str]:
        """Units of the accelerations."""
        return {c.acceleration: f"{c.unit}/s^2" for c in self.mechanism.coordinates}

    @property
    def state_lower_bounds(self) -> Sequence[float]:
        """Air masses and internal energies must not be negative, apart from rounding."""
        return [
            -_ROUNDING * s.nominal if s.name.endswith(_AIR_STATES) else -float("inf")
            for s in self.states
        ]

    @property
    def positive_outputs(self) -> Sequence[str]:
        """The volumes."""
        return [f"{prefix}volume" for prefix in self.prefixes]

    @property
    def constants(self) -> Mapping[str, float | str]:
        """Ambient pressure [Pa]; with one muscle its resting length [m]."""
        lengths = {"resting_length": self.resting_lengths[0]} if len(self.muscles) == 1 else {}
        return {"ambient": self.ambient.pressure, **lengths}

    def default_state(self) -> dict[str, float]:
        """The state of `find_equilibrium` at gauge pressure 0 and inputs 0."""
        return equilibrium.nearest_equilibrium(self, pressure=0.0)

    def default_states(self, parameters: Array) -> Array:
        """The same (N, n) for plants of this structure with parameters (N, P); NaN where there is
        none. Raises ParameterError where an input cannot be 0."""
        inputs = np.array(list(equilibrium.complete_inputs(self, None).values()), dtype=float)
        return equilibrium.find_equilibrium_of_each(
            compilation.compile_system(self), parameters, (0.0,) * len(self.muscles), inputs
        )

    def affects_default_state(self, path: str) -> bool:
        """Whether a parameter affects the equilibrium; those of a circuit without states do not."""
        return not path.startswith("circuit") or any(
            circuit.states(self.ambient) for circuit in self.circuits
        )

    def circuit_flows(
        self, muscles: Sequence[MuscleState], state: Values, inputs: Values
    ) -> tuple[CircuitFlows, ...]:
        """Flows, rates and outputs of every circuit."""
        air_states = self._by_circuit([muscle.air for muscle in muscles])
        return tuple(
            circuit.compute_flows(
                air, self._within(prefix, state), select_prefix(prefix, inputs), self.ambient
            )
            for (prefix, circuit), air in zip(self._circuits(), air_states, strict=True)
        )

    def evaluate(self, state: Values, inputs: Values) -> PlantEvaluation:
        """Muscles, circuits, forces and accelerations at a state."""
        muscles = self.muscle_states(state, inputs)
        place = {
            **state,
            **{f"{p}pressure": m.pressure for p, m in zip(self.prefixes, muscles, strict=True)},
        }
        forces = self.mechanism.generalised_forces(
            place, [m.tension for m in muscles], self.resting_lengths
        )
        accelerations = self.mechanism.acceleration(state, state, forces, inputs)
        return PlantEvaluation(
            muscles, self.circuit_flows(muscles, state, inputs), forces, accelerations
        )

    def rates(self, state: Values, inputs: Values) -> dict[str, Value]:
        """The time derivative of every state."""
        return self.rates_of(self.evaluate(state, inputs), state)

    def rates_of(self, at: PlantEvaluation, state: Values) -> dict[str, Value]:
        """The rates from an evaluation at this state."""
        rates: dict[str, Value] = {}
        for muscle, prefix, flow in zip(at.muscles, self.prefixes, at.flows, strict=True):
            air_rates = self.gas.rates(
                muscle.states, muscle.air, flow, muscle.volume_rate, self.ambient
            )
            rates |= with_prefix(prefix, air_rates)
            rates |= with_prefix(prefix, muscle.rates)
        for c in self.mechanism.coordinates:
            rates[c.name] = state[c.speed]
            rates[c.speed] = at.accelerations[c.name]
        rates |= self.mechanism.inner_rates(state, state, at.forces)
        for (prefix, _), circuit in zip(self._circuits(), at.circuits, strict=True):
            rates |= self._outside(prefix, circuit.rates)
        return rates

    def outputs(self, state: Values, inputs: Values) -> dict[str, Value]:
        """Gauge pressure, contraction, tension, volume, mass flow and, where modelled, friction
        force, shortening speed and temperature of every muscle; outputs of the circuits;
        accelerations."""
        return self.outputs_of(self.evaluate(state, inputs))

    def outputs_of(self, at: PlantEvaluation) -> dict[str, Value]:
        """The outputs from an evaluation."""
        outputs: dict[str, Value] = {}
        for part, prefix, muscle, flow in zip(
            self.muscles, self.prefixes, at.muscles, at.flows, strict=True
        ):
            columns = {
                "pressure": muscle.pressure,
                "contraction": muscle.contraction,
                "force": muscle.tension,
            }
            columns |= {"volume": muscle.volume, "mass_flow": flow.mass}
            if not isinstance(part.friction, NoFriction):
                columns["friction"] = muscle.friction
            if part.friction.identified_range is not None:
                columns["shortening_speed"] = muscle.inner_speed
            if "internal_energy" in muscle.states:
                columns["temperature"] = muscle.air.temperature
            outputs |= with_prefix(prefix, columns)
        for (prefix, _), circuit in zip(self._circuits(), at.circuits, strict=True):
            outputs |= self._outside(prefix, circuit.outputs)
        return outputs | {
            c.acceleration: at.accelerations[c.name] for c in self.mechanism.coordinates
        }

    def rates_and_outputs(
        self, state: Values, inputs: Values
    ) -> tuple[dict[str, Value], dict[str, Value]]:
        """Both from one evaluation."""
        at = self.evaluate(state, inputs)
        return self.rates_of(at, state), self.outputs_of(at)

    def check_state(self, state: Mapping[str, float]) -> None:
        """Raise GeometryLimitError for an impossible contraction, ParameterError for a volume that
        is not positive.
        """
        for muscle, contraction, inner, volume in self._enclosures(state):
            muscle.geometry.check_contraction(inner)
            if not volume > 0.0:
                raise ParameterError(
                    f"the initial state: the volume of {muscle.name} is {volume:.4g} m3 at a"
                    f" contraction of {100 * contraction:.2f} %; choose a contraction further"
                    " within its range."
                )

    def _enclosures(self, state: Mapping[str, float]) -> list[tuple[Muscle, float, float, float]]:
        """Each muscle with its contraction, the contraction of its contractile part, and its volume
        [m3].
        """
        enclosures = []
        contractions = self.mechanism.contractions(state, self.resting_lengths)
        for muscle, prefix, contraction in zip(
            self.muscles, self.prefixes, contractions, strict=True
        ):
            muscle_states = select_prefix(prefix, state)
            inner = muscle.inner_contraction(contraction, muscle_states)
            enclosures.append((muscle, contraction, inner, muscle.volume(inner, muscle_states)))
        return enclosures

    def describe(self) -> tuple[Diagnostic, ...]:
        """The gas and the friction."""
        gas = Diagnostic(DiagnosticCode.MODEL, "gas", f"gas: {str(self.gas).removesuffix('()')}")
        return gas, diagnostics.friction(self.muscles)

    def diagnose(self, columns: Columns) -> list[Diagnostic]:
        """Extrapolation of characteristics, limits of geometries, components beyond the validity of
        their model.
        """
        rated, limits, circuits = self._checks
        remarks: dict[str, str] = {}
        for prefix, circuit in circuits:
            remarks |= self._outside(
                prefix, circuit.validity_warnings(self._within(prefix, columns), self.ambient)
            )
        named = ((name.removesuffix("."), text) for name, text in remarks.items())
        parts = [
            Diagnostic(DiagnosticCode.COMPONENT, name, f"{name}: {text}") for name, text in named
        ]
        return [*rated, *diagnostics.extrapolation(limits, columns), *parts]

    @functools.cached_property
    def _checks(self) -> tuple[list[Diagnostic], Any, list[tuple[str, Circuit]]]:
        """Diagnostics of every run, and the limits of columns and the circuits that `diagnose`
        compares a run with.
        """
        rated = [
            Diagnostic(DiagnosticCode.RATING, muscle.name, f"{muscle.name}: {text}")
            for muscle in self.muscles
            if muscle.ratings
            for text in muscle.ratings.excesses(temperature=self.ambient.temperature)
        ]
        limited = (
            type(circuit).validity_warnings is not Circuit.validity_warnings
            for circuit in self.circuits
        )
        circuits = list(itertools.compress(self._circuits(), limited))
        return rated, diagnostics.with_tolerance(self.column_limits), circuits

    @functools.cached_property
    def column_limits(self) -> tuple[ColumnLimit, ...]:
        """Validity ranges and ratings of the muscles, and the ranges of their geometries."""
        named = zip(self.prefixes, self.muscles, strict=True)
        return tuple(
            ColumnLimit(m.name, *limit)
            for prefix, m in named
            for limit in diagnostics.limits_of(m, prefix)
        )

    def failure_hint(self, state: Mapping[str, float]) -> str:
        """Remedy for the first muscle that is at, or beyond, a limit of its geometry."""
        try:
            hints = (
                diagnostics.geometry_limit_hint(muscle, inner)
                for muscle, _, inner, _ in self._enclosures(state)
            )
            return next(filter(None, hints), "")
        except GeometryLimitError as error:
            return str(error)

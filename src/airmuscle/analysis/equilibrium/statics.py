"""A plant at rest as a function of its coordinates: its state, and what is out of balance there."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TypeAlias

import numpy as np

from ...control.inputs import check_input_names
from ...core import ops
from ...core.arrays import Array
from ...core.errors import EquilibriumError, ParameterError
from ...core.ops import Value
from ...muscle import Muscle
from ...plant.plant import Plant
from ...pneumatics.gas import absolute_pressure, gauge_pressure

Given: TypeAlias = float | tuple[float, ...] | None
STRETCHED = -0.5
"""No search goes beyond this contraction [1]; a geometry may be defined far past it."""
GREATEST = 1e8
"""Greatest absolute pressure [Pa] that a mass of air is looked for at."""


class StaticProblem:
    """What is given of a plant's air, and how the rest of its state follows from its coordinates."""

    def __init__(
        self, plant: Plant, pressure: Given, air_mass: Given, inputs: Mapping[str, float] | None = None
    ) -> None:
        from ...compile.program import compile_system  # CasADi, which describing a plant does not need

        if (pressure is None) == (air_mass is None):
            raise ParameterError("equilibrium: give either the pressure [Pa] or the air_mass [kg] of the muscles.")
        self.plant = plant
        self.shut = pressure is None
        self.air = _each(plant, "pressure" if air_mass is None else "air_mass", pressure, air_mass)
        self.inputs = given_inputs(plant, inputs)
        self.coordinates = plant.mechanism.coordinates
        self.names = [s.name for s in plant.states]
        self.speeds = [self.names.index(c.speed) for c in self.coordinates]
        self.ready = compile_system(plant)
        self.lengths = [float(length) for length in plant.resting_lengths]
        self._before = (0.0,) * len(self.air)  # pressures of the place before: the next are near
        self.reach = [reach_of(m) for m in plant.muscles]

    def place(self, x: Sequence[float] | Array) -> dict[str, float]:
        """Coordinates by name from a vector."""
        return {c.name: float(v) for c, v in zip(self.coordinates, x, strict=True)}

    def contractions(self, q: Mapping[str, float]) -> list[float]:
        """Contraction [1] of every muscle."""
        return [float(c) for c in self.plant.mechanism.contractions(q, self.lengths)]

    def contracted(self, state: Mapping[str, float]) -> float:
        """How far a state is from full length: the sum of squared contractions."""
        return sum(c**2 for c in self.contractions(state))

    def within_reach(self, q: Mapping[str, float]) -> bool:
        """Whether every muscle can take its contraction there."""
        return all(low <= c <= high for c, (low, high) in zip(self.contractions(q), self.reach, strict=True))

    def state(self, q: Mapping[str, float]) -> dict[str, float]:
        """The state at rest with these coordinates."""
        return self.plant.state_at(pressure=self.pressures(q) if self.shut else self.air, **q)

    def pressures(self, q: Mapping[str, float]) -> tuple[float, ...]:
        """Gauge pressure [Pa] of every muscle there."""
        if not self.shut:
            return self.air
        given = zip(self.plant.muscles, self.air, self.contractions(q), self._before, strict=True)
        self._before = tuple(pressure_of(self.plant, m, mass, eps, guess) for m, mass, eps, guess in given)
        return self._before

    def accelerations(self, q: Mapping[str, float]) -> Array:
        """Acceleration of every coordinate from rest there: 0 where it rests, nan where no pressure holds the air."""
        try:
            state = self.state(q)
        except EquilibriumError:  # at the ends of its reach a muscle may have no volume
            return np.full(len(self.coordinates), np.nan)
        return self.ready.rates([state[n] for n in self.names], list(self.inputs.values()))[self.speeds]


def _each(plant: Plant, name: str, pressure: Given, air_mass: Given) -> tuple[float, ...]:
    given, unit = (pressure, "Pa") if air_mass is None else (air_mass, "kg")
    values = given if isinstance(given, tuple) else (given,) * len(plant.muscles)
    if len(values) != len(plant.muscles):
        raise ParameterError(
            f"equilibrium: {name} has {len(values)} values; the plant has {len(plant.muscles)} muscles."
        )
    for value in values:
        if not isinstance(value, float | int | np.floating) or not np.isfinite(value):
            raise ParameterError(f"equilibrium: {name} is {value!r}; it must be a finite number of {unit}.")
        if air_mass is not None and not value > 0:
            raise ParameterError(f"equilibrium: air_mass is {value:g} kg; it must be greater than 0.")
    return tuple(float(value) for value in values if value is not None)


def given_inputs(plant: Plant, inputs: Mapping[str, float] | None) -> dict[str, float]:
    """Every input of a plant, 0 unless given. Raises ParameterError for an unknown name or one beyond its range."""
    given = dict(inputs or {})
    check_input_names(list(given), plant.inputs)
    for command in plant.commands:
        value = given.get(command.name, 0.0)
        if isinstance(value, str) or not np.ndim(value) == 0:
            raise ParameterError(f"the input '{command.name}' is {value!r}; it must be one number, in SI units.")
        if not command.minimum <= value <= command.maximum:
            unit = "" if command.unit == "1" else f" {command.unit}"
            raise ParameterError(
                f"the input '{command.name}' is {value:g}{unit}; allowed range: {command.minimum:g} to "
                f"{command.maximum:g}{unit} ({command.meaning})."
            )
    return {name: float(given.get(name, 0.0)) for name in plant.inputs}


def reach_of(muscle: Muscle) -> tuple[Value, Value]:
    """The contractions [1] between which a rest of a muscle is looked for."""
    low, high = muscle.geometry.contraction_range
    low = ops.maximum(low, STRETCHED)
    margin = 1e-9 * (high - low)
    return low + margin, high - margin


def pressure_of(plant: Plant, muscle: Muscle, air_mass: float, contraction: float, guess: float = 0.0) -> float:
    """Gauge pressure [Pa] of a mass of air [kg] shut in a muscle at rest; wall and series spring settled.

    `guess` is where the search begins [Pa]. Raises NoEquilibrium, naming the muscle, where no pressure up to 1000 bar
    belongs to it.
    """

    def excess(x: float) -> float:
        """log of the air that the muscle holds at an absolute pressure exp(x), less that of the given air."""
        p = gauge_pressure(math.exp(x), plant.ambient)
        own = muscle.steady_state(p, contraction)
        volume = muscle.volume(muscle.inner_contraction(contraction, own), own)
        held = float(plant.gas.state_at(math.exp(x), volume, plant.ambient)["air_mass"])
        return math.log(held / air_mass) if held > 0 else -math.inf

    a = math.log(absolute_pressure(guess, plant.ambient))
    at_a = excess(a)
    b = a - at_a
    for _ in range(20):  # the secant is exact for a rigid wall and a gas that keeps to one process
        at_b = excess(b) if math.isfinite(b) and b < math.log(GREATEST) else math.nan
        if not math.isfinite(at_b):
            break
        if abs(at_b) < 1e-13 or at_b == at_a:
            return float(gauge_pressure(math.exp(b), plant.ambient))
        a, b, at_a = b, b - at_b * (b - a) / (at_b - at_a), at_b
    low, high = 0.0, math.log(GREATEST)
    if not excess(low) < 0 < excess(high):
        raise EquilibriumError(
            f"{muscle.name} cannot hold {air_mass:g} kg of air at a contraction of {contraction:.1%}: no pressure "
            f"below {GREATEST:g} Pa belongs to it."
        )
    while low < (middle := 0.5 * (low + high)) < high:
        low, high = (middle, high) if excess(middle) < 0 else (low, middle)
    return float(gauge_pressure(math.exp(low), plant.ambient))

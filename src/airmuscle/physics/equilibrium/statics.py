"""Statics of plants: states at rest and residual accelerations as functions of the coordinates."""

import dataclasses
import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import AirmuscleError, Array, Value, ops, tree
from ...core.declaration import forwarded
from ...engine.compile.cache.kernel import evaluate_rates
from ...engine.compile.program import CompiledSystem
from ..muscle import Muscle
from ..plant.static_plant import StaticPlant
from ..pneumatics.gas import absolute_pressure, gauge_pressure

MAX_PRESSURE = 1e8
"""Maximum absolute pressure [Pa] of the search."""
_TOLERANCE = 1e-13
"""Relative error of the air mass at which the search ends."""


def shut_air_pressure(
    plant: StaticPlant, muscle: Muscle, air_mass: float, contraction: Array
) -> Array:
    """Gauge pressure [Pa] of a mass of air [kg] in a muscle at rest, wall and series spring in
    steady state.

    Contractions are arrays that broadcast with the parameters of the plant; NaN if the pressure
    would exceed 1000 bar.
    """

    def excess(x: Array) -> Array:
        """Logarithm of the ratio of the air mass at the absolute pressure exp(x) to the given air
        mass.
        """
        p = gauge_pressure(np.exp(x), plant.ambient)
        steady_states = muscle.steady_state(p, contraction)
        inner = muscle.inner_contraction(contraction, steady_states)
        volume = muscle.volume(inner, steady_states)
        content = plant.gas.state_at(np.exp(x), volume, plant.ambient)
        mass: Any = np.asarray(content["air_mass"])
        ratio = np.where(mass > 0, mass, 1.0) / air_mass
        return np.where(mass > 0, np.log(ratio), -np.inf)

    with np.errstate(all="ignore"):
        start = np.log(np.asarray(absolute_pressure(0.0, plant.ambient), dtype=float))
        x = _secant(excess, start + np.zeros_like(excess(start)))
        if np.isnan(x).any():
            x = np.where(np.isnan(x), _bisection(excess, x.shape), x)
        return np.asarray(gauge_pressure(np.exp(x), plant.ambient))


def _secant(excess: Callable[[Array], Array], a: Array) -> Array:
    """The root of every element by the secant method; NaN if it fails. For a rigid wall and a
    polytropic process it is exact."""
    at_a = excess(a)
    b = a - at_a
    root = np.full(a.shape, np.nan)
    lost = np.zeros(a.shape, dtype=bool)
    for _ in range(20):
        is_possible = np.isfinite(b) & (b < math.log(MAX_PRESSURE))
        at_b = np.where(is_possible, excess(b), np.nan)
        is_open = np.isnan(root) & ~lost
        lost |= is_open & ~np.isfinite(at_b)
        has_converged = (np.abs(at_b) < _TOLERANCE) | (at_b == at_a)
        root = np.where(is_open & ~lost & has_converged, b, root)
        if (lost | np.isfinite(root)).all():
            break
        following = b - at_b * (b - a) / (at_b - at_a)
        a = b
        b = following
        at_a = at_b
    return root


def _bisection(excess: Callable[[Array], Array], shape: tuple[int, ...]) -> Array:
    """The root of every element between 1 Pa and the maximum pressure, by bisection; NaN if there
    is none.
    """
    low = np.zeros(shape)
    high = np.full(shape, math.log(MAX_PRESSURE))
    possible = (excess(low) < 0.0) & (excess(high) > 0.0)
    while True:
        middle = 0.5 * (low + high)
        if not ((low < middle) & (middle < high)).any():
            return np.where(possible, low, np.nan)
        below = excess(middle) < 0.0
        low = np.where(below, middle, low)
        high = np.where(below, high, middle)


Rows = npt.NDArray[np.intp]
LOWEST_CONTRACTION = -0.5
"""Smallest contraction in the search for equilibria; a geometry may be defined far below it
(chosen).
"""
_NO_ARRAYS = (TypeError, ValueError, ArithmeticError, AirmuscleError)
"""Errors of a law that accepts scalars only, or that is not defined for one of the plants."""


@dataclasses.dataclass(frozen=True, eq=False)
class Statics:
    """N plants of one structure at rest, as functions of their d coordinates at K points each, x
    (N, K, d).

    compiled     any of the plants
    parameters   (N, P) all parameters of each
    precomputed  (N, c) parameter-dependent values for the compiled functions
    air          gauge pressure [Pa] of each muscle or, with `shut` valves, mass of its air [kg]
    inputs       (m,); air and inputs are the same for all plants
    plants       one Plant with an array (N, 1) for every parameter
    """

    compiled: CompiledSystem
    parameters: Array
    precomputed: Array
    air: tuple[float, ...]
    shut: bool
    inputs: Array
    plants: StaticPlant

    @classmethod
    def of_plants(
        cls,
        compiled: CompiledSystem,
        parameters: Array,
        air: tuple[float, ...],
        inputs: Array,
        shut: bool = False,
    ) -> "Statics":
        """The plants with these parameters (N, P)."""
        precomputed = np.array(
            [compiled.program.precompute(row) for row in np.ascontiguousarray(parameters)]
        )
        plant = compiled.system
        assert isinstance(plant, StaticPlant)
        return cls(
            compiled, parameters, precomputed, air, shut, inputs, _with_arrays(plant, parameters)
        )

    def of(self, rows: Rows) -> "Statics":
        """A selection of the plants, possibly with repetitions."""
        parameters = self.parameters[rows]
        plants = self.plants if len(self.parameters) == 1 else _with_arrays(self.plants, parameters)
        return dataclasses.replace(
            self, parameters=parameters, precomputed=self.precomputed[rows], plants=plants
        )

    @functools.cached_property
    def separate(self) -> list[StaticPlant]:
        """The plants, each with scalar parameters."""
        plant = self.compiled.system
        assert isinstance(plant, StaticPlant)
        return [tree.unflatten(plant, row.tolist()) for row in self.parameters]

    names = forwarded("compiled.description.state_names")

    def limits(self, index: int) -> tuple[Array, Array, Array]:
        """Nominal size and limits (N, 1) of a coordinate."""
        c = self.plants.mechanism.coordinates[index]
        shape = (len(self.parameters), 1)
        nominal, low, high = (
            np.array(np.broadcast_to(v, shape)) for v in (c.nominal, c.lower_limit, c.upper_limit)
        )
        return nominal, low, high

    def nominal_sizes(self) -> Array:
        """Nominal sizes (d,) of the coordinates of the first plant."""
        return np.array(
            [self.limits(i)[0][0, 0] for i in range(len(self.plants.mechanism.coordinates))]
        )

    @functools.cached_property
    def contraction_limits(self) -> list[tuple[Value, Value]]:
        """Limits of the contraction of each muscle in the search for equilibria."""
        limits = []
        for muscle in self.plants.muscles:
            low, high = muscle.geometry.contraction_range
            low = ops.maximum(low, LOWEST_CONTRACTION)
            margin = 1e-9 * (high - low)
            limits.append((low + margin, high - margin))
        return limits

    def allowed(self) -> npt.NDArray[np.bool_]:
        """Plants (N,) for which the inputs and pressures are allowed."""
        permitted = np.array(np.broadcast_to(True, (len(self.parameters), 1)))
        for variable, value in zip(self.plants.input_variables, self.inputs, strict=True):
            permitted &= variable.minimum <= value
            permitted &= value <= variable.maximum
        pressures = () if self.shut else self.air
        for pressure in pressures:
            absolute = np.asarray(absolute_pressure(pressure, self.plants.ambient))
            permitted &= absolute > 0.0
        return permitted[:, 0]

    def contractions(self, x: Array) -> list[Array]:
        """Contraction of every muscle (N, K)."""
        try:
            values = self.plants.mechanism.contractions(
                self._coordinate_values(x), self.plants.resting_lengths
            )
            return [np.broadcast_to(np.asarray(eps, dtype=float), x.shape[:2]) for eps in values]
        except _NO_ARRAYS:
            table = np.empty((len(self.plants.muscles), *x.shape[:2]))
            for i, k in np.ndindex(*x.shape[:2]):
                plant = self.separate[i]
                table[:, i, k] = plant.mechanism.contractions(
                    self.place(x[i, k]), plant.resting_lengths
                )
            return list(table)

    def within_reach(self, x: Array) -> npt.NDArray[np.bool_]:
        """Whether the contraction of every muscle is within its limits (N, K)."""
        inside = np.ones(x.shape[:2], dtype=bool)
        for eps, (low, high) in zip(self.contractions(x), self.contraction_limits, strict=True):
            inside &= eps >= low
            inside &= eps <= high
        return inside

    def place(self, x: Array) -> dict[str, float]:
        """Coordinates (d,) by name."""
        return {c.name: float(v) for c, v in zip(self.plants.mechanism.coordinates, x, strict=True)}

    def _coordinate_values(self, x: Array) -> dict[str, Value]:
        return {c.name: x[..., i] for i, c in enumerate(self.plants.mechanism.coordinates)}

    def states(self, x: Array) -> Array:
        """The states at rest (N, K, n); NaN at impossible coordinates."""
        try:
            with np.errstate(all="ignore"):
                return self._states(x)
        except _NO_ARRAYS:
            return self._states_one_by_one(x)

    def _states(self, x: Array) -> Array:
        plant = self.plants
        shape = x.shape[:2]
        known = self._coordinate_values(x) | {
            c.speed: 0.0 for c in self.plants.mechanism.coordinates
        }
        contractions = self.contractions(x)
        possible = np.ones(shape, dtype=bool)
        for eps, muscle in zip(contractions, plant.muscles, strict=True):
            low, high = muscle.geometry.contraction_range
            possible &= (eps >= low) & (eps <= high)
        pressures: list[Value] = list(self.air)
        if self.shut:
            air = zip(plant.muscles, self.air, contractions, strict=True)
            pressures = [shut_air_pressure(plant, muscle, mass, eps) for muscle, mass, eps in air]
        state, volumes = plant.settle_muscles(pressures, known)
        for volume, pressure in zip(volumes, pressures, strict=True):
            possible &= (np.asarray(volume) > 0.0) & np.isfinite(pressure)
        state = plant.fill_muscles(pressures, volumes, state)
        table = np.empty((*shape, len(self.names)))
        for i, name in enumerate(self.names):
            table[..., i] = state[name]
        table[~possible] = np.nan
        return table

    def _states_one_by_one(self, x: Array) -> Array:
        """The states at rest of plants with laws that accept scalars only."""
        table = np.full((*x.shape[:2], len(self.names)), np.nan)
        for i, k in np.ndindex(*x.shape[:2]):
            plant, place = self.separate[i], self.place(x[i, k])
            try:
                pressures = self.air
                if self.shut:
                    contractions = plant.mechanism.contractions(place, plant.resting_lengths)
                    air = zip(plant.muscles, self.air, contractions, strict=True)
                    pressures = tuple(
                        float(shut_air_pressure(plant, m, mass, np.array(eps)))
                        for m, mass, eps in air
                    )
                state = plant.state_at(pressure=pressures, **place)
            except (AirmuscleError, ValueError, ArithmeticError):
                continue
            table[i, k] = [state[name] for name in self.names]
        return table

    def accelerations(self, x: Array) -> Array:
        """Acceleration of every coordinate from rest (N, K, d); NaN at impossible coordinates."""
        states = np.ascontiguousarray(self.states(x))
        rates = np.empty_like(states)
        if states.size:
            evaluate_rates(
                function=self.compiled.address["rhs"],
                precomputed=self.precomputed,
                inputs=self.inputs,
                states=states,
                rates=rates,
            )
        accelerations = rates[
            ..., [self.names.index(c.speed) for c in self.plants.mechanism.coordinates]
        ]
        accelerations[np.isnan(states).any(axis=-1)] = (
            np.nan
        )  # a limited force is finite also there
        return accelerations

    def state(self, x: Array) -> dict[str, float]:
        """The state at rest of the first plant at coordinates (d,), as a mapping."""
        return dict(zip(self.names, self.states(x[None, None])[0, 0].tolist(), strict=True))


def _with_arrays(plant: StaticPlant, parameters: Array) -> StaticPlant:
    """The plant with an array (N, 1) for every parameter, also if N = 1: powers of scalars and
    arrays differ in the last digit, and the equilibrium of a plant must not depend on the number of
    plants."""
    return tree.unflatten(plant, [column[:, None].copy() for column in parameters.T])

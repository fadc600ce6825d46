"""Equilibria of a plant, and the stable equilibrium nearest to full length of each of many
plants.
"""

import dataclasses
import warnings
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from ...core import (
    AirmuscleError,
    AirmuscleWarning,
    Array,
    EquilibriumError,
    ParameterError,
    System,
    one_line,
    quantity,
    select_prefix,
)
from ...engine.compile.program import CompiledSystem, compile_system
from ...engine.loop.inputs import check_input_names
from ..plant.static_plant import StaticPlant
from .single_dof import GRID_POINTS, equilibria_of_one_coordinate, grid
from .stability import are_stable, equilibria_of_several_coordinates, no_equilibrium
from .statics import Rows, Statics, shut_air_pressure

MuscleValues: TypeAlias = float | str | Sequence[float | str] | None
"""One number for all muscles, or one for each; None where the other quantity is given."""


def complete_inputs(system: System, inputs: Mapping[str, float] | None) -> dict[str, float]:
    """Every input of a system, 0 unless given. Raises ParameterError for an unknown name or one
    beyond its range.
    """
    stated = dict(inputs or {})
    check_input_names(list(stated), system.inputs)
    for variable in system.input_variables:
        value = stated.get(variable.name, 0.0)
        if isinstance(value, str) or not np.ndim(value) == 0 or not np.isfinite(value):
            raise ParameterError(
                f"the input '{variable.name}' is {value!r}; it must be one finite number, in SI"
                " units."
            )
        if not variable.minimum <= value <= variable.maximum:
            unit = "" if variable.unit in ("", "1") else f" {variable.unit}"
            raise ParameterError(
                f"the input '{variable.name}' is {value:g}{unit}; allowed range:"
                f" {variable.minimum:g} to {variable.maximum:g}{unit} ({variable.meaning})."
            )
    return {name: float(stated.get(name, 0.0)) for name in system.inputs}


UNPRESSURISED = 1.0
"""Gauge pressure [Pa] below which a muscle is without pressure (chosen)."""
TABLE_SIZE = 500_000
"""Size of a table of states of several plants; a greater one takes memory and saves little time
(measured).
"""


@dataclasses.dataclass(frozen=True)
class Equilibrium:
    """One equilibrium: its state, and whether it is stable for small displacements of the
    mechanism.
    """

    state: dict[str, float]
    stable: bool


def find_equilibria(
    plant: StaticPlant,
    *,
    pressure: MuscleValues = None,
    air_mass: MuscleValues = None,
    inputs: Mapping[str, float] | None = None,
) -> tuple[Equilibrium, ...]:
    """Static equilibria for given pressures or air masses of the muscles, sorted by ascending
    coordinates.

    pressure   gauge pressure [Pa] of the muscle, a number for all or a tuple with one for each;
               also texts with a unit
    air_mass   alternatively: mass of the air [kg] with closed valves; the gas law determines the
               pressure at the temperature of the air at rest
    inputs     0 by default, so that a latch is open

    Walls, series springs, tubes and tanks are in steady state, friction and creep relaxed. `stable`
    follows from the eigenvalues of the motion, without friction, at constant pressure or with
    enclosed air.

    With one coordinate, the whole range of the muscles is searched; a pair of equilibria closer
    than 1/100 of the range is found by the extremum of the force between them. With several,
    Newton's method starts from many points and may miss an equilibrium to which none of them
    converges. Raises ParameterError or UnitError for invalid values, GeometryLimitError if the
    mechanism fixes a muscle at a contraction beyond its limits, EquilibriumError if every position
    is an equilibrium.
    """
    statics = _statics(plant, pressure, air_mass, inputs)
    rows, x = _balances(statics)
    count = len(statics.plants.mechanism.coordinates)
    if not rows.size and count < 2:
        everywhere = grid(statics) if count else None
        f = (
            np.empty(0)
            if everywhere is None
            else statics.accelerations(everywhere[:, np.isfinite(everywhere[0]), None])
        )
        if (
            not f.size or (f == 0.0).any()
        ):  # without a permitted position, or in equilibrium everywhere
            raise no_equilibrium(statics)
    states, stable = _judged(statics, rows, x)
    named = (dict(zip(statics.names, state.tolist(), strict=True)) for state in states)
    return tuple(Equilibrium(state, bool(s)) for state, s in zip(named, stable, strict=True))


def find_equilibrium(
    plant: StaticPlant,
    *,
    pressure: MuscleValues = None,
    air_mass: MuscleValues = None,
    inputs: Mapping[str, float] | None = None,
) -> dict[str, float]:
    """The stable equilibrium whose muscles are nearest to full length; arguments are those of
    `find_equilibria`.

    Nearest to full length is the smallest sum of squared contractions. An AirmuscleWarning names
    the muscles whose law is outside its range there. Without pressure, at 0 bar gauge, where every
    muscle begins, neither the least pressure of the range nor the pretension that the maker permits
    is a reason. Raises EquilibriumError, with the muscles and
    their forces, if no stable equilibrium is found.
    """
    statics = _statics(plant, pressure, air_mass, inputs)
    state = _nearest_state(statics)
    if texts := _range_excesses(plant, statics, state):
        warnings.warn(
            f"find_equilibrium: {' '.join(texts)} The equilibrium is extrapolated.",
            AirmuscleWarning,
            stacklevel=3,
        )
    return state


def nearest_equilibrium(
    plant: StaticPlant,
    *,
    pressure: MuscleValues = None,
    inputs: Mapping[str, float] | None = None,
) -> dict[str, float]:
    """That of `find_equilibrium`, for the beginning of a run, whose notes name the ranges."""
    return _nearest_state(_statics(plant, pressure, None, inputs))


def _nearest_state(statics: Statics) -> dict[str, float]:
    state = _nearest(statics)[0]
    if not np.isfinite(state).all():
        raise no_equilibrium(statics)
    return dict(zip(statics.names, state.tolist(), strict=True))


def _range_excesses(plant: StaticPlant, statics: Statics, state: Mapping[str, float]) -> list[str]:
    """Sentences on the muscles whose contractile element is outside its range at a state."""
    texts = []
    contractions = plant.mechanism.contractions(state, plant.resting_lengths)
    for prefix, muscle, air, contraction in zip(
        plant.prefixes, plant.muscles, statics.air, contractions, strict=True
    ):
        pressure = air
        if statics.shut:
            pressure = float(shut_air_pressure(plant, muscle, air, np.array(contraction)))
        inner = muscle.inner_contraction(contraction, select_prefix(prefix, state))
        if abs(pressure) < UNPRESSURISED:
            excess = muscle.excess_at_rest(float(inner))
        else:
            excess = muscle.range_excess(float(pressure), float(inner))
        if excess:
            texts.append(f"{muscle.name}: {excess}.")
    return texts


def find_equilibrium_of_each(
    compiled: CompiledSystem, parameters: Array, pressures: tuple[float, ...], inputs: Array
) -> Array:
    """The states (N, n) of `find_equilibrium` for plants of one structure with parameters (N, P);
    NaN if none exists.

    The gauge pressures [Pa] of the muscles and the inputs (m,) are the same for all; `compiled` is
    any of the plants.
    """
    size = len(compiled.description.state_names)
    table = np.full((len(parameters), size), np.nan)
    block = max(1, TABLE_SIZE // (GRID_POINTS * size))
    for begin in range(0, len(parameters), block):
        part = slice(begin, begin + block)
        table[part] = _each_nearest(compiled, parameters[part], pressures, inputs)
    return table


def _each_nearest(
    compiled: CompiledSystem, parameters: Array, pressures: tuple[float, ...], inputs: Array
) -> Array:
    try:
        return _nearest(Statics.of_plants(compiled, parameters, pressures, inputs))
    except (TypeError, ValueError, ArithmeticError, AirmuscleError):  # one of the plants is invalid
        if len(parameters) == 1:
            return np.full((1, len(compiled.description.state_names)), np.nan)
    return np.vstack([_each_nearest(compiled, row[None], pressures, inputs) for row in parameters])


def _statics(
    plant: StaticPlant,
    pressure: MuscleValues,
    air_mass: MuscleValues,
    inputs: Mapping[str, float] | None,
) -> Statics:
    """The arguments as a table of one plant. Raises ParameterError or UnitError."""
    if (pressure is None) == (air_mass is None):
        raise ParameterError(
            "find_equilibrium: give either the pressure [Pa] or the air_mass [kg] of the muscles."
        )
    air = _air_of_muscles(plant, pressure, air_mass)
    commands = np.array(list(complete_inputs(plant, inputs).values()), dtype=float)
    compiled = compile_system(plant)
    statics = Statics.of_plants(
        compiled, compiled.parameters[None], air, commands, pressure is None
    )
    if not statics.shut and not statics.allowed().all():
        plant.state_at(pressure=air)
        raise EquilibriumError(
            f"{type(plant.mechanism).__name__}: the pressures {air} Pa are not allowed."
        )
    return statics


def _air_of_muscles(
    plant: StaticPlant, pressure: MuscleValues, air_mass: MuscleValues
) -> tuple[float, ...]:
    """The pressure [Pa] or the air mass [kg] of each muscle, of which one is None."""
    name, stated, unit = (
        ("pressure", pressure, "Pa") if air_mass is None else ("air_mass", air_mass, "kg")
    )
    where = f"find_equilibrium: {name}"
    several: Sequence[Any] = (
        stated if isinstance(stated, tuple | list) else (stated,) * len(plant.muscles)
    )
    ambient = plant.ambient.pressure
    values = [
        quantity(v, unit, ambient=ambient, where=where) if isinstance(v, str) else v
        for v in several
    ]
    if len(values) != len(plant.muscles):
        raise ParameterError(
            f"find_equilibrium: {name} has {len(values)} values; the plant has {len(plant.muscles)}"
            " muscles."
        )
    for value in values:
        if not isinstance(value, float | int | np.floating) or not np.isfinite(value):
            names = ", ".join(prefix.removesuffix(".") for prefix in plant.prefixes)
            raise ParameterError(
                f"find_equilibrium: {name} is {one_line(value)}; it must be a finite number in"
                f" {unit}"
                f"{f', or a tuple with the values of {names}' if len(plant.muscles) > 1 else ''}."
            )
        if air_mass is not None and not value > 0:
            raise ParameterError(
                f"find_equilibrium: air_mass is {value:g} kg; it must be greater than 0."
            )
    return tuple(float(value) for value in values if value is not None)


def _balances(statics: Statics) -> tuple[Rows, Array]:
    """The row of the plant and the coordinates (d,) of every equilibrium."""
    count = len(statics.plants.mechanism.coordinates)
    if count == 1:
        return equilibria_of_one_coordinate(statics)
    if count > 1:
        return equilibria_of_several_coordinates(statics)
    possible = np.isfinite(statics.states(np.empty((len(statics.parameters), 1, 0)))[:, 0]).all(
        axis=1
    )
    rows = np.flatnonzero(possible)
    return rows, np.empty((rows.size, 0))


def _judged(statics: Statics, rows: Rows, x: Array) -> tuple[Array, npt.NDArray[np.bool_]]:
    """States (R, n) of plants at coordinates (R, d), and whether they are stable (R,)."""
    if not rows.size:
        return np.empty((0, len(statics.names))), np.empty(0, dtype=bool)
    there = statics.of(rows)
    states = there.states(x[:, None])[:, 0]
    return states, are_stable(
        there.compiled, there.parameters, states, there.inputs, shut=there.shut
    )


def _nearest(statics: Statics) -> Array:
    """State (N, n) of the stable equilibrium nearest to full length of each plant; NaN if none
    exists.
    """
    table = np.full((len(statics.parameters), len(statics.names)), np.nan)
    rows = np.flatnonzero(statics.allowed())
    if not rows.size:
        return table
    places, x = _balances(statics if rows.size == len(table) else statics.of(rows))
    rows = rows[places]
    if not rows.size:
        return table
    there = statics.of(rows)
    states, stable = _judged(statics, rows, x)
    squares = [eps[:, 0] ** 2 for eps in there.contractions(x[:, None])]
    contracted = sum(squares, np.zeros(rows.size))
    order = np.lexsort((contracted, rows))  # of several with equal contraction, the first
    order = order[stable[order]]
    first = np.diff(rows[order], prepend=-1) > 0
    table[rows[order][first]] = states[order][first]
    return table

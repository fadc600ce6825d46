"""All equilibria that are found of a plant, and of each of many plants the stable one nearest to full length."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from ...compile.program import CompiledSystem, compile_system
from ...core.arrays import Array
from ...core.errors import AirmuscleError, EquilibriumError
from ...plant.plant import Plant
from .explanation import no_equilibrium
from .multi_dof import equilibria_of_several_coordinates
from .request import MuscleValues, air_of_each, complete_inputs
from .single_dof import GRID_POINTS, equilibria_of_one_coordinate, grid
from .stability import are_stable
from .statics import Rows, Statics

TABLE_SIZE = 500_000
"""Numbers in a table of states of plants side by side; more take memory and gain little (measured)."""


@dataclasses.dataclass(frozen=True)
class Equilibrium:
    """One equilibrium: its state, and whether the mechanism returns to it after a small push."""

    state: dict[str, float]
    stable: bool


def find_equilibria(
    plant: Plant,
    *,
    pressure: MuscleValues = None,
    air_mass: MuscleValues = None,
    inputs: Mapping[str, float] | None = None,
) -> tuple[Equilibrium, ...]:
    """Every static equilibrium that is found, by rising coordinates, for what is given of each muscle's air.

    pressure   gauge pressure [Pa] of the muscle, a number for all or a tuple with one for each
    air_mass   instead: mass of the air [kg] behind shut valves; the pressure follows from the gas, and the air has the
               temperature that it has at rest
    inputs     0 unless given, so a latch is open

    Walls, series springs, tubes and tanks are in steady state, friction and creep relaxed. `stable` is judged by the
    eigenvalues of the motion at this constant pressure, or with this air shut in; friction is left out.
    With one coordinate the whole reach of the muscles is searched, and a pair of equilibria that lies closer than 1/100
    of it is found where the force has its extreme between them. With several, Newton's method starts from many places;
    it may miss an equilibrium that none of them leads to. Raises ParameterError for values that are impossible,
    GeometryLimitError where a muscle cannot take a contraction that its mechanism holds it at, EquilibriumError where
    every place is one.
    """
    one = _statics(plant, pressure, air_mass, inputs)
    rows, x = _balances(one)
    if not rows.size and (len(one.coordinates) == 0 or _is_degenerate(one)):
        raise no_equilibrium(one)
    states, stable = _judged(one, rows, x)
    return tuple(
        Equilibrium(dict(zip(one.names, state.tolist(), strict=True)), bool(s))
        for state, s in zip(states, stable, strict=True)
    )


def _is_degenerate(one: Statics) -> bool:
    """Whether a plant with one coordinate is in balance everywhere, or has no place at all."""
    if len(one.coordinates) != 1:
        return False
    x = grid(one)
    return not one.accelerations(x[:, np.isfinite(x[0]), None]).any()


def find_equilibrium(
    plant: Plant,
    *,
    pressure: MuscleValues = None,
    air_mass: MuscleValues = None,
    inputs: Mapping[str, float] | None = None,
) -> dict[str, float]:
    """The stable equilibrium whose muscles are nearest to full length; arguments are those of `find_equilibria`.

    Nearest is the smallest sum of squared contractions. Raises EquilibriumError, which names the muscles and the
    forces, where no stable equilibrium is found.
    """
    one = _statics(plant, pressure, air_mass, inputs)
    state = _nearest(one)[0]
    if not np.isfinite(state).all():
        raise no_equilibrium(one)
    return dict(zip(one.names, state.tolist(), strict=True))


def find_equilibrium_of_each(
    compiled: CompiledSystem, parameters: Array, pressures: tuple[float, ...], inputs: Array
) -> Array:
    """The states (N, n) of `find_equilibrium` for plants of one structure with parameters (N, P); NaN where none is.

    The gauge pressures [Pa] of the muscles and the inputs (m,) are the same for all; `compiled` is any of the plants.
    """
    size = len(compiled.description.state_names)
    table, block = np.full((len(parameters), size), np.nan), block_size(size)
    for begin in range(0, len(parameters), block):
        part = slice(begin, begin + block)
        table[part] = _each_nearest(compiled, parameters[part], pressures, inputs)
    return table


def block_size(states: int) -> int:
    """How many plants with so many states are evaluated together."""
    return max(1, TABLE_SIZE // (GRID_POINTS * states))


def _each_nearest(compiled: CompiledSystem, parameters: Array, pressures: tuple[float, ...], inputs: Array) -> Array:
    try:
        return _nearest(Statics.of_plants(compiled, parameters, pressures, inputs))
    except (TypeError, ValueError, ArithmeticError, AirmuscleError):  # a plant is impossible
        if len(parameters) == 1:
            return np.full((1, len(compiled.description.state_names)), np.nan)
    return np.vstack([_each_nearest(compiled, row[None], pressures, inputs) for row in parameters])


def _statics(
    plant: Plant, pressure: MuscleValues, air_mass: MuscleValues, inputs: Mapping[str, float] | None
) -> Statics:
    """The request, checked, as a table of one plant."""
    air = air_of_each(plant, pressure, air_mass)
    values = np.array(list(complete_inputs(plant, inputs).values()), dtype=float)
    compiled = compile_system(plant)
    one = Statics.of_plants(compiled, compiled.parameters[None], air, values, pressure is None)
    if not one.shut and not one.allowed().all():
        plant.state_at(pressure=air)
        raise EquilibriumError(f"{type(plant.mechanism).__name__} takes no pressures of {air} Pa.")
    return one


def _balances(statics: Statics) -> tuple[Rows, Array]:
    """The row of its plant and the place (d,) of every balance."""
    count = len(statics.coordinates)
    if count == 1:
        return equilibria_of_one_coordinate(statics)
    if count > 1:
        return equilibria_of_several_coordinates(statics)
    possible = np.isfinite(statics.states(np.empty((len(statics.parameters), 1, 0)))[:, 0]).all(axis=1)
    rows = np.flatnonzero(possible)
    return rows, np.empty((rows.size, 0))


def _judged(statics: Statics, rows: Rows, x: Array) -> tuple[Array, npt.NDArray[np.bool_]]:
    """States (R, n) at places (R, d) of plants, and whether they are stable (R,)."""
    if not rows.size:
        return np.empty((0, len(statics.names))), np.empty(0, dtype=bool)
    there = statics.of(rows)
    states = there.states(x[:, None])[:, 0]
    return states, are_stable(there.compiled, there.parameters, states, there.inputs, shut=there.shut)


def _nearest(statics: Statics) -> Array:
    """Of each plant the state (N, n) of the stable equilibrium nearest to full length; NaN where there is none."""
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
    contracted = there.contracted(x[:, None])[:, 0]
    order = np.lexsort((contracted, rows))  # of equilibria as near as each other the first
    order = order[stable[order]]
    first = np.diff(rows[order], prepend=-1) > 0
    table[rows[order][first]] = states[order][first]
    return table

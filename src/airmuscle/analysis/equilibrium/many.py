"""The equilibrium of each of many plants of one structure, where nothing about it is out of the ordinary."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array
from ...core.errors import AirmuscleError
from ...plant.plant import Plant
from .grid import grids
from .roots import balances
from .single_dof import PLACES
from .stability import are_stable
from .vectorised import SideBySide

if TYPE_CHECKING:
    from ...compile.program import CompiledSystem  # CasADi, which describing a plant does not need

AT_ONCE = 500_000
"""Numbers in a table of states of plants side by side; more take memory and gain little (measured)."""


class EquilibriumTable(NamedTuple):
    """What was found of N plants: states (N, n), not a number where there is none, and whether that is certain (N,)."""

    states: Array
    searched: npt.NDArray[np.bool_]


def find_equilibrium_of_each(
    ready: CompiledSystem, parameters: Array, pressures: tuple[float, ...], inputs: Array
) -> EquilibriumTable:
    """The states that `equilibrium` finds for plants of one structure with parameters (N, P), all at once.

    The gauge pressures [Pa] of the muscles and the inputs (m,) are the same for all; `ready` is any of the plants.
    `searched` is false where a plant is to be asked alone: it has several coordinates, is somewhere where it cannot
    be, or has laws that take no arrays. Where it is true and there is no state, there is no stable rest.
    """
    plant, count = ready.system, len(parameters)
    assert isinstance(plant, Plant)
    size = len(plant.states)
    found = EquilibriumTable(np.full((count, size), np.nan), np.zeros(count, dtype=bool))
    if len(plant.mechanism.coordinates) > 1:
        return found
    for begin in range(0, count, block := block_of(size)):
        part = slice(begin, begin + block)
        try:
            with np.errstate(all="ignore"):
                plants = SideBySide.of_plants(ready, parameters[part], pressures, inputs)
                found.states[part], found.searched[part] = _rests(plants)
        except (TypeError, ValueError, ArithmeticError, AirmuscleError):  # alone it is said which, and what is wrong
            continue
    return found


def block_of(states: int) -> int:
    """How many plants with so many states go side by side."""
    return max(1, AT_ONCE // (PLACES * states))


def _rests(plants: SideBySide) -> EquilibriumTable:
    """Of each plant the stable rest nearest to full length."""
    rows, x, searched = _candidates(plants)
    found = EquilibriumTable(np.full((len(plants.parameters), len(plants.names)), np.nan), searched)
    if not rows.size:
        return found
    there = plants.of(rows)
    states = there.states(x[:, None])[:, 0]
    searched[rows[~np.isfinite(states).all(axis=1)]] = False
    stable = are_stable(plants.ready, plants.parameters[rows], states, plants.inputs)
    contracted = sum((eps[:, 0] ** 2 for eps in there.contractions(x[:, None])), np.zeros(rows.size))
    order = np.lexsort((contracted, rows))  # of rests as near as each other the first
    order = order[(stable & searched[rows])[order]]
    first = np.diff(rows[order], prepend=-1) > 0
    found.states[rows[order][first]] = states[order][first]
    return found


def _candidates(plants: SideBySide) -> tuple[npt.NDArray[np.intp], Array, npt.NDArray[np.bool_]]:
    """Rows and coordinates of every place of balance, and which plants have a rate at every place looked at."""
    allowed = plants.allowed()
    if not allowed.any():
        return np.flatnonzero(allowed), np.empty(0), allowed
    if not plants.columns.mechanism.coordinates:
        rows = np.flatnonzero(allowed)
        return rows, np.zeros(rows.size), allowed
    x = grids(plants)
    f = plants.accelerations(x)
    looked = ~np.isnan(x)
    plain = allowed & looked.any(axis=1) & (np.isfinite(f) | ~looked).all(axis=1) & ((f != 0.0) & looked).any(axis=1)
    rows = np.flatnonzero(plain)
    those = plants if plain.all() else plants.of(rows)
    found, place = balances(those, x[rows], f[rows])
    return rows[found], place, plain

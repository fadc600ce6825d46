"""All states at rest that are found, and the stable one nearest to full length."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np

from ...core.errors import EquilibriumError
from ...plant.plant import Plant
from .diagnosis import explanation
from .many import find_equilibrium_of_each
from .multi_dof import places_of_several
from .single_dof import places
from .stability import is_stable
from .statics import Given, StaticProblem


@dataclasses.dataclass(frozen=True)
class Equilibrium:
    """One equilibrium: its state, and whether the mechanism returns to it after a small push."""

    state: dict[str, float]
    stable: bool


def find_equilibria(
    plant: Plant, *, pressure: Given = None, air_mass: Given = None, inputs: Mapping[str, float] | None = None
) -> tuple[Equilibrium, ...]:
    """Every state at rest that is found, by rising coordinates, for what is given of each muscle's air.

    pressure   gauge pressure [Pa] of the muscle, a number for all or a tuple with one for each
    air_mass   instead: mass of the air [kg] that its shut valves hold; the pressure follows from the gas, and the air
               has the temperature that it has at rest
    inputs     under which the mechanism rests; 0 unless given, so a latch is open

    Walls, series springs, tubes and tanks are settled, friction and creep relaxed. `stable` is judged by the
    eigenvalues of the motion at this constant pressure, or with this air shut in; friction is left out.
    With one coordinate the whole reach of the muscles is searched, and a pair of rests that lies closer than 1/100 of
    it is found where the force has its extreme between them. With several, Newton's method starts from many places;
    it may miss a rest that none of them leads to. Raises ParameterError for what cannot be given, OutOfReach where a
    muscle cannot take a contraction that its mechanism holds it at.
    """
    return _equilibria(StaticProblem(plant, pressure, air_mass, inputs))


def _equilibria(static: StaticProblem) -> tuple[Equilibrium, ...]:
    if not static.coordinates:
        found = [static.state({})]
    elif len(static.coordinates) == 1:
        found = [static.state(static.place([x])) for x in places(static)]
    else:
        found = [static.state(static.place(x)) for x in places_of_several(static)]
    return tuple(Equilibrium(state, is_stable(static, state)) for state in found)


def find_equilibrium(
    plant: Plant, *, pressure: Given = None, air_mass: Given = None, inputs: Mapping[str, float] | None = None
) -> dict[str, float]:
    """The stable state at rest whose muscles are nearest to full length, for what `equilibria` takes.

    Nearest is the smallest sum of squared contractions. Raises NoEquilibrium, which names the muscles and the forces,
    where no stable rest is found.
    """
    static = StaticProblem(plant, pressure, air_mass, inputs)
    if not static.shut:
        inputs_here = np.array(list(static.inputs.values()))
        (state,), (searched,) = find_equilibrium_of_each(
            static.ready, static.ready.parameters[None], static.air, inputs_here
        )
        if np.isfinite(state).all():
            return dict(zip(static.names, state.tolist(), strict=True))
        if searched:
            raise EquilibriumError(explanation(static))
    stable = [rest.state for rest in _equilibria(static) if rest.stable]
    if not stable:
        raise EquilibriumError(explanation(static))
    return min(stable, key=static.contracted)

"""The state that a record begins at, from what is known of it, and how it moves with the parameters."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...analysis.equilibrium import find_equilibrium
from ...compile import System
from ...core import autodiff, tree
from ...core.arrays import Array
from ...core.errors import IdentificationError, ParameterError, suggestion
from ...plant.plant import Plant

if TYPE_CHECKING:
    from ...compile.function import Function

PRESSURE_STEP = 100.0
"""A little more gauge pressure [Pa], by which states that settle with it are found."""
_FAILURES = {
    1: "where the search came to, some state changes none of what is asked",
    2: "the search left all bounds",
    3: "the search did not come to an end",
}
_compiled_conditions: dict[Any, Function] = {}


@dataclasses.dataclass(frozen=True, eq=False)
class InitialConditions:
    """Conditions that fix a state: `known` values of states or outputs, states that stand `still`, `equal` outputs.

    Together they must be as many as the states; `guess` is where the search for the state begins. Inputs count as zero.
    """

    known: Mapping[str, float]
    guess: Mapping[str, float]
    stationary: tuple[str, ...] = ()
    equal: tuple[tuple[str, str], ...] = ()

    @classmethod
    def at_rest(cls, plant: Plant, pressure: float) -> InitialConditions:
        """A plant of one muscle in equilibrium at a gauge pressure [Pa], its walls and tubes settled."""
        speeds = [c.speed for c in plant.mechanism.coordinates]
        places = [c.name for c in plant.mechanism.coordinates]
        state = find_equilibrium(plant, pressure=pressure)
        known, still, equal = _steady_conditions(plant, state, pressure, (*speeds, *places))
        known |= dict.fromkeys(speeds, 0.0)
        return cls({"pressure": pressure, **known}, state, (*still, *speeds), equal)

    @classmethod
    def at_coordinates(cls, plant: Plant, pressure: float, **coordinates: float) -> InitialConditions:
        """A plant of one muscle at a gauge pressure [Pa], its coordinates known, at rest unless speeds are given.

        Walls and tubes are settled at this pressure, and go with it where it is an unknown.
        """
        state = plant.state_at(pressure=pressure, **coordinates)
        known, still, equal = _steady_conditions(plant, state, pressure)
        return cls({"pressure": pressure, **known}, state, still, equal)

    def check_plant(self, system: System, values: Mapping[str, Any]) -> None:
        """Raise ParameterError for a name that the system lacks, or too few or many conditions."""
        names = [s.name for s in system.states]
        for name in (*self.known, *self.stationary, *(n for pair in self.equal for n in pair)):
            if name not in (names if name in self.stationary else values):
                raise ParameterError(
                    f"the start names '{name}'; the system has {', '.join(values)}.{suggestion(name, values)}"
                )
        if len(self.known) + len(self.stationary) + len(self.equal) != len(names) or set(self.guess) != set(names):
            raise ParameterError(
                f"the start must give as many conditions as there are states ({', '.join(names)}), and a guess "
                f"of each; known are {', '.join(self.known) or 'none'}, still {', '.join(self.stationary) or 'none'}."
            )


def _steady_conditions(
    plant: Plant, state: Mapping[str, float], pressure: float, left: Sequence[str] = ()
) -> tuple[dict[str, float], tuple[str, ...], tuple[tuple[str, str], ...]]:
    """How the states besides the air mass are fixed: those that a little more pressure leaves alone are known.

    Of the others a tube has the pressure of the muscle, and the rest stands still.
    """
    moving = {c.name: state[c.name] for c in plant.mechanism.coordinates}
    moving |= {c.speed: state[c.speed] for c in plant.mechanism.coordinates}
    other = plant.state_at(pressure=pressure + PRESSURE_STEP, **moving)
    shown = plant.outputs(state, dict.fromkeys(plant.inputs, 0.0))
    known, still, equal = {}, [], []
    for name, value in state.items():
        if name == "air_mass" or name in left:
            continue
        if other[name] == value:
            known[name] = value
        elif (of_tube := f"{name.removesuffix('air_mass')}pressure") in shown:
            equal.append((of_tube, "pressure"))
        else:
            still.append(name)
    return known, tuple(still), tuple(equal)


def compile_conditions(system: System, start: InitialConditions) -> Function:
    """The function (state, leaves) -> (values known and rates to vanish, their slopes by state, by leaf)."""
    import casadi

    from ...compile.function import Function

    key = (tree.structure(system), tuple(start.known), start.stationary, start.equal)
    if key not in _compiled_conditions:
        model, p = autodiff.symbolic(system)
        x = casadi.SX.sym("x", len(system.states))
        state = {s.name: x[i] for i, s in enumerate(system.states)}
        shut = dict.fromkeys(system.inputs, 0.0)
        values = {**model.outputs(state, shut), **state}
        start.check_plant(system, values)
        rates = model.rates(state, shut)
        g = casadi.vertcat(
            *(casadi.SX(values[n]) for n in start.known),
            *(casadi.SX(rates[n]) for n in start.stationary),
            *(casadi.SX(values[a] - values[b]) for a, b in start.equal),
        )
        outputs = {"values": g, "by_state": casadi.jacobian(g, x), "by_leaf": casadi.jacobian(g, p)}
        _compiled_conditions[key] = Function({"x": x, "leaves": p}, outputs)
    return _compiled_conditions[key]


def solve_initial_state(
    function: Function, start: InitialConditions, leaves: Array, known: Array, guess: Array, sizes: Array
) -> tuple[Array, Array, Array]:
    """The state (n,) with these leaves and known values, and its slopes by known value (n, k) and by leaf (n, p).

    `function` is that of `conditions`, made once for a structure.
    Raises IdentificationError where no state meets the conditions.
    """
    from ...compile.cache.announce import announce_compilation
    from ...compile.kernels.newton import root

    announce_compilation(root)
    n, x, target = guess.size, guess.copy(), np.concatenate([known, np.zeros(len(start.stationary) + len(start.equal))])
    values, by_state, by_leaf, work = np.empty(n), np.empty((n, n)), np.empty((n, leaves.size)), np.zeros(n * n + n)
    status = root(function.address, leaves, target, sizes, x, values, by_state, by_leaf, work)
    if status != 0:
        raise IdentificationError(
            f"no state meets the start {dict(zip(start.known, known.tolist(), strict=True))} with "
            f"{', '.join(start.stationary) or 'nothing'} at rest and "
            f"{', '.join(f'{a} = {b}' for a, b in start.equal) or 'nothing'} equal: {_FAILURES[status]}."
        )
    inverse = sizes[:, None] * np.linalg.inv(by_state * sizes)
    return x, inverse[:, : known.size], -inverse @ by_leaf

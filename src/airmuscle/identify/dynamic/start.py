"""The state that a record begins at, from what is known of it, and how it moves with the parameters."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ... import declare, trace
from ...equilibrium import equilibrium
from ...errors import IdentificationError, ParameterError, suggestion
from ...plant import Plant
from ...program import System

if TYPE_CHECKING:
    from ...program.function import Function

Array = npt.NDArray[np.float64]
_WHY = {
    1: "where the search came to, some state changes none of what is asked",
    2: "the search left all bounds",
    3: "the search did not come to an end",
}
_conditions: dict[Any, Function] = {}


@dataclasses.dataclass(frozen=True, eq=False)
class Start:
    """Conditions that fix a state: `known` values of states or outputs, and states that stand `still`.

    Together they must be as many as the states; `guess` is where the search for the state begins. Inputs count as zero.
    """

    known: Mapping[str, float]
    guess: Mapping[str, float]
    still: tuple[str, ...] = ()

    @classmethod
    def at_rest(cls, plant: Plant, pressure: float) -> Start:
        """A plant of one muscle in equilibrium at a gauge pressure [Pa]."""
        speeds = [c.speed for c in plant.mechanism.coordinates]
        known = {"pressure": pressure} | dict.fromkeys(speeds, 0.0)
        return cls(known, equilibrium(plant, pressure=pressure), tuple(speeds))

    @classmethod
    def held(cls, plant: Plant, pressure: float, **coordinates: float) -> Start:
        """A plant of one muscle at a gauge pressure [Pa], its coordinates known, at rest unless speeds are given."""
        state = plant.state_at(pressure=pressure, **coordinates)
        moving = {name: value for name, value in state.items() if name != "air_mass"}
        return cls({"pressure": pressure} | moving, state)

    def refuse_unfit(self, system: System, values: Mapping[str, Any]) -> None:
        """Raise ParameterError for a name that the system lacks, or too few or many conditions."""
        names = [s.name for s in system.states]
        for name in (*self.known, *self.still):
            if name not in (names if name in self.still else values):
                raise ParameterError(
                    f"the start names '{name}'; the system has {', '.join(values)}.{suggestion(name, values)}"
                )
        if len(self.known) + len(self.still) != len(names) or set(self.guess) != set(names):
            raise ParameterError(
                f"the start must give as many conditions as there are states ({', '.join(names)}), and a guess "
                f"of each; known are {', '.join(self.known) or 'none'}, still {', '.join(self.still) or 'none'}."
            )


def conditions(system: System, start: Start) -> Function:
    """The function (state, leaves) -> (values known and rates to vanish, their slopes by state, by leaf)."""
    import casadi

    from ...program.function import Function

    key = (declare.structure(system), tuple(start.known), start.still)
    if key not in _conditions:
        model, p = trace.symbolic(system)
        x = casadi.SX.sym("x", len(system.states))
        state = {s.name: x[i] for i, s in enumerate(system.states)}
        shut = dict.fromkeys(system.inputs, 0.0)
        values = {**model.outputs(state, shut), **state}
        start.refuse_unfit(system, values)
        rates = model.rates(state, shut)
        g = casadi.vertcat(*(casadi.SX(values[n]) for n in start.known), *(casadi.SX(rates[n]) for n in start.still))
        outputs = {"values": g, "by_state": casadi.jacobian(g, x), "by_leaf": casadi.jacobian(g, p)}
        _conditions[key] = Function({"x": x, "leaves": p}, outputs)
    return _conditions[key]


def solved(
    function: Function, start: Start, leaves: Array, known: Array, guess: Array, sizes: Array
) -> tuple[Array, Array, Array]:
    """The state (n,) with these leaves and known values, and its slopes by known value (n, k) and by leaf (n, p).

    `function` is that of `conditions`, made once for a structure.
    Raises IdentificationError where no state meets the conditions.
    """
    from ...engine.once import announce_compilation
    from ...engine.root import root

    announce_compilation(root)
    n, x, target = guess.size, guess.copy(), np.concatenate([known, np.zeros(len(start.still))])
    values, by_state, by_leaf, work = np.empty(n), np.empty((n, n)), np.empty((n, leaves.size)), np.zeros(n * n + n)
    status = root(function.address, leaves, target, sizes, x, values, by_state, by_leaf, work)
    if status != 0:
        raise IdentificationError(
            f"no state meets the start {dict(zip(start.known, known.tolist(), strict=True))} with "
            f"{', '.join(start.still) or 'nothing'} at rest: {_WHY[status]}."
        )
    inverse = sizes[:, None] * np.linalg.inv(by_state * sizes)
    return x, inverse[:, : known.size], -inverse @ by_leaf

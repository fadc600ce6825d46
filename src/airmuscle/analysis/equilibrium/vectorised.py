"""Plants of one structure, each with parameters of its own, at rest side by side: arrays in place of numbers."""

from __future__ import annotations

import dataclasses
import functools
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ...core import tree
from ...core.arrays import Array
from ...core.ops import Value
from ...mechanism import Coordinate
from ...plant.plant import Plant
from ...pneumatics.gas import absolute_pressure
from .statics import reach_of

if TYPE_CHECKING:
    from ...compile.program import CompiledSystem  # CasADi, which describing a plant does not need


@dataclasses.dataclass(frozen=True, eq=False)
class SideBySide:
    """N plants with one coordinate or none, as functions of it; `Static` is one plant, whatever its coordinates.

    ready       any of them, prepared
    parameters  (N, P) all leaves of each
    held        (N, c) what the compiled functions need of them
    pressures   gauge pressure [Pa] of each muscle, the same in all plants
    inputs      (m,) the same for all
    columns     the plant with an array (N, 1) in place of every leaf
    """

    ready: CompiledSystem
    parameters: Array
    held: Array
    pressures: tuple[float, ...]
    inputs: Array
    columns: Plant

    @classmethod
    def of_plants(
        cls, ready: CompiledSystem, parameters: Array, pressures: tuple[float, ...], inputs: Array
    ) -> SideBySide:
        """The plants that have these parameters (N, P)."""
        held = np.array([ready.program.precompute(row) for row in np.ascontiguousarray(parameters)])
        plant = ready.system
        assert isinstance(plant, Plant)
        return cls(ready, parameters, held, pressures, inputs, _columns(plant, parameters))

    def of(self, rows: npt.NDArray[np.intp]) -> SideBySide:
        """Some of them, which may be repeated."""
        parameters = self.parameters[rows]
        columns = self.columns if len(self.parameters) == 1 else _columns(self.columns, parameters)
        return dataclasses.replace(self, parameters=parameters, held=self.held[rows], columns=columns)

    @functools.cached_property
    def names(self) -> list[str]:
        """The states, in their order."""
        return [s.name for s in self.ready.system.states]

    @property
    def coordinate(self) -> Coordinate:
        """The one coordinate."""
        return self.columns.mechanism.coordinates[0]

    @functools.cached_property
    def reach(self) -> list[tuple[Value, Value]]:
        """The contractions [1] within which each muscle is looked at."""
        return [reach_of(muscle) for muscle in self.columns.muscles]

    def allowed(self) -> npt.NDArray[np.bool_]:
        """Which plants (N,) take these inputs and pressures."""
        found = np.array(np.broadcast_to(True, (len(self.parameters), 1)))
        for command, value in zip(self.columns.commands, self.inputs, strict=True):
            found &= (command.minimum <= value) & (value <= command.maximum)
        for p in self.pressures:
            found &= np.asarray(absolute_pressure(p, self.columns.ambient)) > 0.0
        return found[:, 0]

    def contractions(self, x: Array) -> list[Array]:
        """Contraction [1] of every muscle at places (N, K), each (N, K)."""
        q = {c.name: x for c in self.columns.mechanism.coordinates}
        found = self.columns.mechanism.contractions(q, self.columns.resting_lengths)
        return [np.broadcast_to(np.asarray(eps, dtype=float), x.shape) for eps in found]

    def within_reach(self, x: Array) -> npt.NDArray[np.bool_]:
        """Whether every muscle can take its contraction at places (N, K)."""
        inside = np.ones(x.shape, dtype=bool)
        for eps, (low, high) in zip(self.contractions(x), self.reach, strict=True):
            inside &= (eps >= low) & (eps <= high)
        return inside

    def states(self, x: Array) -> Array:
        """The states at rest (N, K, n) at places (N, K); not a number where a plant cannot be there."""
        plant = self.columns
        known: dict[str, Value] = {n: v for c in plant.mechanism.coordinates for n, v in ((c.name, x), (c.speed, 0.0))}
        possible = np.ones(x.shape, dtype=bool)
        for eps, muscle in zip(self.contractions(x), plant.muscles, strict=True):
            low, high = muscle.geometry.contraction_range
            possible &= (eps >= low) & (eps <= high)
        state, volumes = plant.settled_muscles(self.pressures, known)
        for volume in volumes:
            possible &= np.asarray(volume) > 0.0
        state = plant.filled(self.pressures, volumes, state)
        found = np.empty((*x.shape, len(self.names)))
        for i, name in enumerate(self.names):
            found[..., i] = state[name]
        found[~possible] = np.nan
        return found

    def accelerations(self, x: Array) -> Array:
        """Acceleration of the coordinate from rest at places (N,) or (N, K); not a number where a plant cannot be."""
        from ...compile.cache.kernel import rates_of_each

        states = self.states(x.reshape(len(x), -1))
        rates = np.empty_like(states)
        rates_of_each(self.ready.address["rhs"], self.held, self.inputs, states, rates)
        return np.array(rates[..., self.names.index(self.coordinate.speed)]).reshape(x.shape)


def _columns(plant: Plant, parameters: Array) -> Plant:
    """The plant with an array (N, 1) for every leaf, also of one plant: so it rests where it would beside others, to
    the last digit, which a power of numbers would not be.
    """
    return tree.unflatten(plant, [column[:, None].copy() for column in parameters.T])

"""What every way of running a batch needs to know, and where it puts what it finds."""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import numpy as np
import numpy.typing as npt

from ...compile.program import CompiledSystem
from ...control.inputs import PiecewiseLinear
from ...core.arrays import Array
from ...plant.state import state_lower_bounds
from ..integrators import INTERRUPTED, LESS_THAN_NONE, REASONS, Integrator, RawSolution
from .variations import Variations


@dataclasses.dataclass(frozen=True, eq=False)
class BatchJob:
    """N plants to be run: starts (N, n), the segments of each, and the rows and columns that are kept.

    Found are `columns` (N, T) by name, `final` (N, n), `status` (N,), how many rows were `reached` (N,), and in words
    the `reasons` of those that failed.
    """

    ready: CompiledSystem
    variations: Variations
    method: Integrator
    starts: Array
    segments: tuple[PiecewiseLinear, ...]
    begin: float
    duration: float
    times: Array
    columns: dict[str, npt.NDArray[Any]]
    final: Array
    status: npt.NDArray[np.int64]
    reached: npt.NDArray[np.int64]
    reasons: dict[int, str]
    nominal: Array

    @functools.cached_property
    def names(self) -> tuple[str, ...]:
        """Everything that can be kept: states, then outputs, then inputs."""
        system = self.ready.system
        return (*(s.name for s in system.states), *self.ready.output_names, *system.inputs)

    @functools.cached_property
    def chosen(self) -> npt.NDArray[np.int64]:
        """Where the columns to be kept, which must be known by now, stand among `names`."""
        return np.array([self.names.index(name) for name in self.columns], dtype=np.int64)

    @functools.cached_property
    def lower_bounds(self) -> Array:
        """What each state (n,) may be at least."""
        return state_lower_bounds(self.ready.system)

    def run_single(self, index: int) -> None:
        """Run one plant by itself, exactly as `simulate` would, and put its rows and its end in place."""
        one = self.ready.at(self.variations.parameters(index), self.nominal[index])
        course = self.method.run(one, self.segments[index], self.begin, self.starts[index], self.times)
        self._put(index, one, self._stopped_without_air(course))

    def _stopped_without_air(self, course: RawSolution) -> RawSolution:
        """The course up to the first row with less air than none, as `simulate` ends it."""
        rows = np.vstack([course.rows[: course.reached], course.state])
        bad = np.flatnonzero((rows < self.lower_bounds).any(axis=1))
        if not bad.size:
            return course
        row = int(bad[0])
        time = float(self.times[row]) if row < course.reached else course.time
        return course._replace(reached=row, time=time, state=rows[row], status=LESS_THAN_NONE)

    def _put(self, index: int, one: CompiledSystem, course: RawSolution) -> None:
        from ...compile.cache.kernel import evaluate

        reached = course.reached
        states = np.ascontiguousarray(course.rows[:reached])
        inputs = np.ascontiguousarray(self.segments[index].inputs_at(self.times[:reached], self.begin))
        results = np.empty((reached, one.sizes.outputs))
        chosen, size = self.chosen, states.shape[1]
        if ((chosen >= size) & (chosen < size + results.shape[1])).any():
            evaluate(one.address["outputs"], one.precomputed, states, inputs, results)
        table = (states, results, inputs)
        places = [(i, j) for i, part in enumerate(table) for j in range(part.shape[1])]
        for place, column in zip(chosen, self.columns.values(), strict=True):
            part, j = places[place]
            with np.errstate(over="ignore"):  # a column of single precision, which then says so
                column[index, :reached] = table[part][:, j]
            column[index, reached:] = np.nan
        self.final[index], self.status[index], self.reached[index] = course.state, course.status, reached
        if course.status:
            self.reasons[index] = self._in_words(course)

    def _in_words(self, course: RawSolution) -> str:
        states = self.ready.system.states
        at = ", ".join(f"{s.name} {v:.6g} {s.unit}" for s, v in zip(states, course.state, strict=True))
        return (
            f"the run ended at {course.time:.6g} of {self.begin + self.duration:.6g} s because "
            f"{REASONS[course.status]}, after {course.steps} steps, at {at}"
        )

    def mark_not_run(self, index: int, status: int, reason: str | None = None) -> None:
        """Put in place that a plant was not run."""
        self.status[index], self.final[index], self.reached[index] = status, np.nan, 0
        for column in self.columns.values():
            column[index] = np.nan
        if reason is not None:
            self.reasons[index] = reason

    def unfinished(self, indices: npt.NDArray[np.intp]) -> None:
        """Put in place that the user stopped before these were run."""
        for index in indices:
            self.mark_not_run(int(index), INTERRUPTED)

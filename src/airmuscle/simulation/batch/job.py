"""BatchJob: the arguments shared by all execution back ends of a batch, and where results are written."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ...compile.program import CompiledSystem
from ...control.piecewise_linear import PiecewiseLinear
from ...core.arrays import Array
from ...core.status import Status
from ..bound_integrator import RawSolution
from ..integrators import Integrator
from ..rows import RowRecorder
from .loops import LoopBatch
from .variations import Variations

NOT_RUN = -1
"""Status of a plant that has not been run yet."""


@dataclasses.dataclass(frozen=True, eq=False)
class BatchJob:
    """N plants to be simulated: initial states (N, n), segments of the inputs of each, rows and columns to be stored.

    Results are written into `columns` (N, T) by name, `final` (N, n), `status` (N,), the number of rows `reached` (N,),
    and `reasons`, which say why plants failed.
    """

    compiled: CompiledSystem
    variations: Variations
    integrator: Integrator
    initial_states: Array
    segments: tuple[PiecewiseLinear, ...]
    start_time: float
    duration: float
    times: Array
    columns: dict[str, npt.NDArray[Any]]
    final: Array
    status: npt.NDArray[np.int64]
    reached: npt.NDArray[np.int64]
    reasons: dict[int, str]
    nominal: Array
    loops: LoopBatch | None = None
    _recorders: list[RowRecorder] = dataclasses.field(default_factory=list)

    @functools.cached_property
    def names(self) -> tuple[str, ...]:
        """All columns that can be stored: states, then outputs, then inputs."""
        known = self.compiled.description
        of_loop = () if self.loops is None else self.loops.column_names
        return (*known.state_names, *known.output_names, *known.input_names, *of_loop)

    @functools.cached_property
    def kept(self) -> npt.NDArray[np.int64]:
        """Indices of the stored columns among `names`."""
        return np.array([self.names.index(name) for name in self.columns], dtype=np.int64)

    @property
    def lower_bounds(self) -> Array:
        """The smallest possible value of each state (n,)."""
        return self.compiled.description.lower_bounds

    def run_single(self, index: int) -> None:
        """Simulate one plant alone, exactly as `simulate` would, and write its results."""
        one = self.compiled.at(self.variations.parameters(index), self.nominal[index])
        if self.loops is None:
            segments, state = self.segments[index], self.initial_states[index]
            raw = self.integrator.run(one, segments, self.start_time, state, self.times)
            self._write(index, one, self._truncate(raw), segments, {})
        else:
            self._run_loop(index, one, self.loops)

    def _run_loop(self, index: int, one: CompiledSystem, loops: LoopBatch) -> None:
        """Simulate a control loop, whose drivers may add rows to those of the batch, and write its results."""
        run = loops.run(index, self.variations, one, self.initial_states[index])
        times, rows = run.rows
        close = 1e-9 * loops.template.duration
        at = np.searchsorted(times, self.times - close)
        at = at[at < times.size]
        state = run.bound.state.copy() if len(run.measured) else run.state
        raw = RawSolution(rows[at], at.size, run.stopped_at, state, run.status, *run.bound.step_counts)
        signal = run.signal
        if not signal.ends.size:
            inputs = np.zeros((1, self.compiled.sizes.inputs))
            signal = PiecewiseLinear(self.times[-1:], inputs, inputs)
        more = loops.columns(index, self.columns, run, at.size) if len(run.measured) else {}
        self._write(index, one, self._truncate(raw), signal, more)
        loops.release(run)

    def _truncate(self, raw: RawSolution) -> RawSolution:
        """The solution up to the first row with a negative air mass, as `simulate` ends it."""
        rows = np.vstack([raw.rows[: raw.reached], raw.state])
        invalid = np.flatnonzero((rows < self.lower_bounds).any(axis=1))
        if not invalid.size:
            return raw
        row = int(invalid[0])
        time = float(self.times[row]) if row < raw.reached else raw.time
        return raw._replace(reached=row, time=time, state=rows[row], status=Status.NEGATIVE_AIR_MASS)

    def _write(
        self, index: int, one: CompiledSystem, raw: RawSolution, segments: PiecewiseLinear, more: Mapping[str, Array]
    ) -> None:
        reached = raw.reached
        states = np.ascontiguousarray(raw.rows[:reached])
        recorder = self._recorder(one)
        table = recorder.evaluate(states, self.times[:reached], segments, self.start_time)
        self._recorders.append(recorder)
        parts = (states, table.outputs, table.inputs)
        places = [(i, j) for i, part in enumerate(parts) for j in range(part.shape[1])]
        for place, (name, column) in zip(self.kept, self.columns.items(), strict=True):
            if place < len(places):
                part, j = places[place]
                values = parts[part][:, j]
            else:
                values = more[name][:reached] if more else np.full(reached, np.nan)
            with np.errstate(over="ignore"):  # a column in single precision
                column[index, :reached] = values
            column[index, reached:] = np.nan
        self.final[index], self.status[index], self.reached[index] = raw.state, raw.status, reached
        if raw.status:
            self.reasons[index] = self._reason(raw)

    def _recorder(self, one: CompiledSystem) -> RowRecorder:
        """A recorder that no thread uses at present, for this plant."""
        try:
            recorder = self._recorders.pop()
        except IndexError:
            return RowRecorder(one)
        recorder.adopt(one)
        return recorder

    def _reason(self, raw: RawSolution) -> str:
        states = self.compiled.system.states
        at = ", ".join(f"{s.name} {v:.4g} {s.unit}" for s, v in zip(states, raw.state, strict=True))
        return (
            f"the run ended at {raw.time:.6g} of {self.start_time + self.duration:.6g} s because "
            f"{raw.status.message}, after {raw.steps} steps, at {at}"
        )

    def mark_not_run(self, index: int, status: Status, reason: str | None = None) -> None:
        """Write that a plant was not simulated."""
        self.status[index], self.final[index], self.reached[index] = status, np.nan, 0
        for column in self.columns.values():
            column[index] = np.nan
        if reason is not None:
            self.reasons[index] = reason

    def mark_interrupted(self) -> None:
        """Write that the plants that have not been run were left out because the user stopped."""
        for index in np.flatnonzero(self.status == NOT_RUN):
            self.mark_not_run(int(index), Status.INTERRUPTED)

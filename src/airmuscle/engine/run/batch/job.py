"""BatchJob: the arguments that all ways of running a batch share, places of results, and the threads of its queue."""

import concurrent.futures
import contextlib
import contextvars
import dataclasses
import functools
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ....core import Array, Status
from ...compile.program import CompiledSystem, Pool
from ...loop.inputs import PiecewiseLinear
from ..integrators import Integrator, RawSolution
from ..solution import RowRecorder, early_end
from .loops import LoopBatch
from .variations import Variations

NOT_RUN = -1
"""Status of a plant that has not been run yet."""


@dataclasses.dataclass(eq=False)
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
    reasons: dict[int, str]
    loops: LoopBatch | None = None
    columns: dict[str, npt.NDArray[Any]] = dataclasses.field(default_factory=dict)
    _recorders: Pool = dataclasses.field(default_factory=Pool)

    def __post_init__(self) -> None:
        count = len(self.initial_states)
        self.final, self.status = np.full(self.initial_states.shape, np.nan), np.full(count, NOT_RUN)
        self.reached, sizes = np.zeros(count, dtype=np.int64), self.compiled.sizes
        self.lower_bounds = self.compiled.description.lower_bounds
        """The smallest possible value of each state (n,)."""
        self.own = sizes.states + sizes.outputs + sizes.inputs
        """The number of columns of the plant: states, outputs and inputs."""

    @functools.cached_property
    def nominal(self) -> Array:
        """Nominal size (N, n) of each state of each plant."""
        return self.variations.nominal()

    @functools.cached_property
    def names(self) -> tuple[str, ...]:
        """All columns that can be stored: states, then outputs, then inputs."""
        known = self.compiled.description
        of_loop = () if self.loops is None else self.loops.loops[0].column_names
        return (*known.state_names, *known.output_names, *known.input_names, *of_loop)

    @functools.cached_property
    def kept(self) -> npt.NDArray[np.int64]:
        """Indices of the stored columns among `names`."""
        return np.array([self.names.index(name) for name in self.columns], dtype=np.int64)

    def run_single(self, index: int) -> None:
        """Simulate one plant alone, exactly as `simulate` would, and write its results."""
        one = self.compiled.at(self.variations.parameters(index), self.nominal[index])
        state, loops = self.initial_states[index], self.loops
        if loops is None:
            segments = self.segments[index]
            raw = self.integrator.run(one, segments, self.start_time, state, self.times)
            self._write(index, one, self._truncate(raw), segments, {})
            return
        run = loops.run(index, one, state)
        times, rows = run.rows
        if run.prepared.loop.drivers:  # there may be further rows
            at = np.searchsorted(times, self.times - 1e-9 * loops.template.duration)
            rows = rows[at[at < times.size]]
        at, setpoints = run.prepared.at_times
        more = run.columns(at[: len(rows)], setpoints[: len(rows)]) if len(run.measured) else {}
        self._write(index, one, self._truncate(run.raw(rows)), run.signal, more)
        loops.release(run)

    def _truncate(self, raw: RawSolution) -> RawSolution:
        """The solution up to the first row with a negative air mass, as `simulate` ends it."""
        rows, bounds = raw.rows[: raw.reached], self.lower_bounds
        if not (rows < bounds).any() and not (raw.state < bounds).any():
            return raw
        rows = np.vstack([rows, raw.state])
        row = int(np.flatnonzero((rows < bounds).any(axis=1))[0])
        time = float(self.times[row]) if row < raw.reached else raw.time
        return raw._replace(reached=row, time=time, state=rows[row], status=Status.NEGATIVE_AIR_MASS)

    def _write(
        self, index: int, one: CompiledSystem, raw: RawSolution, segments: PiecewiseLinear, more: Mapping[str, Array]
    ) -> None:
        reached = raw.reached
        states = np.ascontiguousarray(raw.rows[:reached])
        values = [*states.T]
        if ((self.kept >= states.shape[1]) & (self.kept < self.own)).any():  # outputs or inputs are stored
            recorder: RowRecorder = self._recorders.borrow(None) or RowRecorder(one)
            recorder.adopt(one)
            table = recorder.evaluate(states, self.times[:reached], segments, self.start_time)
            self._recorders.give_back(None, recorder)
            values += [*table.outputs.T, *table.inputs.T]
        with np.errstate(over="ignore"):  # a column in single precision
            for place, (name, column) in zip(self.kept.tolist(), self.columns.items(), strict=True):
                if place < self.own:
                    column[index, :reached] = values[place]
                else:
                    column[index, :reached] = more[name][:reached] if more else np.nan
                column[index, reached:] = np.nan
        self.final[index], self.status[index], self.reached[index] = raw.state, raw.status, reached
        if raw.status:
            self.reasons[index] = early_end(self.compiled, raw, self.start_time + self.duration).text

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


BAR_DELAY = 2.0
"""Seconds after which a progress bar is drawn, on a terminal."""
_hidden = contextvars.ContextVar("hidden", default=False)


class Queue:
    """Items of work that threads take one after the other; `stop` is a flag that kernels check."""

    def __init__(self, items: int) -> None:
        self.stop: npt.NDArray[np.int64] = np.zeros(1, dtype=np.int64)
        self.done = 0
        self._items = iter(range(items))
        self._lock = threading.Lock()

    def _take(self) -> int | None:
        with self._lock:
            return None if self.stop[0] else next(self._items, None)

    def work(self, worker: Callable[[int], Any]) -> None:
        """Take items until there are none, or until a worker failed or the queue was stopped."""
        try:
            while (item := self._take()) is not None:
                worker(item)
                with self._lock:
                    self.done += 1
        except BaseException:
            self.stop[0] = 1
            raise


def run_workers(queue: Queue, workers: list[Callable[[int], Any]], advanced: Callable[[int], None]) -> bool:
    """Run each worker on its own thread until the queue is empty; False where the user interrupted it."""
    complete = True
    with concurrent.futures.ThreadPoolExecutor(max(len(workers), 1)) as threads:
        working = [threads.submit(queue.work, worker) for worker in workers]
        try:
            while concurrent.futures.wait(working, 0.05).not_done:
                advanced(queue.done)
        except KeyboardInterrupt:
            complete, queue.stop[0] = False, 1
    for each in working:
        each.result()
    return complete


@contextlib.contextmanager
def hidden_progress() -> Iterator[None]:
    """A block without progress bars, for a caller that draws its own."""
    token = _hidden.set(True)
    try:
        yield
    finally:
        _hidden.reset(token)


@contextlib.contextmanager
def progress(what: str, total: int) -> Iterator[Callable[[int], None]]:
    """A function that takes the number of items done and draws a bar on a terminal once that takes long."""
    started, bar = time.monotonic(), None

    def advanced(done: int) -> None:
        nonlocal bar
        if time.monotonic() - started > BAR_DELAY and sys.stderr.isatty() and not _hidden.get():
            from rich.console import Console
            from rich.progress import Progress

            if bar is None:
                bar = Progress(console=Console(stderr=True), transient=True)
                bar.add_task(what, total=total)
                bar.start()
            bar.update(bar.task_ids[0], completed=done)

    try:
        yield advanced
    finally:
        if bar is not None:
            bar.stop()

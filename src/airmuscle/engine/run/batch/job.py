"""BatchJob: plants and loops of a batch, places of their results, and the threads of its queue."""

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
from ...loop import ControlLoop, PiecewiseLinear
from ..compiled_loop import CompiledLoop, CompiledRun
from ..integrators import Integrator, RawSolution
from ..problem import Problem
from ..sampled_loop import first_rows_of, prepare_loop
from ..solution import RowRecorder, reason_of_end
from .variations import Variations

NOT_RUN = -1
"""Status of a plant that has not been run yet."""
BAR_DELAY = 2.0
"""Seconds after which a progress bar is drawn, on a terminal."""
_hidden = contextvars.ContextVar("hidden", default=False)


@dataclasses.dataclass(eq=False)
class BatchJob:
    """N plants to be simulated: initial states (N, n), segments of the inputs of each, rows and
    columns to be stored.

    template  a problem with the plant, for which loops are prepared; None without loops
    loops     one for all plants, or one for each; their controllers `laws`, where their parameters
              differ

    Results are written into `columns` (N, T) by name, `final` (N, n), `status` (N,), the number of
    rows `reached` (N,), and `reasons`, which say why plants failed.
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
    template: Problem | None = None
    loops: tuple[ControlLoop, ...] = ()
    laws: Variations | None = None
    columns: dict[str, npt.NDArray[Any]] = dataclasses.field(default_factory=dict)
    _recorders: Pool = dataclasses.field(default_factory=Pool)
    _runs: Pool = dataclasses.field(default_factory=Pool)
    _prepared: dict[int, CompiledLoop] = dataclasses.field(default_factory=dict)
    _preparing: Any = dataclasses.field(default_factory=threading.Lock)

    def __post_init__(self) -> None:
        count = len(self.initial_states)
        self.final, self.status = (
            np.full(self.initial_states.shape, np.nan),
            np.full(count, NOT_RUN),
        )
        self.reached = np.zeros(count, dtype=np.int64)
        sizes = self.compiled.sizes
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
        of_loop = self.loops[0].column_names if self.loops else ()
        return (*known.state_names, *known.output_names, *known.input_names, *of_loop)

    @functools.cached_property
    def kept(self) -> npt.NDArray[np.int64]:
        """Indices of the stored columns among `names`."""
        return np.array([self.names.index(name) for name in self.columns], dtype=np.int64)

    def run_single(self, index: int) -> None:
        """Simulate one plant alone, exactly as `simulate` would, and write its results."""
        plant = self.compiled.at(self.variations.parameters(index), self.nominal[index])
        state = self.initial_states[index]
        if not self.loops:
            segments = self.segments[index]
            raw = self.integrator.run(plant, segments, self.start_time, state, self.times)
            self._write(index, plant, self._truncate(raw), segments, {})
            return
        loop = self.loop_of(index)
        run = self._integrated(index, plant, loop)
        times, rows = run.rows
        if loop.prepared.loop.drivers:  # there may be further rows
            places = np.searchsorted(times, self.times - 1e-9 * self.duration)
            places = places[places < times.size]
            rows = rows[places]
        of_loop: Mapping[str, Array] = {}
        if len(run.measured):
            count = len(rows)
            samples, setpoints = loop.prepared.at_times
            of_loop = run.columns(samples[:count], setpoints[:count])
        raw = self._truncate(run.raw(rows))
        self._write(index, plant, raw, run.signal, of_loop)
        self._runs.give_back(id(loop), run)

    def loop_of(self, index: int) -> CompiledLoop:
        """The loop of one plant, prepared for runs with rows at the times of the batch."""
        return self.prepared(self.loops[index if len(self.loops) > 1 else 0])

    def prepared(self, loop: ControlLoop) -> CompiledLoop:
        """A loop prepared for its runs, once for all plants that share it."""
        with self._preparing:
            if id(loop) not in self._prepared:
                assert self.template is not None
                problem = dataclasses.replace(self.template, input=loop)
                prepared = prepare_loop(problem, loop.init(self.start_time))
                rows = first_rows_of(self.times, prepared.instants)
                prepared = dataclasses.replace(prepared, times=self.times, first_rows=rows)
                self._prepared[id(loop)] = CompiledLoop(problem.compiled, prepared)
        return self._prepared[id(loop)]

    def _integrated(self, index: int, plant: CompiledSystem, loop: CompiledLoop) -> CompiledRun:
        """The loop of one plant, integrated from its initial state; it serves another one when it
        is given back.
        """
        parameters = loop.parameters.copy() if self.laws is None else self.laws.parameters(index)
        state = self.initial_states[index]
        begin = loop.prepared.loop.init
        run: CompiledRun | None = self._runs.borrow(id(loop))
        if run is None:
            run = CompiledRun(
                loop, plant, self.integrator, state, begin(self.start_time), parameters
            )
        # a controller of the user may have changed its first memory, although a memory is a value
        else:
            run.restart(
                plant, state, parameters, begin(self.start_time) if loop.law is None else None
            )
        run.integrate()
        return run

    def _truncate(self, raw: RawSolution) -> RawSolution:
        """The solution up to the first row with a negative air mass, as `simulate` ends it."""
        rows = raw.rows[: raw.reached]
        bounds = self.lower_bounds
        if not (rows < bounds).any() and not (raw.state < bounds).any():
            return raw
        rows = np.vstack([rows, raw.state])
        row = int(np.flatnonzero((rows < bounds).any(axis=1))[0])
        time = float(self.times[row]) if row < raw.reached else raw.time
        return raw._replace(
            reached=row, time=time, state=rows[row], status=Status.NEGATIVE_AIR_MASS
        )

    def _write(
        self,
        index: int,
        plant: CompiledSystem,
        raw: RawSolution,
        segments: PiecewiseLinear,
        more: Mapping[str, Array],
    ) -> None:
        reached = raw.reached
        states = np.ascontiguousarray(raw.rows[:reached])
        values = [*states.T]
        places = self.kept.tolist()
        if any(len(values) <= place < self.own for place in places):  # outputs or inputs are stored
            recorder: RowRecorder = self._recorders.borrow(None) or RowRecorder(plant)
            recorder.adopt(plant)
            table = recorder.evaluate(states, self.times[:reached], segments, self.start_time)
            self._recorders.give_back(None, recorder)
            values += [*table.outputs.T, *table.inputs.T]
        with np.errstate(over="ignore"):  # a column in single precision
            for place, (name, column) in zip(places, self.columns.items(), strict=True):
                if place < self.own:
                    column[index, :reached] = values[place]
                else:
                    column[index, :reached] = more[name][:reached] if more else np.nan
                column[index, reached:] = np.nan
        self.final[index] = raw.state
        self.status[index] = raw.status
        self.reached[index] = reached
        if raw.status:
            self.reasons[index] = reason_of_end(self.compiled, raw, self.start_time + self.duration)

    def mark_not_run(self, index: int, status: Status, reason: str | None = None) -> None:
        """Write that a plant was not simulated."""
        self.status[index] = status
        self.final[index] = np.nan
        self.reached[index] = 0
        for column in self.columns.values():
            column[index] = np.nan
        if reason is not None:
            self.reasons[index] = reason


class Queue:
    """Items of work that threads take one after the other; `stop` is a flag that kernels check."""

    def __init__(self, items: int) -> None:
        self.stop: npt.NDArray[np.int64] = np.zeros(1, dtype=np.int64)
        self.done = self._taken = 0
        self._items = items
        self._lock = threading.Lock()

    def _take(self) -> int | None:
        with self._lock:
            if self.stop[0] or self._taken == self._items:
                return None
            self._taken += 1
            return self._taken - 1

    def work(self, worker: Callable[[int], Any]) -> None:
        """Take items until there are none, or until a worker failed or the queue was stopped."""
        try:
            while (item := self._take()) is not None:
                try:
                    worker(item)
                finally:
                    with self._lock:
                        self.done += 1
        except BaseException:
            self.stop[0] = 1
            raise

    def halt(self) -> None:
        """Let nobody take a further item, and wait for those that have been taken."""
        with self._lock:
            self.stop[0] = 1
        while self.done < self._taken:
            time.sleep(0.01)


def run_workers(
    queue: Queue, workers: list[Callable[[int], Any]], advanced: Callable[[int], None]
) -> bool:
    """Run each worker on its own thread until the queue is empty; False where the user interrupted
    it.
    """
    complete = True
    working = list[concurrent.futures.Future[None]]()
    with concurrent.futures.ThreadPoolExecutor(max(len(workers), 1)) as threads:
        try:
            for worker in workers:
                working.append(threads.submit(queue.work, worker))
            while concurrent.futures.wait(working, 0.05).not_done:
                advanced(queue.done)
        except KeyboardInterrupt:
            complete = False
            queue.halt()  # the pool does not know a thread whose start was interrupted
    for future in working:
        future.result()
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
    """A function that takes the number of items done and draws a bar on a terminal once that takes
    long.
    """
    started = time.monotonic()
    bar = None

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

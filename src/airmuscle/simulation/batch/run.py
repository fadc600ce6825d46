"""Many plants through time at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ...compile import System
from ...control.control_loop import ControlLoop
from ...control.inputs import InputSignal, PiecewiseLinear
from ...core.arrays import Array
from ...core.declaration import as_float
from ...core.errors import AirmuscleError, ParameterError, suggestion
from ...plant.plant import Plant
from ...plant.state import check_state, check_system
from ..arguments import check_input_range, default_integrator, output_times
from ..integrators import INTERRUPTED, MAX_STEPS, ExplicitRungeKutta, Integrator
from .initial_states import count_of_starts, given_starts, resting_starts
from .job import BatchJob
from .lanes import blocks, check_precision
from .precision import Double, Precision
from .result import NOT_STARTED, BatchSolution
from .storage import InMemory, OnDisk
from .thread_pool import Queue, cores_here, progress, shared_out
from .variations import Column, Variations, variations_of

NOT_RUN = -1


def simulate_batch(
    plant: System,
    variations: Mapping[str, npt.ArrayLike],
    command: InputSignal | Sequence[InputSignal],
    *,
    duration: float,
    start: Mapping[str, npt.ArrayLike] | None = None,
    start_time: float = 0.0,
    method: Integrator | None = None,
    output: float | npt.ArrayLike | None = None,
    keep: Sequence[str] | None = None,
    into: str | Path | None = None,
    precision: Precision = Double(),
    cores: int | None = None,
) -> BatchSolution:
    """Run N plants of one structure for `duration` [s], on all cores; a plant that fails does not stop the others.

    plant       any System: a Plant, one's own, or WithSensitivities(...), whose derivatives are then found in the same pass
    variations  values (N,) by the path of a parameter, as `airmuscle.core.leaves` names it (`mechanism.mass`)
    command     one for all, or one for each
    start       by state a number for all or a column (N,); by default each Plant's own equilibrium at ambient pressure
    method      Rodas4(rtol=1e-6) unless given: each plant chooses its own steps, exactly as in `simulate`. With a
                method of fixed step, RungeKutta4(1e-3), sixteen plants are computed side by side, much faster
    output      as in `simulate`; with one command for all its instants are among the rows
    keep        columns to be kept (N, T): states, outputs, inputs; all unless given, () for final states alone
    into        folder for the columns, one .npy file each; without it they are held in memory
    precision   Double() or Single()
    cores       threads; all cores of this process unless given. The result does not depend on it

    Raises ParameterError where a path, value, start, command or column cannot be; the row is named. An interrupted
    batch (Ctrl-C) is returned with what was done, the rest having the status of a run that was interrupted.
    """
    _check_open_loop(command)
    duration = as_float("simulate_batch: duration", duration)
    start_time = as_float("simulate_batch: start_time", start_time)
    check_system("simulate_batch", plant)
    method = default_integrator(method)
    _check_arguments(duration, start_time, method, cores)
    _check_types(start, keep, into, precision)
    check_precision(precision, method)
    different = variations_of(plant, variations, _count(start, command))
    count = len(different.values)
    segments = _segments(plant, command, count, start_time, duration)
    end = np.array([start_time + duration])
    times = output_times(output, start_time, duration, segments[0].ends if isinstance(command, InputSignal) else end)
    if keep is not None and len(keep) == 0:
        times = end
    starts, reasons = _starts(different, start, count)
    task, store = _task(
        different, method, starts, segments, start_time, duration, times, reasons, keep, into, precision
    )
    try:
        _run(task, precision, cores or cores_here())
        return _found(task, store, precision)
    except BaseException:
        store.abandoned()
        raise


def _check_open_loop(command: object) -> None:
    if any(isinstance(one, ControlLoop) for one in (command if isinstance(command, Sequence) else [command])):
        raise ParameterError(
            "simulate_batch: a Loop is no command known beforehand: its controller looks at each plant as it goes. Use "
            "simulate_closed_loop for each plant, or a study, `airmuscle sweep`, of a scenario with a controller."
        )


def _check_arguments(duration: float, start_time: float, method: Integrator, cores: int | None) -> None:
    if not (np.isfinite(duration) and duration > 0 and start_time + duration > start_time):
        raise ParameterError(
            f"simulate_batch: duration is {duration:g} s from {start_time:g} s on; it must be positive and finite."
        )
    if isinstance(method, ExplicitRungeKutta) and duration / method.step > MAX_STEPS:
        raise ParameterError(
            f"simulate_batch: {duration:g} s in steps of {method.step:g} s are {duration / method.step:.3g} steps for "
            f"each plant; that is more steps than allowed, {MAX_STEPS:g}. Lengthen the step, or shorten the run."
        )
    if cores is not None and (not isinstance(cores, int) or cores < 1):
        raise ParameterError(f"simulate_batch: cores is {cores!r}; it must be a whole number from 1 on.")


def _check_types(start: object, keep: object, into: object, precision: object) -> None:
    if start is not None and not isinstance(start, Mapping):
        raise ParameterError(f"start: it is {start!r}; give for each state a number for all, or a column (N,).")
    if keep is not None and not isinstance(keep, Sequence):
        raise ParameterError(f"keep: it is {keep!r}; name columns, ('pressure', 'position').")
    if into is not None and not isinstance(into, str | Path):
        raise ParameterError(f"into: it is {into!r}; name a folder.")
    if not isinstance(precision, Precision):
        raise ParameterError(f"precision: it is {precision!r}; give Double() or Single().")


def _count(start: Mapping[str, npt.ArrayLike] | None, command: InputSignal | Sequence[InputSignal]) -> int | None:
    """How many plants starts and commands speak of."""
    of_starts = count_of_starts(start)
    if isinstance(command, InputSignal):
        return of_starts
    if not isinstance(command, Sequence):
        raise ParameterError(f"simulate_batch: the command is {command!r}; give one Command, or a list of them.")
    if of_starts is not None and of_starts != len(command):
        raise ParameterError(f"simulate_batch: there are {len(command)} commands and starts for {of_starts} plants.")
    return len(command)


def _segments(
    plant: System, command: InputSignal | Sequence[InputSignal], count: int, begin: float, duration: float
) -> tuple[PiecewiseLinear, ...]:
    """The segments of every plant's command; the same object where it is the same command."""
    known: dict[int, PiecewiseLinear] = {}
    commands = [command] if isinstance(command, InputSignal) else list(command)
    for row, one in enumerate(commands):
        if id(one) in known:
            continue
        if not isinstance(one, InputSignal):
            raise ParameterError(f"commands, row {row}: {one!r} is no Command; give a Schedule or a Signal.")
        try:
            known[id(one)] = one.segments(plant.inputs, begin, duration)
            known[id(one)].check_shape(len(plant.inputs), begin)
            check_input_range(plant, known[id(one)], begin)
        except ParameterError as error:
            where = "" if isinstance(command, InputSignal) else f"commands, row {row}: "
            raise ParameterError(f"{where}{error}") from None
    found = tuple(known[id(one)] for one in commands)
    return found * count if isinstance(command, InputSignal) else found


def _starts(
    different: Variations, start: Mapping[str, npt.ArrayLike] | None, count: int
) -> tuple[Array, dict[int, str]]:
    if start is not None:
        states = given_starts(different.system, start, count)
        _check_initial_states(different, states)
        return states, {}
    with progress("finding where each plant rests", count) as advanced:
        return resting_starts(different, advanced)


def _check_initial_states(different: Variations, states: Array) -> None:
    """Refuse states (N, n) that a muscle cannot take, as `simulate` does, with the row."""
    if not isinstance(different.system, Plant):
        return
    names = [s.name for s in different.system.states]
    try:
        columns = {name: column.view(Column) for name, column in zip(names, states.T, strict=True)}
        check_state(different.as_columns(), columns)
    except (TypeError, ValueError, AirmuscleError):  # rows differ, or one of them is refused: row by row
        for row, state in enumerate(states.tolist()):
            try:
                check_state(different.one(row), dict(zip(names, state, strict=True)))  # type: ignore[arg-type]
            except AirmuscleError as error:
                raise type(error)(f"start, row {row}: {str(error).removeprefix('the start: ')}") from None


def _task(
    different: Variations, method: Integrator, starts: Array, segments: tuple[PiecewiseLinear, ...], begin: float,
    duration: float, times: Array, reasons: dict[int, str], keep: Sequence[str] | None, into: str | Path | None,
    precision: Precision,
) -> tuple[BatchJob, InMemory]:  # fmt: skip
    from ...compile.program import compile_system  # CasADi, which describing a plant does not need

    count, n = starts.shape
    ready = compile_system(different.system)
    nominal = np.empty((count, n)) if isinstance(method, ExplicitRungeKutta) else different.nominal()
    final, status, reached = np.full((count, n), np.nan), np.full(count, NOT_RUN), np.zeros(count, dtype=np.int64)
    given = (ready, different, method, starts, segments, begin, duration, times)
    task = BatchJob(*given, {}, final, status, reached, reasons, nominal)
    names = task.names if keep is None else _kept(keep, task.names)
    kind = np.float64 if precision.number.bits == 64 else np.float32
    store = InMemory(names, count, times.size, kind) if into is None else OnDisk(into, names, count, times.size, kind)
    task.columns.update(store.columns)
    return task, store


def _kept(keep: Sequence[str], names: Sequence[str]) -> tuple[str, ...]:
    for name in [keep] if isinstance(keep, str) else keep:
        if name not in names:
            raise ParameterError(f"keep: no column '{name}'; there are {', '.join(names)}.{suggestion(name, names)}")
    return (keep,) if isinstance(keep, str) else tuple(dict.fromkeys(keep))


def _run(task: BatchJob, precision: Precision, cores: int) -> None:
    """Run all plants that have a start; those that an interruption leaves out say so."""
    for index, reason in task.reasons.copy().items():
        task.mark_not_run(index, NOT_STARTED, reason)
    active = np.flatnonzero(np.isfinite(task.starts).all(axis=1))
    if not active.size:
        return
    if isinstance(task.method, ExplicitRungeKutta):
        queue, workers, each = blocks(task, precision, active, cores)
    else:
        task.run_single(int(active[0]))  # what compiles, compiles here, before threads ask for it at once
        queue, each = Queue(active.size - 1), 1
        queue.stop[0] = task.status[active[0]] == INTERRUPTED
        active = active[1:]
        workers = [lambda piece: task.run_single(int(active[piece]))] * min(cores, active.size)
    with progress(f"simulating {active.size} plants", active.size) as advanced:
        whole = shared_out(queue, workers, lambda done: advanced(min(done * each, active.size)))
    if not whole or queue.stop[0]:
        task.unfinished(np.flatnonzero(task.status == NOT_RUN))


def _found(task: BatchJob, store: InMemory, precision: Precision) -> BatchSolution:
    system = task.ready.system
    final = {s.name: task.final[:, i].copy() for i, s in enumerate(system.states)}
    notes = tuple(note for note in (f"simulated by {task.method}, in a batch", precision.note) if note)
    small = {
        "time": task.times,
        "status": task.status,
        "reached": task.reached,
        **{f"final {name}": v for name, v in final.items()},
    }
    told = {"notes": notes, "reasons": task.reasons, "varied": list(task.variations.paths)}
    columns = store.finished(small, told)
    task.columns.clear()
    return BatchSolution(task.variations, task.times, columns, final, task.status, task.reached, task.reasons, notes)

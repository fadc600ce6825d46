"""Simulation of many plants of one structure at once."""

import contextlib
import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ....core import Array, ParameterError, Status, System, as_float, check_known, one_line
from ....core.folder_locks import raise_file_errors
from ....core.system import check_system
from ...compile.program import CompiledSystem, compile_system
from ...loop import ControlLaw, ControlLoop, InputSignal, PiecewiseLinear, designed_loop
from ...processes import available_cores
from ..integrators import MAX_STEPS, ExplicitRungeKutta, Integrator, default_integrator
from ..loop_sensitivities import CONTROLLER
from ..problem import Problem, check_input_range
from ..problem import output_times as times_of
from .job import NOT_RUN, BatchJob, Queue, progress, run_workers
from .lanes import Double, Precision, lane_workers
from .solution import BatchSolution, file_of, new_columns, new_folder, write_rest
from .variations import Variations, default_states, given_states, variations_of


def simulate_batch(
    plant: System,
    variations: Mapping[str, npt.ArrayLike],
    input: InputSignal | ControlLoop | Sequence[InputSignal] | Sequence[ControlLoop],
    *,
    duration: float,
    initial_states: Mapping[str, npt.ArrayLike] | None = None,
    start_time: float = 0.0,
    output_times: float | npt.ArrayLike | None = None,
    integrator: Integrator | None = None,
    keep: Sequence[str] | None = None,
    into: str | Path | None = None,
    precision: Precision = Double(),
    cores: int | None = None,
) -> BatchSolution:
    """Simulate N plants of one structure for `duration` [s] on all cores; a plant that fails does
    not stop the others.

    plant           any System: a Plant, a user-defined one, or WithSensitivities(...), whose
                    derivatives are then computed in the same pass
    variations      values (N,) by the path of a parameter, as `airmuscle.core.tree.leaves` names it
                    (`mechanism.mass`)
    input           an InputSignal or a ControlLoop for all, or one for each. With one ControlLoop
                    for all `variations` may name parameters of its controller, if it is a
                    ControlLaw: `controller.gain`
    initial_states  by state a number for all or a column (N,); by default each Plant's equilibrium
                    at ambient pressure
    output_times    as in `simulate`; with one input for all its instants are among the rows
    integrator      Rodas4(rtol=1e-6) by default: each plant chooses its own steps, exactly as in
                    `simulate`. With an integrator of fixed step, RungeKutta4(1e-3), sixteen plants
                    are computed together, much faster; so are loops of control laws without drivers
                    whose sampling instants are the same
    keep            columns to be kept (N, T): states, outputs, inputs, those of a loop such as
                    `command.fill`; all unless given, () for final states alone
    into            folder for the columns, one .npy file each; without it they are held in memory
    precision       Double() or Single()
    cores           threads; all cores of this process unless given. The result does not depend on
                    it

    Raises ParameterError for an impossible path, value, initial state, input or column; the row is
    named. An interrupted batch (Ctrl-C) is returned as far as it was computed; the other plants
    have Status.INTERRUPTED.
    """
    check_system("simulate_batch", plant)
    loops = _loops_of(input, plant)
    duration = as_float("simulate_batch: duration", duration)
    start_time = as_float("simulate_batch: start_time", start_time)
    integrator = default_integrator(integrator)
    _check_time(duration, start_time, integrator)
    _check_options(initial_states, keep, into, precision, cores, integrator, loops=bool(loops))
    varied, laws = _vary(plant, variations, loops, _count(initial_states, input))
    count = len(varied.values)
    compiled = compile_system(plant)
    segments = () if loops else _segments(compiled, input, count, start_time, duration)  # type: ignore[arg-type]
    times = _times(output_times, start_time, duration, input, segments, keep)
    if initial_states is not None:
        states = given_states(varied, initial_states, count)
        reasons = dict[int, str]()
    else:
        with progress("computing the equilibrium of each plant", count) as advanced:
            states, reasons = default_states(varied, advanced)
    template = (
        Problem(plant, loops[0], duration, start_time=start_time, integrator=integrator)
        if loops
        else None
    )
    job = BatchJob(
        compiled,
        varied,
        integrator,
        states,
        segments,
        start_time,
        duration,
        times,
        reasons,
        template,
        loops,
        laws,
    )
    return _solved(job, _kept(job, keep), into, precision, cores or available_cores())


def _times(
    requested: float | npt.ArrayLike | None,
    start: float,
    duration: float,
    input: object,
    segments: tuple[PiecewiseLinear, ...],
    keep: Sequence[str] | None,
) -> Array:
    """The times of the rows, with the instants of the input that all plants share; the end if no
    column is stored.
    """
    end = np.array([start + duration])
    if keep is not None and len(keep) == 0:
        return end
    return times_of(
        requested, start, duration, segments[0].ends if isinstance(input, InputSignal) else end
    )


def _check_time(duration: float, start_time: float, integrator: Integrator) -> None:
    if not (np.isfinite(duration) and duration > 0 and start_time + duration > start_time):
        raise ParameterError(
            f"simulate_batch: duration is {duration:g} s from {start_time:g} s on; it must be"
            " positive and finite."
        )
    if isinstance(integrator, ExplicitRungeKutta) and duration / integrator.step > MAX_STEPS:
        raise ParameterError(
            f"simulate_batch: {duration:g} s in steps of {integrator.step:g} s are"
            f" {duration / integrator.step:.3g} steps for each plant; the limit is {MAX_STEPS:g}."
            " Increase the step, or shorten the run."
        )


def _check_options(
    initial_states: object,
    keep: object,
    into: object,
    precision: object,
    cores: object,
    integrator: Integrator,
    *,
    loops: bool,
) -> None:
    if initial_states is not None and not isinstance(initial_states, Mapping):
        raise ParameterError(
            f"initial_states is {one_line(initial_states)}; give for each state a number for all,"
            " or a column (N,)."
        )
    if keep is not None and not isinstance(keep, Sequence):
        raise ParameterError(f"keep is {keep!r}; give names of columns, ('pressure', 'position').")
    if into is not None and not isinstance(into, str | Path):
        raise ParameterError(f"into is {into!r}; give the path of a folder.")
    if not isinstance(precision, Precision):
        raise ParameterError(f"precision is {precision!r}; give Double() or Single().")
    if precision.bits != 64 and loops:
        raise ParameterError(
            "simulate_batch: control loops are computed in double precision; omit the precision."
        )
    if precision.bits != 64 and not isinstance(integrator, ExplicitRungeKutta):
        raise ParameterError(
            f"simulate_batch: {type(integrator).__name__} chooses its steps in double precision;"
            f" {precision} requires an integrator of fixed step, such as RungeKutta4(1e-3)."
        )
    if cores is not None and (not isinstance(cores, int) or cores < 1):
        raise ParameterError(
            f"simulate_batch: cores is {cores!r}; it must be a whole number from 1 on."
        )


def _count(initial_states: Mapping[str, npt.ArrayLike] | None, input: object) -> int | None:
    """The number of plants that initial states and inputs are given for; None where they are the
    same for all.
    """
    sizes = {
        name: np.size(value) for name, value in (initial_states or {}).items() if np.ndim(value) > 0
    }
    if len(set(sizes.values())) > 1:
        raise ParameterError(
            f"initial_states: every column needs one value per plant; there are {sizes}."
        )
    of_states = next(iter(sizes.values()), None)
    if isinstance(input, InputSignal | ControlLoop):
        return of_states
    if not isinstance(input, Sequence):
        order = (
            " The order of the arguments is: plant, variations, input."
            if isinstance(input, Mapping)
            else ""
        )
        raise ParameterError(
            f"simulate_batch: the input is {one_line(input)}; give an InputSignal, a ControlLoop,"
            f" or a list.{order}"
        )
    if of_states is not None and of_states != len(input):
        raise ParameterError(
            f"simulate_batch: there are {len(input)} inputs and initial states for {of_states}"
            " plants."
        )
    return len(input)


def _segments(
    compiled: CompiledSystem,
    input: InputSignal | Sequence[InputSignal],
    count: int,
    start: float,
    duration: float,
) -> tuple[PiecewiseLinear, ...]:
    """The segments of the input of each plant; the same object where it is the same signal."""
    known: dict[int, PiecewiseLinear] = {}
    signals = [input] if isinstance(input, InputSignal) else list(input)
    for row, signal in enumerate(signals):
        if id(signal) in known:
            continue
        if not isinstance(signal, InputSignal):
            raise ParameterError(
                f"inputs, row {row} is {one_line(signal)}; give a Schedule or a SampledSignal."
            )
        try:
            segments = signal.checked_segments(compiled.description.input_names, start, duration)
            check_input_range(compiled, segments, start)
        except ParameterError as error:
            raise (
                error if isinstance(input, InputSignal) else error.located(f"inputs, row {row}")
            ) from None
        known[id(signal)] = segments
    segments_of_signals = tuple(known[id(signal)] for signal in signals)
    return segments_of_signals * count if isinstance(input, InputSignal) else segments_of_signals


def _kept(job: BatchJob, keep: Sequence[str] | None) -> tuple[str, ...]:
    """The names of the columns to be stored."""
    if keep is None:
        return job.names
    check_known("keep: no column", keep, job.names)
    return (keep,) if isinstance(keep, str) else tuple(dict.fromkeys(keep))


def _loops_of(inputs_of_plants: Any, system: System) -> tuple[ControlLoop, ...]:
    """The control loops among the inputs of a batch; none where its inputs are signals.

    Raises ParameterError where signals and loops are mixed, or loops of different controllers.
    """
    inputs = (
        tuple(inputs_of_plants) if isinstance(inputs_of_plants, Sequence) else (inputs_of_plants,)
    )
    loops = tuple(signal for signal in inputs if isinstance(signal, ControlLoop))
    if not loops:
        return ()
    if len(loops) < len(inputs):
        raise ParameterError(
            "simulate_batch: the inputs are control loops and signals; give one kind for all"
            " plants."
        )
    distinct = {id(loop): designed_loop(loop, system) for loop in loops}
    loops = tuple(distinct[id(loop)] for loop in loops)
    for row, loop in enumerate(loops):
        if loop.signals != loops[0].signals:
            raise ParameterError(
                f"inputs, row {row}: {type(loop.controller).__name__} measures or commands other"
                " columns than that of row 0; all loops of a batch need the same measured columns,"
                " set points and commanded inputs."
            )
    return loops


def _vary(
    plant: System,
    varied_columns: Mapping[str, npt.ArrayLike],
    loops: tuple[ControlLoop, ...],
    count: int | None,
) -> tuple[Variations, Variations | None]:
    """The variations of the plants, and those of the controllers, whose paths begin with
    "controller.".
    """
    if not loops or not isinstance(varied_columns, Mapping):
        return variations_of(plant, varied_columns, count), None
    plants = {
        path: values
        for path, values in varied_columns.items()
        if not str(path).startswith(CONTROLLER)
    }
    laws = {
        path[len(CONTROLLER) :]: varied_columns[path]
        for path in varied_columns
        if path not in plants
    }
    if not laws:
        return variations_of(plant, plants, count), None
    controller = loops[0].controller
    if len(loops) > 1 or not isinstance(controller, ControlLaw):
        reason = (
            "there is one loop for each plant"
            if len(loops) > 1
            else "its controller is no ControlLaw"
        )
        raise ParameterError(
            f"variations: '{CONTROLLER}{next(iter(laws))}' varies a parameter of the controller,"
            f" but {reason}. Give a list of loops with the controllers instead."
        )
    varied = variations_of(controller, laws, count)
    return variations_of(plant, plants, len(varied.values)), varied


def _run(job: BatchJob, precision: Precision, cores: int) -> None:
    """Simulate all plants that have an initial state; those that an interruption leaves out are
    marked.
    """
    for index, reason in job.reasons.copy().items():
        job.mark_not_run(index, Status.NOT_STARTED, reason)
    active = np.flatnonzero(np.isfinite(job.initial_states).all(axis=1))
    if not active.size:
        return
    if in_lanes := lane_workers(job, active, precision, cores):
        queue, workers, plants_at_once = in_lanes
    else:
        job.run_single(
            int(active[0])
        )  # what compiles, compiles here, before threads need it at once
        queue = Queue(active.size - 1)
        plants_at_once = 1
        queue.stop[0] = job.status[active[0]] == Status.INTERRUPTED
        active = active[1:]
        workers = [lambda item: job.run_single(int(active[item]))] * min(cores, active.size)
    with progress(f"simulating {active.size} plants", active.size) as advanced:
        complete = run_workers(
            queue, workers, lambda done: advanced(min(done * plants_at_once, active.size))
        )
    if not complete or queue.stop[0]:
        for left in np.flatnonzero(job.status == NOT_RUN):
            job.mark_not_run(int(left), Status.INTERRUPTED)


def _solved(
    job: BatchJob, names: tuple[str, ...], into: str | Path | None, precision: Precision, cores: int
) -> BatchSolution:
    """The solution with the columns of these names, in memory or on disk."""
    shape = (len(job.initial_states), job.times.size)
    path = Path(into or "")
    with contextlib.nullcontext() if into is None else new_folder(path) as folder:
        with raise_file_errors(path):
            job.columns.update(new_columns(names, shape, precision.dtype, folder))
        _run(job, precision, cores)
        final = {
            name: job.final[:, i].copy()
            for i, name in enumerate(job.compiled.description.state_names)
        }
        notes = tuple(
            note for note in (f"simulated by {job.integrator}, in a batch", precision.note) if note
        )
        solution = BatchSolution(
            job.variations,
            job.integrator,
            job.times,
            dict(job.columns),
            final,
            job.status,
            job.reached,
            job.reasons,
            notes,
        )
        if folder is not None:
            with raise_file_errors(path):
                write_rest(solution, folder)
    if into is None:
        return solution
    columns = {name: np.load(path / file_of(name), mmap_mode="r") for name in names}
    return dataclasses.replace(solution, columns=columns)

"""Execution of a study in chunks: groups of runs, their simulation on any executor, and the store
of their results.

The key of a chunk is the fingerprint of everything that its content depends on. A stored chunk
therefore need not be computed again, even if the study was interrupted; if an input has changed, no
key matches, and the chunk is computed.
"""

import dataclasses
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import (
    AirmuscleError,
    Array,
    FileError,
    SimulationError,
    check_writable,
    program_fingerprint,
)
from ...core.system import with_prefix
from ...core.tree import fingerprint
from ...engine.distribution import DistributedCalls
from ...engine.processes import check_running
from ...engine.result_store import STORE_FOLDER, result_store
from ...engine.run import solve
from ...engine.run.problem import output_times
from ...files.scenario.scenario import Scenario
from ...recording import Recording
from . import Study, StudyResult, load_study

RUN_ERRORS = (AirmuscleError, ArithmeticError, ValueError)
"""Exceptions that fail a single run, without ending the study."""


def simulate_all(scenarios: Sequence[Scenario], times: Array) -> Iterator[Recording | str]:
    """Simulate scenarios in order, with additional rows at `times` [s]; yield the reason (text) of
    a failed run.

    Raises KeyboardInterrupt if the user interrupts a run.
    """
    for scenario in scenarios:
        try:
            problem = scenario.problem
            instants = np.append(
                times[(times >= problem.start_time) & (times < problem.end_time)], problem.end_time
            )
            rows = output_times(
                problem.output_times, problem.start_time, problem.duration, instants
            )
            yield (
                solve(dataclasses.replace(problem, output_times=rows))
                .raise_if_incomplete()
                .recording
            )
        except RUN_ERRORS as error:
            if isinstance(error, SimulationError) and error.interrupted:
                raise KeyboardInterrupt from None
            yield failure_reason(error)


def failure_reason(error: Exception) -> str:
    """The reason of a failed run, on one line."""
    kind = "" if isinstance(error, AirmuscleError) else f"{type(error).__name__}: "
    return f"{kind}{' '.join(str(error).split())}"


_loaded: dict[tuple[str, str], Study] = {}


Chunk = Mapping[str, npt.NDArray[Any]]
"""Results of n runs, by the name of the array.

scalars          scalar metrics (n, k); NaN if a run failed or does not have the metric
failure_reasons  reason of each failed run (n,); empty for other runs
series:NAME      each time series (n, T)
"""
SERIES = "series:"


def study_fingerprint(study: Study) -> str:
    """The fingerprint of a study and of the program version that runs it."""
    return fingerprint(program_fingerprint(), study.fingerprint(), study.values)


def chunk_keys(study: Study) -> list[str]:
    """The keys of all chunks in a store: they do not depend on the runs of the other chunks."""
    common = program_fingerprint(), study.fingerprint()
    return [fingerprint(*common, study.values[runs.start : runs.stop]) for runs in study.chunks]


def run_chunk(study_file: tuple[str, str], index: int) -> Chunk:
    """Run one chunk of the study in a file, its path and fingerprint, in any process; the plants
    are built there.

    Raises FileError if the study in the file does not have the fingerprint.
    """
    path, identity = study_file
    if (path, identity) not in _loaded:
        study = load_study(path)
        if study_fingerprint(study) != identity:
            raise FileError(
                f"{path}: a worker process has read a different study. Either the file was edited"
                " after the start, or the worker uses other versions of airmuscle, of its"
                " dependencies, or of the files named in the study."
            )
        _loaded[path, identity] = study
    return compute_chunk(_loaded[path, identity], index)


def compute_chunk(study: Study, index: int) -> Chunk:
    """The results of one chunk; a failed run is recorded as NaN with its reason."""
    runs = study.chunks[index]
    scalars = np.full((len(runs), len(study.scalars)), np.nan)
    reasons = [""] * len(runs)
    series = {
        name: np.full((len(runs), metric.times.size), np.nan)
        for name, metric in study.time_series.items()
    }
    states = study.template.initial_states(*study.varying(runs))
    scenarios: dict[int, Scenario] = {}
    for row, (run, initial_state) in enumerate(zip(runs, states, strict=True)):
        check_running()
        try:
            scenarios[row] = study.scenario(run, initial_state)
        except RUN_ERRORS as error:
            reasons[row] = failure_reason(error)
    outcomes = simulate_all(list(scenarios.values()), study.metric_times)
    for row, outcome in zip(scenarios, outcomes, strict=True):
        check_running()
        if isinstance(outcome, str):
            reasons[row] = outcome
        else:
            scalars[row] = list(study.scalar_values(outcome).values())
            for name, metric in study.time_series.items():
                series[name][row] = metric.sample(outcome["time"], outcome[metric.column])
    return {"scalars": scalars, "failure_reasons": np.array(reasons), **with_prefix(SERIES, series)}


Progress = Callable[[int, int], None]


def run_study(
    study: Study,
    folder: Path | str | None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> StudyResult:
    """Compute the runs that are not yet stored in `folder`/tasks, and return the result of all
    runs.

    folder    None: nothing is stored
    executor  any executor of concurrent.futures; by default this process itself
    progress  called with the number of completed runs and the total number of runs

    The result does not depend on the executor. Completed chunks are stored, even if the study is
    interrupted or killed: the next call resumes it. A failed run is recorded with its reason.
    Raises FileError if the folder cannot be written to, SimulationError if a worker process dies.
    """
    if folder is None:
        return _computed(study, executor, progress)
    check_writable(folder)
    with result_store(Path(folder) / STORE_FOLDER):
        return _computed(study, executor, progress)


def _computed(study: Study, executor: Executor | None, progress: Progress | None) -> StudyResult:
    """The result of all runs, of which those in the store of the present block are not computed."""
    # before the workers start, so that kernels are compiled only once
    (nominal,) = simulate_all([study.template.scenario], study.metric_times)
    report = progress or (lambda done, total: None)
    study_file = str(study.path.resolve()), study_fingerprint(study)
    _loaded[study_file] = study  # this process need not read its file
    chunks: dict[int, Chunk] = {}
    done = 0
    report(done, len(study))
    calls = DistributedCalls(executor, run_chunk, study_file)
    for index, chunk in calls.completed(range(len(study.chunks)), chunk_keys(study)):
        chunks[index] = chunk
        done += len(study.chunks[index])
        report(done, len(study))
    joined = {
        name: np.concatenate([chunks[i][name] for i in range(len(chunks))]) for name in chunks[0]
    }
    return StudyResult(
        study,
        joined["scalars"],
        {name: joined[f"{SERIES}{name}"] for name in study.time_series},
        tuple(map(str, joined["failure_reasons"])),
        (
            dict.fromkeys(study.scalars, np.nan)
            if isinstance(nominal, str)
            else study.scalar_values(nominal)
        ),
    )

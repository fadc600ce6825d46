"""Running a study: every chunk that is not kept yet, on any executor, and then what all of them say together."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, as_completed
from pathlib import Path

import numpy as np

from ..core.errors import FileError, SimulationError
from ..report.output_folder import check_writable
from .chunk import Chunk, chunk_file_name, metric_times, read_chunk, register_study, run_chunk, write_chunk
from .result import StudyResult
from .scenario_runs import simulate_all
from .study import Study

CHUNK_FOLDER = "chunks"
"""The folder of what is kept, beside the results."""
Progress = Callable[[int, int], None]


def run_study(
    study: Study, folder: Path | str, executor: Executor | None = None, progress: Progress | None = None
) -> StudyResult:
    """Run what is not yet kept in `folder`/chunks, and return the whole; the result does not depend on the executor.

    executor  any of concurrent.futures; this very process where there is none
    progress  is told how many runs are done, of how many

    However it ends, by Ctrl-C, an error or a kill, the chunks that were done are kept, and the next call goes on from
    there. A run that fails leaves its reason. Raises FileError where the folder cannot be written to, SimulationError
    where a worker dies.
    """
    kept = Path(folder) / CHUNK_FOLDER
    check_writable(folder)
    try:
        kept.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"{kept}: cannot be made: {error.strerror or error}.") from None
    nominal = _nominal_values(
        study
    )  # before any worker starts, so that kernels are compiled once and not by each of them
    files = [kept / chunk_file_name(study, index) for index in study.chunks]
    missing = [index for index in study.chunks if read_chunk(files[index]) is None]
    done = len(study) - sum(len(study.chunk_runs(index)) for index in missing)
    tell = progress or (lambda done, total: None)
    tell(done, len(study))
    for index, chunk in _compute_missing(study, missing, executor):
        write_chunk(chunk, files[index])
        done += len(study.chunk_runs(index))
        tell(done, len(study))
    for leftover in kept.glob(".unfinished-*"):  # of runs that were killed
        leftover.unlink(missing_ok=True)
    return _combine(study, [_read_finished(file) for file in files], nominal)


def count_finished_runs(study: Study, folder: Path | str) -> int:
    """How many runs of a study `folder` keeps, by what lies there."""
    kept = Path(folder) / CHUNK_FOLDER
    return sum(
        len(study.chunk_runs(index))
        for index in study.chunks
        if read_chunk(kept / chunk_file_name(study, index)) is not None
    )


def _compute_missing(study: Study, missing: Sequence[int], executor: Executor | None) -> Iterator[tuple[int, Chunk]]:
    """The missing chunks, in the order in which they come."""
    path, mark = str(study.path.resolve()), register_study(study)
    if executor is None:
        yield from ((index, run_chunk(path, mark, index)) for index in missing)
        return
    tasks: dict[Future[Chunk], int] = {}
    try:
        for index in missing:
            tasks[executor.submit(run_chunk, path, mark, index)] = index
        for task in as_completed(tasks):
            yield tasks.pop(task), task.result()  # forgotten at once: a long study would hold all it has computed
    except BrokenExecutor:
        raise SimulationError(
            "a worker died; perhaps the memory was used up. What was done is kept: run the study again, with fewer "
            "workers, to go on."
        ) from None
    finally:
        for task in tasks:
            task.cancel()


def _read_finished(file: Path) -> Chunk:
    found = read_chunk(file)
    if found is None:
        raise FileError(f"{file}: went away, or cannot be read any more. Run the study again; it computes what lacks.")
    return found


def _nominal_values(study: Study) -> dict[str, float]:
    """The outcomes of the scenario as it stands; NaN where it does not run."""
    (found,) = simulate_all([study.template.scenario], metric_times(study))
    if isinstance(found, str):
        return dict.fromkeys(study.scalars, np.nan)
    return {name: o.value(found["time"], found[o.column]) for name, o in study.scalars.items()}


def _combine(study: Study, chunks: Sequence[Chunk], nominal: dict[str, float]) -> StudyResult:
    return StudyResult(
        study,
        np.concatenate([chunk.scalars for chunk in chunks]),
        {name: np.concatenate([chunk.time_series[name] for chunk in chunks]) for name in study.time_series},
        tuple(str(reason) for chunk in chunks for reason in chunk.failure_reasons),
        nominal,
    )

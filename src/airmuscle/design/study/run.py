"""Execution of a study: missing chunks are computed on any executor, and all chunks are combined into the result."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from pathlib import Path

import numpy as np

from ...core.atomic_output import check_writable
from ...core.errors import FileError
from ...engine.distribution import DistributedCalls
from .chunk import (
    Chunk,
    chunk_file_name,
    metric_times,
    read_chunk,
    register_study,
    run_chunk,
    simulate_all,
    write_chunk,
)
from .result import StudyResult
from .study import Study

CHUNK_FOLDER = "chunks"
"""Folder of the chunk files, next to the results."""
Progress = Callable[[int, int], None]


def run_study(
    study: Study, folder: Path | str, executor: Executor | None = None, progress: Progress | None = None
) -> StudyResult:
    """Compute the runs that are not yet saved in `folder`/chunks, and return the result of all runs.

    executor  any executor of concurrent.futures; by default this process itself
    progress  called with the number of completed runs and the total number of runs

    The result does not depend on the executor. Completed chunks are saved, even if the study is interrupted or killed:
    the next call resumes it. A failed run is recorded with its reason. Raises FileError if the folder cannot be written
    to, SimulationError if a worker process dies.
    """
    chunk_folder = Path(folder) / CHUNK_FOLDER
    check_writable(folder)
    try:
        chunk_folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(
            f"{chunk_folder}: cannot be created ({error.strerror or error}). Choose a folder with write permission."
        ) from None
    nominal = _nominal_values(study)  # before the workers start, so that kernels are compiled only once
    files = [chunk_folder / chunk_file_name(study, index) for index in study.chunks]
    missing = [index for index in study.chunks if read_chunk(files[index]) is None]
    done = len(study) - sum(len(study.chunk_runs(index)) for index in missing)
    report = progress or (lambda done, total: None)
    report(done, len(study))
    for index, chunk in _compute_missing(study, missing, executor):
        write_chunk(chunk, files[index])
        done += len(study.chunk_runs(index))
        report(done, len(study))
    for leftover in chunk_folder.glob(".*.part"):  # of studies that were killed
        leftover.unlink(missing_ok=True)
    return _combine(study, [_read_finished(file) for file in files], nominal)


def count_finished_runs(study: Study, folder: Path | str) -> int:
    """The number of runs of a study that are saved in `folder`/chunks."""
    chunk_folder = Path(folder) / CHUNK_FOLDER
    files = {index: chunk_folder / chunk_file_name(study, index) for index in study.chunks}
    return sum(len(study.chunk_runs(index)) for index, file in files.items() if read_chunk(file) is not None)


def _compute_missing(study: Study, missing: Sequence[int], executor: Executor | None) -> Iterator[tuple[int, Chunk]]:
    """The missing chunks with their indices, in the order of completion."""
    study_file = str(study.path.resolve()), register_study(study)
    for place, chunk in DistributedCalls(executor, run_chunk, study_file).completed(missing):
        yield missing[place], chunk


def _read_finished(file: Path) -> Chunk:
    chunk = read_chunk(file)
    if chunk is None:
        raise FileError(
            f"{file}: was deleted or damaged while the study was running. Run the same command again to compute the "
            "missing runs."
        )
    return chunk


def _nominal_values(study: Study) -> dict[str, float]:
    """The scalar metrics of the nominal scenario; NaN if its run fails."""
    (recording,) = simulate_all([study.template.scenario], metric_times(study))
    if isinstance(recording, str):
        return dict.fromkeys(study.scalars, np.nan)
    return {name: metric.value(recording["time"], recording[metric.column]) for name, metric in study.scalars.items()}


def _combine(study: Study, chunks: Sequence[Chunk], nominal: dict[str, float]) -> StudyResult:
    return StudyResult(
        study,
        np.concatenate([chunk.scalars for chunk in chunks]),
        {name: np.concatenate([chunk.time_series[name] for chunk in chunks]) for name in study.time_series},
        tuple(str(reason) for chunk in chunks for reason in chunk.failure_reasons),
        nominal,
    )

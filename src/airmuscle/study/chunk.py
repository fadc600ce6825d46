"""A chunk: some runs of a study, what came of them, and the file that keeps it.

The name of the file is the fingerprint of all that its contents depend on. So a chunk that is there need not be
computed again, whatever became of the study in between; one whose inputs changed is not found, and computed anew.
"""

from __future__ import annotations

import dataclasses
import os
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ..core.arrays import Array
from ..core.errors import FileError
from ..recording import Recording
from ..scenario.scenario import Scenario
from .executors import check_running
from .fingerprint import fingerprint, program_fingerprint
from .scenario_runs import RUN_ERRORS, failure_reason, simulate_all
from .study import Study, load_study

_loaded: dict[tuple[str, str], Study] = {}


@dataclasses.dataclass(frozen=True, eq=False)
class Chunk:
    """Outcomes of n runs: `numbers` (n, k), `courses` by name (n, T), and why a run failed (n,), empty if not."""

    scalars: Array
    time_series: Mapping[str, Array]
    failure_reasons: npt.NDArray[np.str_]


def study_fingerprint(study: Study) -> str:
    """The fingerprint of a study together with the program that runs it."""
    return fingerprint(program_fingerprint(), study.fingerprint(), study.values)


def chunk_file_name(study: Study, index: int) -> str:
    """The name of the file that keeps a chunk."""
    rows = study.chunk_runs(index)
    return f"{fingerprint(program_fingerprint(), study.fingerprint(), study.values[rows.start : rows.stop])}.npz"


def register_study(study: Study) -> str:
    """Let this process take the study as it is when it runs chunks of it; its identity."""
    mark = study_fingerprint(study)
    _loaded[str(study.path.resolve()), mark] = study
    return mark


def run_chunk(path: str, mark: str, index: int) -> Chunk:
    """Run one chunk of the study in a file, on whatever machine; the plants are built there.

    Raises FileError where the file describes another study here than `mark` names.
    """
    if (path, mark) not in _loaded:
        study = load_study(path)
        if study_fingerprint(study) != mark:
            raise FileError(
                f"{path}: a worker reads another study than the one that was started. Either it was edited meanwhile, "
                "or the worker has another version of airmuscle, of what it needs, or of the files that it names."
            )
        _loaded[path, mark] = study
    return compute_chunk(_loaded[path, mark], index)


def compute_chunk(study: Study, index: int) -> Chunk:
    """The outcomes of one chunk; a run that fails leaves NaN and its reason."""
    rows = study.chunk_runs(index)
    found = Chunk(
        np.full((len(rows), len(study.scalars)), np.nan),
        {name: np.full((len(rows), course.times.size), np.nan) for name, course in study.time_series.items()},
        np.array([""] * len(rows), dtype=object),
    )
    scenarios: dict[int, Scenario] = {}
    for place, (run, rest) in enumerate(zip(rows, study.initial_states(rows), strict=True)):
        check_running()
        try:
            scenarios[place] = study.scenario(run, rest)
        except RUN_ERRORS as error:
            found.failure_reasons[place] = failure_reason(error)
    for place, run_or_reason in zip(
        scenarios, simulate_all(list(scenarios.values()), metric_times(study)), strict=True
    ):
        check_running()
        if isinstance(run_or_reason, str):
            found.failure_reasons[place] = run_or_reason
        else:
            _store(study, run_or_reason, found, place)
    return dataclasses.replace(found, failure_reasons=found.failure_reasons.astype(str))


def metric_times(study: Study) -> Array:
    """All instants [s] that the outcomes of a study look at."""
    return np.unique(np.concatenate([outcome.times for outcome in study.metrics.values()]))


def _store(study: Study, recording: Recording, found: Chunk, place: int) -> None:
    time = recording["time"]
    found.scalars[place] = [o.value(time, recording[o.column]) for o in study.scalars.values()]
    for name, course in study.time_series.items():
        found.time_series[name][place] = course.sample(time, recording[course.column])


def write_chunk(chunk: Chunk, path: Path) -> None:
    """Write a chunk to its file, which appears whole or not at all."""
    handle, unfinished = tempfile.mkstemp(dir=path.parent, prefix=".unfinished-")
    try:
        with os.fdopen(handle, "wb") as file:
            courses = {f"course:{name}": rows for name, rows in chunk.time_series.items()}
            np.savez(file, numbers=chunk.scalars, reasons=chunk.failure_reasons, **courses)  # type: ignore[arg-type]
        os.replace(unfinished, path)
    except BaseException:
        Path(unfinished).unlink(missing_ok=True)
        raise


def read_chunk(path: Path) -> Chunk | None:
    """The chunk that a file keeps; None where there is none, or the file is damaged."""
    try:
        with np.load(path, allow_pickle=False) as file:
            courses = {n.removeprefix("course:"): file[n] for n in file.files if n.startswith("course:")}
            return Chunk(file["numbers"], courses, file["reasons"])
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None

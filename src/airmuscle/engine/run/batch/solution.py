"""BatchSolution: final states, columns in memory or on disk, and status of every plant."""

import contextlib
import dataclasses
import json
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import numpy.typing as npt

from ....core import Array, Columns, Reference, Status, System, cite
from ....core.errors import ColumnError, FileError, ParameterError, alternatives
from ....core.folder_locks import raise_file_errors
from ....recording import Recording
from ..integrators import Integrator
from .variations import Variations

MAX_MEMORY = 4e9
"""Bytes that the columns in memory may take (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False)
class BatchSolution:
    """The solution of N plants that were simulated together.

    time     (T,) times [s] of the columns, the same for all
    columns  by name (N, T), those that were kept; NaN beyond the row that a plant reached
    final    by state (N,), at the end of the run, or where a plant failed
    status   (N,) values of Status, DONE where a plant reached the end; `reason(i)` says why not
    reached  (N,) number of rows of each plant
    notes    remarks that hold for all: integrator, precision
    """

    variations: Variations
    integrator: Integrator
    time: Array
    columns: Mapping[str, npt.NDArray[Any]]
    final: Mapping[str, Array]
    status: npt.NDArray[np.int64]
    reached: npt.NDArray[np.int64]
    reasons: Mapping[int, str]
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return self.status.size

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        """A stored column (N, T) by its name, or the times (T,) [s] of all, `batch["time"]`."""
        if name == "time" and name not in self.columns:
            return self.time
        if name not in self.columns:
            advice = "" if self.columns else " Name the columns in keep."
            raise ColumnError(
                f"batch: no column '{name}'{alternatives(name, self.columns, 'kept are')}{advice}"
            )
        return self.columns[name]

    @property
    def failed(self) -> npt.NDArray[np.intp]:
        """The plants that did not reach the end."""
        return np.flatnonzero(self.status)

    @property
    def interrupted(self) -> bool:
        """Whether the user ended the batch before all plants were simulated."""
        return bool((self.status == Status.INTERRUPTED).any())

    @property
    def references(self) -> list[Reference]:
        """Sources of the models and of the integrator."""
        return cite((self.variations.system, self.integrator))

    def reason(self, index: int) -> str:
        """How the run of a plant ended."""
        index = self._row(index)
        return self.reasons.get(index, Status(int(self.status[index])).message)

    def plant(self, index: int) -> System:
        """One of the plants."""
        return self.variations.one(self._row(index))

    def _row(self, index: int) -> int:
        """The row of a plant, counted from the end where the index is negative."""
        if not isinstance(index, int | np.integer) or not -len(self) <= index < len(self):
            raise ColumnError(f"batch: there is no plant {index}; there are 0 to {len(self) - 1}.")
        return int(index) % len(self)

    def recording(self, index: int) -> Recording:
        """The stored columns of one plant as a Recording, up to the end of its run."""
        index = self._row(index)
        system = self.plant(index)
        rows = slice(int(self.reached[index]))
        stored = {
            name: np.asarray(values[index, rows], dtype=float)
            for name, values in self.columns.items()
        }
        columns = {"time": self.time[rows], **stored}
        remarks = [
            *system.describe(),
            *(system.diagnose(Columns(columns)) if self.reached[index] else []),
        ]
        notes = [f"plant {index} of a batch", *self.notes, *map(str, remarks)]
        if self.status[index]:
            notes.append(self.reason(index))
        return Recording(
            columns, "simulation", system.constants, tuple(notes), references=tuple(self.references)
        )

    def __repr__(self) -> str:
        failed = f", {self.failed.size} failed" if self.failed.size else ""
        content = (
            f"{', '.join(self.columns)} at {self.time.size} times"
            if self.columns
            else "final states"
        )
        return f"BatchSolution({len(self)} plants: {content}{failed})"


@contextlib.contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """A context manager for a folder that is renamed to `path` when all is written. Raises
    FileError.
    """
    if path.exists():
        raise FileError(
            f"{path}: it exists already; give a folder that does not exist, or remove it."
        )
    with raise_file_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        folder = Path(tempfile.mkdtemp(prefix=f".{path.name}-", dir=path.parent))
    try:
        yield folder
        folder.chmod(0o755)
        os.replace(folder, path)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def new_columns(
    names: Sequence[str], shape: tuple[int, int], kind: Any, folder: Path | None
) -> dict[str, Any]:
    """Arrays (N, T) for columns, in memory or as one .npy file each. Raises ParameterError for too
    much memory.
    """
    if folder is not None:
        files = {name: folder / file_of(name) for name in names}
        columns = {
            name: np.lib.format.open_memmap(file, "w+", np.dtype(kind), shape)
            for name, file in files.items()
        }
        for file in (
            files.values() if hasattr(os, "posix_fallocate") else ()
        ):  # without room, writing ends the process
            with file.open("r+b") as opened:
                os.posix_fallocate(opened.fileno(), 0, file.stat().st_size)
        return columns
    size = len(names) * shape[0] * shape[1] * np.dtype(kind).itemsize
    if size > MAX_MEMORY:
        raise ParameterError(
            f"simulate_batch: {len(names)} columns of {shape[0]} plants at {shape[1]} output times"
            f" take {size / 1e9:.3g} GB of memory; the limit is {MAX_MEMORY / 1e9:g} GB. Choose"
            " columns (keep=...), write to disk (into=...), or fewer output times"
            " (output_times=...)."
        )
    return {name: np.empty(shape, kind) for name in names}


def file_of(name: str) -> str:
    """The file of a column; characters that a file name may not contain are percent-encoded."""
    return f"{quote(name, safe=' ')}.npy"


def write_rest(solution: BatchSolution, folder: Path) -> None:
    """Write what is not in the files of the columns: times, status, final states, the notes and a
    list of all files.
    """
    final = {f"final {name}": values for name, values in solution.final.items()}
    small = {"time": solution.time, "status": solution.status, "reached": solution.reached, **final}
    for column in solution.columns.values():
        column.flush()  # type: ignore[attr-defined]
    for name, values in small.items():
        np.save(folder / file_of(name), values)
    files = {name: file_of(name) for name in (*solution.columns, *small)}
    remarks = {
        "notes": solution.notes,
        "reasons": solution.reasons,
        "varied": list(solution.variations.paths),
    }
    (folder / "batch.json").write_text(
        json.dumps({"files": files, **remarks}, indent=2), encoding="utf-8"
    )

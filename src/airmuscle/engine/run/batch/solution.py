"""BatchSolution: final states, columns in memory or on disk, and status of every plant."""

import dataclasses
import json
import os
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import numpy.typing as npt

from ....core import (
    Array,
    ColumnError,
    Columns,
    FileError,
    ParameterError,
    Reference,
    Status,
    System,
    alternatives,
    cite,
)
from ....recording import Recording
from ..integrators import Integrator
from .variations import Variations


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
            raise ColumnError(f"batch: no column '{name}'{alternatives(name, self.columns, 'kept are')}{advice}")
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
        kept = {name: np.asarray(values[index, rows], dtype=float) for name, values in self.columns.items()}
        columns = {"time": self.time[rows], **kept}
        remarks = [*system.describe(), *(system.diagnose(Columns(columns)) if self.reached[index] else [])]
        notes = [f"plant {index} of a batch", *self.notes, *map(str, remarks)]
        if self.status[index]:
            notes.append(self.reason(index))
        return Recording(columns, "simulation", system.constants, tuple(notes), references=tuple(self.references))

    def __repr__(self) -> str:
        failed = f", {self.failed.size} failed" if self.failed.size else ""
        kept = f"{', '.join(self.columns)} at {self.time.size} times" if self.columns else "final states"
        return f"BatchSolution({len(self)} plants: {kept}{failed})"


MAX_MEMORY = 4e9
"""Bytes that the columns in memory may take (chosen)."""


class InMemory:
    """Columns (N, T) as arrays."""

    def __init__(self, names: Sequence[str], count: int, rows: int, kind: npt.DTypeLike) -> None:
        size = len(names) * count * rows * np.dtype(kind).itemsize
        if size > MAX_MEMORY:
            raise ParameterError(
                f"simulate_batch: {len(names)} columns of {count} plants at {rows} output times take "
                f"{size / 1e9:.3g} GB of memory; the limit is {MAX_MEMORY / 1e9:g} GB. Choose columns (keep=...), "
                "write to disk (into=...), or fewer output times (output_times=...)."
            )
        self.columns: dict[str, npt.NDArray[Any]] = {name: np.empty((count, rows), kind) for name in names}

    def finish(self, small: Mapping[str, npt.NDArray[Any]], remarks: Mapping[str, Any]) -> dict[str, Any]:
        """The complete columns."""
        return self.columns

    def abandon(self) -> None:
        """Discard the columns."""


class OnDisk(InMemory):
    """Columns (N, T) as one .npy file each, in a folder that is renamed to its name when all is written."""

    def __init__(self, path: str | Path, names: Sequence[str], count: int, rows: int, kind: npt.DTypeLike) -> None:
        self.path = Path(path)
        if self.path.exists():
            raise FileError(f"{self.path}: it exists already; give a folder that does not exist, or remove it.")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._folder = Path(tempfile.mkdtemp(prefix=f".{self.path.name}-", dir=self.path.parent))
            self.columns = {
                name: np.lib.format.open_memmap(self._folder / file_of(name), "w+", np.dtype(kind), (count, rows))
                for name in names
            }
        except OSError as error:
            raise FileError(f"{self.path}: cannot be written: {error.strerror or error}.") from None

    def finish(self, small: Mapping[str, npt.NDArray[Any]], remarks: Mapping[str, Any]) -> dict[str, Any]:
        """Write the rest, rename the folder, and open the columns for reading."""
        names = list(self.columns)
        for column in self.columns.values():
            column.flush()  # type: ignore[attr-defined]
        self.columns = {}
        for name, values in small.items():
            np.save(self._folder / file_of(name), values)
        files = {name: file_of(name) for name in (*names, *small)}
        text = json.dumps({"files": files, **remarks}, indent=2)
        (self._folder / "batch.json").write_text(text, encoding="utf-8")
        self._folder.chmod(0o755)
        os.replace(self._folder, self.path)
        return {name: np.load(self.path / file_of(name), mmap_mode="r") for name in names}

    def abandon(self) -> None:
        """Remove the written files."""
        self.columns = {}
        shutil.rmtree(self._folder, ignore_errors=True)


def file_of(name: str) -> str:
    """The file of a column; characters that a file name may not contain are percent-encoded."""
    return f"{quote(name, safe=' ')}.npy"

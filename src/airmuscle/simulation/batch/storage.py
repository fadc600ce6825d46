"""Where the columns of a batch are kept: in memory, or in a folder of .npy files that appears when it is whole."""

from __future__ import annotations

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

from ...core.errors import FileError, ParameterError

MOST_BYTES = 4e9
"""What is held in memory without a word."""


class InMemory:
    """Columns (N, T) as arrays."""

    def __init__(self, names: Sequence[str], count: int, rows: int, kind: npt.DTypeLike) -> None:
        size = len(names) * count * rows * np.dtype(kind).itemsize
        if size > MOST_BYTES:
            raise ParameterError(
                f"simulate_batch: {len(names)} columns of {count} plants at {rows} instants take {size / 1e9:.3g} GB "
                f"of memory; {MOST_BYTES / 1e9:g} GB are allowed. Choose columns (keep=...), write to disk (into=...), "
                "or ask for fewer instants (output=...)."
            )
        self.columns: dict[str, npt.NDArray[Any]] = {name: np.empty((count, rows), kind) for name in names}

    def finished(self, small: Mapping[str, npt.NDArray[Any]], told: Mapping[str, Any]) -> dict[str, Any]:
        """The columns, for good."""
        return self.columns

    def abandoned(self) -> None:
        """Nothing is left behind."""


class OnDisk(InMemory):
    """Columns (N, T) as one .npy file each, in a folder that takes its name when all is written."""

    def __init__(self, path: str | Path, names: Sequence[str], count: int, rows: int, kind: npt.DTypeLike) -> None:
        self.goal = Path(path)
        if self.goal.exists():
            raise FileError(f"{self.goal}: it exists already; name a folder that does not, or remove it.")
        try:
            self.goal.parent.mkdir(parents=True, exist_ok=True)
            self.place = Path(tempfile.mkdtemp(prefix=f".{self.goal.name}-", dir=self.goal.parent))
            self.columns = {
                name: np.lib.format.open_memmap(self.place / file_of(name), "w+", np.dtype(kind), (count, rows))
                for name in names
            }
        except OSError as error:
            raise FileError(f"{self.goal}: cannot be written: {error.strerror or error}.") from None

    def finished(self, small: Mapping[str, npt.NDArray[Any]], told: Mapping[str, Any]) -> dict[str, Any]:
        """Write what is left, give the folder its name, and open the columns for reading."""
        names = list(self.columns)
        for column in self.columns.values():
            column.flush()  # type: ignore[attr-defined]
        self.columns = {}
        for name, values in small.items():
            np.save(self.place / file_of(name), values)
        files = {name: file_of(name) for name in (*names, *small)}
        text = json.dumps({"files": files, **told}, indent=2)
        (self.place / "batch.json").write_text(text, encoding="utf-8")
        self.place.chmod(0o755)
        os.replace(self.place, self.goal)
        return {name: np.load(self.goal / file_of(name), mmap_mode="r") for name in names}

    def abandoned(self) -> None:
        """Remove what was begun."""
        self.columns = {}
        shutil.rmtree(self.place, ignore_errors=True)


def file_of(name: str) -> str:
    """The file of a column; signs that a file's name may not hold are written as %2F."""
    return f"{quote(name, safe=' ')}.npy"

"""Storage of the columns of a batch: in memory, or in a folder of .npy files that appears when it is complete."""

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

from ....core.errors import FileError, ParameterError

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

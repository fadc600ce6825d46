"""Reader of MDF 3 and 4 (ASAM): groups of channels, each group with its own time channel."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import FileError, suggestion
from .channels import Channel, merge_channels
from .optional_dependency import import_lab_package, run_reader
from .separate_process import read_in_separate_process
from .table import RawTable

_TIME_MASTER = 1
"""Type of a master channel that contains time, in both versions of the format."""


def read_mdf_tables(path: Path, group: str | None = None) -> tuple[RawTable, ...]:
    """Read one table from all channels, or from the named channel group. Raises FileError or ColumnError.

    The package for this format is native code, therefore a separate process reads the file.
    """
    tables: tuple[RawTable, ...] = read_in_separate_process("asammdf", __name__, "read_mdf_tables_here", path, group)
    return tables


def read_mdf_tables_here(path: Path, group: str | None) -> tuple[RawTable, ...]:
    """As `read_mdf_tables`, in this process."""
    asammdf = import_lab_package("asammdf", path)

    def read() -> tuple[RawTable, ...]:
        with asammdf.MDF(path) as file:
            names = [_group_name(g, i) for i, g in enumerate(file.groups)]
            if group is not None and group not in names:
                raise FileError(
                    f"{path.name}: no group '{group}'; the groups are {', '.join(names)}.{suggestion(group, names)}"
                )
            selected = [i for i, name in enumerate(names) if group in (None, name)]
            return (merge_channels(path.name, list(_channels(file, selected)), {}),)

    return run_reader(path, "MDF", read)


def _group_name(group: Any, index: int) -> str:
    return str(getattr(group.channel_group, "acq_name", "") or f"group {index + 1}")


def _channels(file: Any, groups: list[int]) -> Iterator[Channel]:
    for i in groups:
        master = file.masters_db.get(i)
        timed = master is not None and _is_time(file.groups[i].channels[master])
        for j, channel in enumerate(file.groups[i].channels):
            if j == master and timed:
                continue
            signal = file.get(group=i, index=j)
            time = np.asarray(signal.timestamps, dtype=float) if timed else None
            yield Channel(channel.name, signal.samples, time, signal.unit or "")


def _is_time(master: Any) -> bool:
    return getattr(master, "sync_type", _TIME_MASTER) == _TIME_MASTER

"""Reader of MDF 3 and 4 (ASAM): groups of channels, each group with its own time channel."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...core.arrays import Array
from ...core.errors import FileError, listed, suggestion
from .channels import Channel, merge_channels
from .downsampling import Decimation, Downsampling
from .optional_dependency import import_lab_package, run_reader
from .pieces import read_reduced
from .separate_process import read_in_separate_process
from .table import RawTable

_TIME_MASTER = 1
"""Type of a master channel that contains time, in both versions of the format."""


def read_mdf_tables(
    path: Path, group: str | None = None, downsampling: Downsampling = Decimation()
) -> tuple[RawTable, ...]:
    """Read one table from all channels, or from the named channel group. Raises FileError or ColumnError.

    A channel group with more than `downsampling.max_rows` rows is read by pieces and reduced. The package for this
    format is native code, therefore a separate process reads the file.
    """
    tables: tuple[RawTable, ...] = read_in_separate_process(
        "asammdf", __name__, "read_mdf_tables_here", path, group, downsampling
    )
    return tables


def read_mdf_tables_here(path: Path, group: str | None, downsampling: Downsampling) -> tuple[RawTable, ...]:
    """As `read_mdf_tables`, in this process."""
    asammdf = import_lab_package("asammdf", path)

    def read() -> tuple[RawTable, ...]:
        with asammdf.MDF(path) as file:
            names = [_group_name(g, i) for i, g in enumerate(file.groups)]
            if group is not None and group not in names:
                raise FileError(
                    f"{path.name}: no group '{group}'; the groups are {listed(names)}.{suggestion(group, names)}"
                )
            selected = [i for i, name in enumerate(names) if group in (None, name)]
            table = merge_channels(path.name, list(_channels(file, selected, downsampling)), {})
            notes = [note for i in selected for note in _notes(file.groups[i], names[i], downsampling)]
            return (dataclasses.replace(table, notes=(*table.notes, *notes)),)

    return run_reader(path, "MDF", read)


def _group_name(group: Any, index: int) -> str:
    return str(getattr(group.channel_group, "acq_name", "") or f"group {index + 1}")


def _rows(group: Any) -> int:
    return int(group.channel_group.cycles_nr)


def _notes(group: Any, name: str, downsampling: Downsampling) -> list[str]:
    """The note on the reduction of a channel group; none if it is read as a whole."""
    step = downsampling.step(max(_rows(group), 1))
    return [] if step == 1 else [f"Channel group '{name}': {downsampling.note(_rows(group), step)}"]


def _channels(file: Any, groups: list[int], downsampling: Downsampling) -> Iterator[Channel]:
    for i in groups:
        master = file.masters_db.get(i)
        timed = master is not None and _is_time(file.groups[i].channels[master])
        rows = _rows(file.groups[i])
        step = downsampling.step(max(rows, 1))
        time = None
        for j, channel in enumerate(file.groups[i].channels):
            if j == master and timed:
                continue
            if step == 1:
                signal = file.get(group=i, index=j)
                time = np.asarray(signal.timestamps, dtype=float) if timed else None
                yield Channel(channel.name, signal.samples, time, signal.unit or "")
                continue
            if timed and time is None:
                time = read_reduced(functools.partial(_times, file, i), rows, step, downsampling)
            samples = functools.partial(_samples, file, i, j)
            unit = file.get(group=i, index=j, record_offset=0, record_count=1).unit or ""
            yield Channel(channel.name, read_reduced(samples, rows, step, downsampling), time, unit)


def _times(file: Any, group: int, first: int, end: int) -> Array:
    return np.asarray(file.get_master(group, record_offset=first, record_count=end - first), dtype=float)


def _samples(file: Any, group: int, channel: int, first: int, end: int) -> Any:
    return file.get(group=group, index=channel, record_offset=first, record_count=end - first).samples


def _is_time(master: Any) -> bool:
    return getattr(master, "sync_type", _TIME_MASTER) == _TIME_MASTER

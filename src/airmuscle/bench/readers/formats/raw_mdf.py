"""Reader of MDF files, versions 3 and 4 (ASAM): channels of groups with times of their own."""

import functools
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ....core import Array
from ..tables import (
    Channel,
    RawTable,
    Reduction,
    Selection,
    import_lab_package,
    merge_channels,
    reading,
)

_TIME_MASTER = 1
"""Type of a master channel that contains time, in both versions of the format."""


def read_mdf_tables(path: Path, selection: Selection = Selection()) -> tuple[RawTable, ...]:
    """Read one table from all channels, or from the selected channel groups. Raises FileError
    or ColumnError. A channel group with more than `downsampling.max_rows` rows is read by pieces
    and reduced.
    """
    with reading(path, "MDF"), import_lab_package("asammdf", path).MDF(path) as file:
        names = [
            str(getattr(g.channel_group, "acq_name", "") or f"group {i}")
            for i, g in enumerate(file.groups, 1)
        ]
        selected = selection.groups(path.name, "group", names)
        reductions = {
            i: Reduction(selection.downsampling, int(file.groups[i].channel_group.cycles_nr))
            for i, name in enumerate(names)
            if name in selected
        }
        table = merge_channels(
            path.name, list(_channels(file, reductions)), {}, mapped=selection.columns
        )
        notes = [
            f"Channel group '{names[i]}': {reduction.note}"
            for i, reduction in reductions.items()
            if reduction.note
        ]
        return (table.noted(*notes),)


def _channels(file: Any, reductions: Mapping[int, Reduction]) -> Iterator[Channel]:
    """The channels of groups by their indices."""
    for i, reduction in reductions.items():
        master = file.masters_db.get(i)
        channels = file.groups[i].channels
        time = None
        timed = (
            master is not None
            and getattr(channels[master], "sync_type", _TIME_MASTER) == _TIME_MASTER
        )
        for j, channel in enumerate(channels):
            if j == master and timed:
                continue
            if reduction.step == 1:
                signal = file.get(group=i, index=j)
                time = np.asarray(signal.timestamps, dtype=float) if timed else None
                yield Channel(channel.name, signal.samples, time, signal.unit or "")
                continue
            if timed and time is None:
                time = reduction.read(functools.partial(_times, file, i), reduction.rows)
            samples = reduction.read(functools.partial(_samples, file, i, j), reduction.rows)
            unit = file.get(group=i, index=j, record_offset=0, record_count=1).unit or ""
            yield Channel(channel.name, samples, time, unit)


def _times(file: Any, group: int, first: int, end: int) -> Array:
    return np.asarray(
        file.get_master(group, record_offset=first, record_count=end - first), dtype=float
    )


def _samples(file: Any, group: int, channel: int, first: int, end: int) -> Any:
    return file.get(
        group=group, index=channel, record_offset=first, record_count=end - first
    ).samples

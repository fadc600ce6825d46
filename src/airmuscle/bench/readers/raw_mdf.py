"""Readers of MDF 3 and 4 (ASAM) and of TDMS (LabVIEW): one table for each group of channels."""

import functools
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...core import Array, FileError, check_known
from .channels import Channel, RawTable, merge_channels
from .separate_process import import_lab_package, in_separate_process, reading
from .time_base import Decimation, Downsampling, Reduction

_TIME_MASTER = 1
"""Type of a master channel that contains time, in both versions of the format."""


def read_mdf_tables_here(
    path: Path, group: str | None = None, downsampling: Downsampling = Decimation()
) -> tuple[RawTable, ...]:
    """Read one table from all channels, or from the named channel group. Raises FileError or ColumnError.

    A channel group with more than `downsampling.max_rows` rows is read by pieces and reduced. The package for this
    format is native code, therefore a separate process reads the file.
    """
    with reading(path, "MDF"), import_lab_package("asammdf", path).MDF(path) as file:
        names = [str(getattr(g.channel_group, "acq_name", "") or f"group {i}") for i, g in enumerate(file.groups, 1)]
        check_known(f"{path.name}: no group", [] if group is None else group, names, "the groups are", FileError)
        reductions = {
            i: Reduction(downsampling, int(file.groups[i].channel_group.cycles_nr))
            for i, name in enumerate(names) if group in (None, name)
        }  # fmt: skip
        table = merge_channels(path.name, list(_channels(file, reductions)), {})
        notes = [f"Channel group '{names[i]}': {each.note}" for i, each in reductions.items() if each.note]
        return (table.noted(*notes),)


read_mdf_tables = in_separate_process("asammdf", read_mdf_tables_here)


def _channels(file: Any, reductions: Mapping[int, Reduction]) -> Iterator[Channel]:
    """The channels of groups by their indices."""
    for i, reduction in reductions.items():
        master = file.masters_db.get(i)
        channels, time = file.groups[i].channels, None
        timed = master is not None and getattr(channels[master], "sync_type", _TIME_MASTER) == _TIME_MASTER
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
    return np.asarray(file.get_master(group, record_offset=first, record_count=end - first), dtype=float)


def _samples(file: Any, group: int, channel: int, first: int, end: int) -> Any:
    return file.get(group=group, index=channel, record_offset=first, record_count=end - first).samples


NO_DATE = np.datetime64("1904-01-01T00:00:00", "us")
"""The date that LabVIEW writes where none is set, the origin of its time."""


def read_tdms_tables(path: Path, group: str | None = None) -> tuple[RawTable, ...]:
    """Read one table from each group with channels, or from the named group. Raises FileError or ColumnError."""
    nptdms = import_lab_package("nptdms", path)
    nptdms.log.log_manager.set_level("CRITICAL")  # what it prints of a damaged file is the contents of the file
    with reading(path, "TDMS"), nptdms.TdmsFile.open(path) as file:
        nonempty = {g.name: g for g in file.groups() if any(len(c) for c in g.channels())}
        if not nonempty:
            raise FileError(f"{path.name}: no channel contains values.")
        check_known(f"{path.name}: no group", [] if group is None else group, nonempty, "the groups are", FileError)
        selected = [each for name, each in nonempty.items() if group in (None, name)]
        return tuple(_make_table(path, each, dict(file.properties), len(selected) > 1) for each in selected)


def _make_table(path: Path, group: Any, properties: dict[str, Any], several: bool) -> RawTable:
    constants = {
        name: value
        for name, value in {**properties, **group.properties}.items()
        if isinstance(value, float | int | str) and name not in ("name", "description", "title", "author")
    }
    origin = f"{path.name}, group '{group.name}'" if several else path.name
    channels = []
    for channel, start in zip(group.channels(), _start_times(group.channels()), strict=True):
        unit = str(channel.properties.get("unit_string") or channel.properties.get("NI_UnitDescription") or "")
        time, step = None, _step(channel)
        if step > 0.0:
            offset = float(channel.properties.get("wf_start_offset", 0.0))
            time = np.asarray(start + offset + step * np.arange(len(channel)))
        channels.append(Channel(channel.name, channel[:], time, unit))
    return merge_channels(origin, channels, constants)


def _start_times(channels: list[Any]) -> list[float]:
    """The start of each waveform after that of the first [s]; 0 for all unless each waveform states its date."""
    dates = {i: c.properties.get("wf_start_time") for i, c in enumerate(channels) if _step(c) > 0.0 and len(c)}
    if any(date is None or np.datetime64(date) <= NO_DATE for date in dates.values()):
        return [0.0] * len(channels)
    instants = {i: np.datetime64(date, "us") for i, date in dates.items()}
    first = min(instants.values(), default=NO_DATE)
    return [float((instants.get(i, first) - first) / np.timedelta64(1, "s")) for i in range(len(channels))]


def _step(channel: Any) -> float:
    """The sample time of a waveform [s]; 0 for other channels, for which LabVIEW writes none or one of zero."""
    return float(channel.properties.get("wf_increment", 0.0))

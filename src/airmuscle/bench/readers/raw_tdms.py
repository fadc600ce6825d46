"""Reader of TDMS (LabVIEW): one table for each group of channels."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...core.arrays import Array
from ...core.errors import FileError, suggestion
from .channels import Channel, merge_channels
from .optional_dependency import import_lab_package, run_reader
from .table import RawTable

NO_DATE = np.datetime64("1904-01-01T00:00:00", "us")
"""The date that LabVIEW writes where none is set, the origin of its time."""


def read_tdms_tables(path: Path, group: str | None = None) -> tuple[RawTable, ...]:
    """Read one table from each group with channels, or from the named group. Raises FileError or ColumnError."""
    nptdms = import_lab_package("nptdms", path)
    nptdms.log.log_manager.set_level("CRITICAL")  # what it prints of a damaged file is the contents of the file

    def read() -> tuple[RawTable, ...]:
        with nptdms.TdmsFile.open(path) as file:
            nonempty = {g.name: g for g in file.groups() if any(len(c) for c in g.channels())}
            selected = _select_groups(path, nonempty, group)
            several = len(selected) > 1
            return tuple(_make_table(path, g, dict(file.properties), several) for g in selected)

    return run_reader(path, "TDMS", read)


def _select_groups(path: Path, groups: dict[str, Any], name: str | None) -> list[Any]:
    if not groups:
        raise FileError(f"{path.name}: no channel contains values.")
    if name is None:
        return list(groups.values())
    if name not in groups:
        raise FileError(
            f"{path.name}: no group '{name}'; the groups are {', '.join(groups)}.{suggestion(name, groups)}"
        )
    return [groups[name]]


def _make_table(path: Path, group: Any, properties: dict[str, Any], several: bool) -> RawTable:
    merged = {**properties, **group.properties}
    constants = {
        name: value
        for name, value in merged.items()
        if isinstance(value, float | int | str) and name not in ("name", "description", "title", "author")
    }
    origin = f"{path.name}, group '{group.name}'" if several else path.name
    channels = group.channels()
    starts = _start_times(channels)
    return merge_channels(
        origin, [_make_channel(c, start) for c, start in zip(channels, starts, strict=True)], constants
    )


def _make_channel(channel: Any, start: float) -> Channel:
    unit = str(channel.properties.get("unit_string") or channel.properties.get("NI_UnitDescription") or "")
    return Channel(channel.name, channel[:], _waveform_time(channel, start), unit)


def _start_times(channels: list[Any]) -> list[float]:
    """The start of each waveform after that of the first [s]; 0 for all unless each waveform states its date."""
    dates = {i: c.properties.get("wf_start_time") for i, c in enumerate(channels) if _step(c) > 0.0 and len(c)}
    if any(date is None or np.datetime64(date) <= NO_DATE for date in dates.values()):
        return [0.0] * len(channels)
    instants = {i: np.datetime64(date, "us") for i, date in dates.items()}
    first = min(instants.values(), default=NO_DATE)
    return [float((instants.get(i, first) - first) / np.timedelta64(1, "s")) for i in range(len(channels))]


def _step(channel: Any) -> float:
    """The sample time of a waveform [s]; 0 for other channels."""
    return float(channel.properties.get("wf_increment", 0.0))


def _waveform_time(channel: Any, start: float) -> Array | None:
    """The times of a waveform [s]; None for other channels, for which LabVIEW writes a step of zero."""
    step = _step(channel)
    if not step > 0.0:
        return None
    offset = float(channel.properties.get("wf_start_offset", 0.0))
    return np.asarray(start + offset + step * np.arange(len(channel)))

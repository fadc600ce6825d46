"""Reader of TDMS files (LabVIEW): waveforms with their start and increment, and other channels."""

from pathlib import Path
from typing import Any

import numpy as np

from ....core import FileError
from ..tables import Channel, RawTable, Selection, import_lab_package, merge_channels, reading

NO_DATE = np.datetime64("1904-01-01T00:00:00", "us")
"""The date that LabVIEW writes where none is set, the origin of its time."""


def read_tdms_tables(path: Path, selection: Selection = Selection()) -> tuple[RawTable, ...]:
    """Read one table from each group with channels, or from the selected groups. Raises FileError
    or ColumnError.
    """
    nptdms = import_lab_package("nptdms", path)
    nptdms.log.log_manager.set_level(
        "CRITICAL"
    )  # what it prints of a damaged file is the contents of the file
    with reading(path, "TDMS"), nptdms.TdmsFile.open(path) as file:
        nonempty = {g.name: g for g in file.groups() if any(len(c) for c in g.channels())}
        if not nonempty:
            raise FileError(f"{path.name}: no channel contains values.")
        selected = [nonempty[name] for name in selection.groups(path.name, "group", nonempty)]
        tables = list[RawTable]()
        for group in selected:
            constants = {
                name: value
                for name, value in {**file.properties, **group.properties}.items()
                if isinstance(value, float | int | str)
                and name not in ("name", "description", "title", "author")
            }
            channels = []
            for channel, start in zip(
                group.channels(), _start_times(group.channels()), strict=True
            ):
                unit = str(
                    channel.properties.get("unit_string")
                    or channel.properties.get("NI_UnitDescription")
                    or ""
                )
                time = None
                step = _step(channel)
                if step > 0.0:
                    offset = float(channel.properties.get("wf_start_offset", 0.0))
                    time = np.asarray(start + offset + step * np.arange(len(channel)))
                channels.append(Channel(channel.name, channel[:], time, unit))
            origin = f"{path.name}, group '{group.name}'" if len(selected) > 1 else path.name
            tables.append(merge_channels(origin, channels, constants, mapped=selection.columns))
        return tuple(tables)


def _start_times(channels: list[Any]) -> list[float]:
    """The start of each waveform after that of the first [s]; 0 for all unless each waveform states
    its date.
    """
    dates = {
        i: c.properties.get("wf_start_time")
        for i, c in enumerate(channels)
        if _step(c) > 0.0 and len(c)
    }
    if any(date is None or np.datetime64(date) <= NO_DATE for date in dates.values()):
        return [0.0] * len(channels)
    instants = {i: np.datetime64(date, "us") for i, date in dates.items()}
    first = min(instants.values(), default=NO_DATE)
    return [
        float((instants.get(i, first) - first) / np.timedelta64(1, "s"))
        for i in range(len(channels))
    ]


def _step(channel: Any) -> float:
    """The sample time of a waveform [s]; 0 for other channels, for which LabVIEW writes none or one
    of zero.
    """
    return float(channel.properties.get("wf_increment", 0.0))

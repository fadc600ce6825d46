"""Channels that a logger kept by themselves, each with its own time, brought to common rows."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..core.arrays import Array
from ..core.errors import ColumnError
from .heading import find_quantity_name
from .table import Cells, RawTable


@dataclasses.dataclass(frozen=True, eq=False)
class Channel:
    """A channel as a file holds it: N values, and their N times [s] where the file states any."""

    name: str
    values: Any
    time: Array | None = None
    unit: str = ""


def merge_channels(
    origin: str, channels: Sequence[Channel], remarks: Mapping[str, float | str], row_word: str = "row"
) -> RawTable:
    """The table that channels make together.

    Where their times differ, the rows are those of the channel with most of them, within the time that all cover;
    others are interpolated between their rows, steps (whole numbers) held, and a note says so for each.
    """
    channels = [c for c in channels if np.ndim(c.values) == 1 and len(c.values)]
    if not channels:
        raise ColumnError(f"{origin}: there is no channel with a row of numbers.")
    timed = [c for c in channels if c.time is not None]
    if not timed or all(_same_time(c, timed[0]) for c in channels):
        _check_equal_lengths(origin, channels)
        return _make_table(origin, channels, timed[0].time if timed else None, (), remarks, row_word)
    _check_timed(origin, channels)
    return _resample(origin, channels, remarks, row_word)


def _same_time(one: Channel, other: Channel) -> bool:
    assert other.time is not None
    if len(one.values) != len(other.values):
        return False
    return one.time is None or bool(np.array_equal(one.time, other.time))


def _check_equal_lengths(origin: str, channels: Sequence[Channel]) -> None:
    if len({len(c.values) for c in channels}) > 1:
        sizes = ", ".join(f"{c.name} {len(c.values)}" for c in channels)
        raise ColumnError(
            f"{origin}: the channels have different numbers of rows ({sizes}) and state no time that would bring them "
            "together. Choose a group with channels of one length, or export them with their time."
        )


def _check_timed(origin: str, channels: Sequence[Channel]) -> None:
    without = [c.name for c in channels if c.time is None]
    if without:
        raise ColumnError(
            f"{origin}: the channels have different rows, and {', '.join(without)} state no time. Choose a group with "
            "channels of one length, or export them with their time."
        )


def _resample(origin: str, channels: Sequence[Channel], remarks: Mapping[str, float | str], row_word: str) -> RawTable:
    leader = max(channels, key=lambda c: len(c.values))
    low = max(float(c.time[0]) for c in channels if c.time is not None)
    high = min(float(c.time[-1]) for c in channels if c.time is not None)
    assert leader.time is not None
    rounding = 1e-9 * max(abs(low), abs(high))  # the same instant, computed in two ways
    time = leader.time[(leader.time >= low - rounding) & (leader.time <= high + rounding)]
    if not len(time):
        raise ColumnError(f"{origin}: the channels have no time in common. Choose one group of them.")
    moved, notes = [], []
    for channel in channels:
        same = channel.time is not None and np.array_equal(channel.time, leader.time)
        moved.append(dataclasses.replace(channel, values=_interpolate(channel, time), time=time))
        if not same:
            rows = f"its {len(channel.values)} rows are interpolated to the {len(time)} of '{leader.name}'"
            notes.append(f"Channel '{channel.name}' has a time of its own: {rows}.")
    return _make_table(origin, moved, time, tuple(notes), remarks, row_word)


def _interpolate(channel: Channel, time: Array) -> Any:
    """Values at other times: held where they are whole numbers (a valve, a counter), else on straight lines."""
    assert channel.time is not None
    values = np.asarray(channel.values)
    if values.dtype.kind in "biuUSO":
        at_or_before = np.searchsorted(channel.time, time * (1.0 + 1e-9), side="right") - 1
        return values[np.clip(at_or_before, 0, None)]
    return np.interp(time, channel.time, values)


def _make_table(
    origin: str,
    channels: Sequence[Channel],
    time: Array | None,
    notes: tuple[str, ...],
    remarks: Mapping[str, float | str],
    row_word: str,
) -> RawTable:
    has_time = any(find_quantity_name(c.name.partition(" ")[0].partition("_")[0]) == "time" for c in channels)
    if time is not None and not has_time:
        channels = [Channel("time", time - time[0], unit="s"), *channels]
    headings = tuple(c.name for c in channels)
    units = tuple(c.unit for c in channels)
    columns = tuple(to_cells(c.values) for c in channels)
    rows = np.arange(1, len(channels[0].values) + 1)
    return RawTable(origin, headings, units if any(units) else None, columns, rows, row_word, remarks, notes)


def to_cells(values: Any) -> Cells:
    """Numbers as floats, instants as seconds from the first, everything else as text."""
    array = np.asarray(values)
    if array.dtype.kind == "M":
        return np.asarray((array - array[0]) / np.timedelta64(1, "s"), dtype=float)
    if array.dtype.kind in "biuf":
        return np.ascontiguousarray(array, dtype=float)
    return [v.decode("utf-8", errors="replace") if isinstance(v, bytes) else str(v) for v in array.tolist()]

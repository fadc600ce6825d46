"""RawTable, the headings and cells of a file before interpretation, and channels with individual
time vectors.

Every file reader returns RawTables, and `interpret` converts them to Recordings.
"""

import contextlib
import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import Array, ColumnError
from ...recording.columns import find_quantity_name, split_unit

Cells = npt.NDArray[np.float64] | list[str]
"""A column: numbers if the reader found only numbers, otherwise texts."""


@dataclasses.dataclass(frozen=True, eq=False)
class RawTable:
    """Columns with common rows, their headings, and the number of each row in the file.

    `units` is the unit row below the headings, if any; `constants` are those stated in the comments
    of the file (resting_length, specimen). `row_label` names a row in messages: "line 41".
    """

    origin: str
    headings: tuple[str, ...]
    units: tuple[str, ...] | None
    columns: tuple[Cells, ...]
    rows: npt.NDArray[np.int64]
    row_label: str = "line"
    constants: Mapping[str, float | str] = dataclasses.field(default_factory=dict)
    notes: tuple[str, ...] = ()
    fields: frozenset[str] = frozenset()
    """Headings that are names of fields of a message and state no quantity."""

    def of_columns(self, kept: Sequence[int], **changes: Any) -> "RawTable":
        """The table with these columns alone, by their indices, and with further changes of its
        fields.
        """
        units = (
            None
            if self.units is None
            else tuple(self.units[i] for i in kept if i < len(self.units))
        )
        headings = tuple(self.headings[i] for i in kept)
        columns = tuple(self.columns[i] for i in kept)
        return dataclasses.replace(self, headings=headings, units=units, columns=columns, **changes)

    def of_rows(self, kept: npt.NDArray[np.intp], **changes: Any) -> "RawTable":
        """The table with these rows alone, by their indices, and with further changes of its
        fields.
        """
        columns = tuple(taken(cells, kept) for cells in self.columns)
        return dataclasses.replace(self, columns=columns, rows=self.rows[kept], **changes)

    def noted(self, *notes: str) -> "RawTable":
        """The table with further notes."""
        return dataclasses.replace(self, notes=(*self.notes, *notes))

    def location(self, row: int) -> str:
        """The location of a row in the file, for messages: `bench.csv, line 41`."""
        return f"{self.origin}, {self.row_label} {self.rows[row]}"


def taken(cells: Cells, rows: npt.NDArray[np.intp]) -> Cells:
    """The cells of these rows."""
    return [cells[i] for i in rows] if isinstance(cells, list) else cells[rows]


def numbers_if_all(texts: list[str]) -> Cells:
    """Texts as numbers if each of them is one; otherwise the texts."""
    with contextlib.suppress(ValueError):
        return np.array([float(text) for text in texts])
    return texts


@dataclasses.dataclass(frozen=True, eq=False)
class Channel:
    """A channel as stored in a file: `values` (N,), their times (N,) [s] if the file states any,
    and the unit.

    is_quantity  whether its name may state a quantity
    """

    name: str
    values: Any
    time: Array | None = None
    unit: str = ""
    is_quantity: bool = True


def merge_channels(
    origin: str,
    channels: Sequence[Channel],
    constants: Mapping[str, float | str],
    row_label: str = "row",
) -> RawTable:
    """The table with one column for each channel.

    If the time vectors differ, the rows of the table are those of the channel with the most
    samples, within the time that all channels cover. The other channels are interpolated linearly,
    integer-valued ones (a valve, a counter) by zero-order hold, and a note reports each. Raises
    ColumnError if the channels cannot be merged.
    """
    channels = [c for c in channels if np.ndim(c.values) == 1 and len(c.values)]
    if not channels:
        raise ColumnError(f"{origin}: no channel contains a vector of numbers.")
    times = [c.time for c in channels if c.time is not None]
    notes = tuple[str, ...]()
    time = times[0] if times else None
    if len({len(c.values) for c in channels}) > 1 or not all(
        np.array_equal(each, times[0]) for each in times
    ):
        channels, time, notes = _resampled(origin, channels)
    has_time = any(
        find_quantity_name(c.name.partition(" ")[0].partition("_")[0]) == "time" for c in channels
    )
    if time is not None and not has_time:
        channels = [Channel("time", time - time[0], unit="s"), *channels]
    dated = [
        np.asarray(c.values).dtype.kind in "Mm" for c in channels
    ]  # `to_cells` makes seconds of them
    headings = tuple(
        split_unit(c.name)[0] if d else c.name for c, d in zip(channels, dated, strict=True)
    )
    units = tuple("s" if d else c.unit for c, d in zip(channels, dated, strict=True))
    columns = tuple(to_cells(c.values) for c in channels)
    rows = np.arange(1, len(channels[0].values) + 1)
    fields = frozenset(c.name for c in channels if not c.is_quantity)
    return RawTable(
        origin,
        headings,
        units if any(units) else None,
        columns,
        rows,
        row_label,
        constants,
        notes,
        fields,
    )


def _resampled(
    origin: str, channels: Sequence[Channel]
) -> tuple[list[Channel], Array, tuple[str, ...]]:
    """The channels at the times of the longest one, these times, and a note on each that is
    interpolated. Raises ColumnError where a channel has no time, or one that decreases, so that no
    interpolation is defined.
    """
    times: list[Array] = []
    for channel in channels:
        if channel.time is None:
            sizes = ", ".join(f"{c.name} {len(c.values)}" for c in channels)
            raise ColumnError(
                f"{origin}: the channels have different rows ({sizes}), and no time is stated for"
                f" {channel.name}. Select a group whose channels have equal lengths, or export the"
                " channels with their time."
            )
        decreasing = np.flatnonzero(np.diff(channel.time) < 0.0)
        if decreasing.size:
            raise ColumnError(
                f"{origin}: the time of channel '{channel.name}' decreases at its row"
                f" {decreasing[0] + 2}, and the channels have different rows. Write each run to a"
                " file of its own."
            )
        times.append(channel.time)
    longest = max(range(len(channels)), key=lambda i: len(channels[i].values))
    name = channels[longest].name
    leading = times[longest]
    low = max(each[0] for each in times)
    high = min(each[-1] for each in times)
    rounding = _rounding(leading)
    time = leading[(leading >= low - rounding) & (leading <= high + rounding)]
    if not len(time):
        raise ColumnError(
            f"{origin}: the time ranges of the channels do not overlap. Select one group of"
            " channels."
        )
    resampled = []
    notes = []
    for channel, own_time in zip(channels, times, strict=True):
        values = np.asarray(channel.values)
        if values.dtype.kind in "biuUSO":
            values = values[
                np.clip(
                    np.searchsorted(own_time, time + _rounding(time), side="right") - 1, 0, None
                )
            ]
        else:
            values = np.interp(time, own_time, values)
        resampled.append(dataclasses.replace(channel, values=values, time=time))
        if not np.array_equal(own_time, leading):
            rows = (
                f"its {len(channel.values)} rows are interpolated to the {len(time)} rows of"
                f" '{name}'"
            )
            notes.append(f"Channel '{channel.name}' has its own time vector: {rows}.")
    return resampled, time, tuple(notes)


def _rounding(time: Array) -> float:
    """The difference [s] by which equal times may differ through rounding; times may count from
    1970.
    """
    return float(1e-9 * np.ptp(time) + 8.0 * np.spacing(np.max(np.abs(time))))


def to_cells(values: Any) -> Cells:
    """Values as cells of a RawTable: numbers as floats, dates and durations in seconds (from the
    first), or texts.
    """
    array = np.asarray(values)
    if array.dtype.kind in "Mm":
        durations = array - array[0] if array.dtype.kind == "M" else array
        return np.asarray(durations / np.timedelta64(1, "s"), dtype=float)
    if array.dtype.kind in "biuf":
        return np.ascontiguousarray(array, dtype=float)
    return [
        v.decode("utf-8", errors="replace") if isinstance(v, bytes) else str(v)
        for v in array.tolist()
    ]

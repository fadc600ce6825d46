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

from ....core import Array, ColumnError, Hint, listed
from ....recording.columns import find_quantity_name, parse_heading, split_unit
from ....recording.recording import RowNote

MAX_QUOTED = 180
"""Maximum number of characters of names in a message (chosen)."""

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
    numbers: tuple[int, ...] = ()
    """Numbers of the columns in the file, from 1 on; empty if they are those of the table."""
    above: tuple[str, ...] = ()
    """Cells of the row above the headings, for each column; empty if there is none."""

    def number(self, column: int) -> int:
        """The number in the file, from 1 on, of a column by its index."""
        return self.numbers[column] if self.numbers else column + 1

    def of_columns(self, indices: Sequence[int], **changes: Any) -> "RawTable":
        """The table with these columns alone, by their indices, and with further changes of its
        fields.
        """
        units = (
            None
            if self.units is None
            else tuple(self.units[i] for i in indices if i < len(self.units))
        )
        headings = tuple(self.headings[i] for i in indices)
        columns = tuple(self.columns[i] for i in indices)
        numbers = tuple(self.number(i) for i in indices)
        above = tuple(self.above[i] for i in indices) if self.above else ()
        parts: dict[str, Any] = {"columns": columns, "numbers": numbers, "above": above}
        return dataclasses.replace(self, headings=headings, units=units, **{**parts, **changes})

    def of_rows(self, indices: npt.NDArray[np.intp], **changes: Any) -> "RawTable":
        """The table with these rows alone, by their indices, and with further changes of its
        fields.
        """
        columns = tuple(taken(cells, indices) for cells in self.columns)
        return dataclasses.replace(self, columns=columns, rows=self.rows[indices], **changes)

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


def _have_equal_rows(channels: Sequence[Channel]) -> bool:
    """Whether channels have as many values at the same times."""
    times = [channel.time for channel in channels if channel.time is not None]
    has_equal_times = all(np.array_equal(time, times[0]) for time in times)
    return has_equal_times and len({len(channel.values) for channel in channels}) == 1


def _is_time(channel: Channel) -> bool:
    word = channel.name.partition(" ")[0].partition("_")[0]
    return find_quantity_name(word) == "time"


def merge_channels(
    origin: str,
    channels: Sequence[Channel],
    constants: Mapping[str, float | str],
    row_label: str = "row",
    mapped: Sequence[str] = (),
) -> RawTable:
    """The table with one column for each channel.

    If the time vectors differ, the rows of the table are those of the measured channel with the
    most samples, within the time that all measured channels cover: those of the `mapped` columns
    and of known quantities. The other channels are interpolated linearly, integers and texts (a
    valve, a counter) by zero-order hold; a channel that was written once is held, and one that does
    not cover the rows is left out. Notes report each, and rows that are left out. Raises
    ColumnError if the measured channels cannot be merged.
    """
    channels = [c for c in channels if np.ndim(c.values) == 1 and len(c.values)]
    if not channels:
        raise ColumnError(f"{origin}: no channel contains a vector of numbers.")
    notes = tuple[str, ...]()
    time = next((c.time for c in channels if c.time is not None), None)
    if not _have_equal_rows(channels):
        channels, time, notes = _on_common_rows(origin, channels, mapped)
    if time is not None and not any(map(_is_time, channels)):
        channels = [Channel("time", time - time[0], unit="s"), *channels]
    headings = []
    units = []
    for channel in channels:
        # `to_cells` makes seconds of dates and durations
        is_dated = np.asarray(channel.values).dtype.kind in "Mm"
        headings.append(split_unit(channel.name)[0] if is_dated else channel.name)
        units.append("s" if is_dated else channel.unit)
    columns = tuple(to_cells(c.values) for c in channels)
    rows = np.arange(1, len(channels[0].values) + 1)
    fields = frozenset(c.name for c in channels if not c.is_quantity)
    return RawTable(
        origin,
        tuple(headings),
        tuple(units) if any(units) else None,
        columns,
        rows,
        row_label,
        constants,
        notes,
        fields,
    )


HELD = "biuUSO"
"""Kinds of values that are held until the next sample: integers, truth values and texts."""


def _on_common_rows(
    origin: str, channels: Sequence[Channel], mapped: Sequence[str]
) -> tuple[list[Channel], Array | None, tuple[str, ...]]:
    """The channels at common rows, the times of these, and notes. Raises ColumnError where a
    measured channel has no time, or one that decreases, so that no interpolation is defined.
    """
    measured = _measured(channels, mapped)
    if len({len(c.values) for c in measured}) == 1 and all(c.time is None for c in measured):
        time = None
        rows = len(measured[0].values)
        leading = measured[0]
    else:
        leading, time = _common_times(origin, channels, measured)
        rows = len(time)
    common = []
    notes = list[str]()
    if rows < len(leading.values):
        notes.append(
            RowNote(
                f"{rows} of {len(leading.values)} rows of channel '{leading.name}' are read: those"
                f" within the time that all measured channels cover ({_names(measured)})."
            )
        )
    for channel in channels:
        values = _at_rows(channel, time, rows)
        if values is None:
            notes.append(_left_out(channel, time, rows))
            continue
        common.append(dataclasses.replace(channel, values=values, time=time))
        if len(channel.values) == 1 < rows:
            notes.append(f"Channel '{channel.name}' was written once and is held in all rows.")
        elif _differ(channel.time, leading.time):
            verb = "held" if np.asarray(channel.values).dtype.kind in HELD else "interpolated"
            notes.append(
                f"Channel '{channel.name}' has its own time vector: its {len(channel.values)} rows"
                f" are {verb} to the {rows} rows of '{leading.name}'."
            )
    return common, time, tuple(notes)


def _measured(channels: Sequence[Channel], mapped: Sequence[str]) -> list[Channel]:
    """The channels that decide which rows there are: of mapped columns and known quantities, else
    of numbers that are no integers, else all; without those that were written once.
    """
    repeated = [c for c in channels if len(c.values) > 1] or list(channels)
    known = [
        c
        for c in repeated
        if c.name in mapped
        or split_unit(c.name)[0] in mapped
        or (c.is_quantity and parse_heading(c.name).known)
    ]
    real = [c for c in repeated if np.asarray(c.values).dtype.kind not in HELD]
    return known or real or repeated


def _common_times(
    origin: str, channels: Sequence[Channel], measured: Sequence[Channel]
) -> tuple[Channel, Array]:
    """The measured channel with the most samples, and its times within those of all measured
    ones.
    """
    times: list[Array] = []
    for channel in measured:
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
    longest = max(range(len(measured)), key=lambda i: len(measured[i].values))
    leading = times[longest]
    low = max(stamps[0] for stamps in times)
    high = min(stamps[-1] for stamps in times)
    rounding = _rounding(leading)
    time = leading[(leading >= low - rounding) & (leading <= high + rounding)]
    if not len(time):
        late = measured[int(np.argmax([stamps[0] for stamps in times]))].name
        early = measured[int(np.argmin([stamps[-1] for stamps in times]))].name
        raise ColumnError(
            f"{origin}: the time ranges of the measured channels do not overlap: '{early}' ends"
            f" before '{late}' begins.",
            hint=Hint("To leave a channel out", "columns", {late: ""}, function="ColumnMapping"),
        )
    return measured[longest], time


def _at_rows(channel: Channel, time: Array | None, rows: int) -> Any:
    """The values of a channel at the common rows; None if it does not cover them."""
    values = np.asarray(channel.values)
    if len(values) == 1:
        return np.repeat(values, rows)
    if time is None or channel.time is None:
        return values if len(values) == rows else None
    steps = np.diff(channel.time)
    if np.any(steps < 0.0):
        return None
    tolerance = float(np.median(steps)) + _rounding(time)  # its next sample is as far away
    is_held = values.dtype.kind in HELD
    begins = channel.time[0] <= time[0] + tolerance
    ends = is_held or channel.time[-1] >= time[-1] - tolerance
    if not (begins and ends):
        return None
    if is_held:
        last = np.searchsorted(channel.time, time + _rounding(time), side="right") - 1
        return values[np.clip(last, 0, None)]
    return np.interp(time, channel.time, values)


def _left_out(channel: Channel, time: Array | None, rows: int) -> str:
    """The note on a channel that is left out, with the time that it covers."""
    count = f"{len(channel.values)} of {rows} rows"
    if time is None or channel.time is None:
        return f"Channel '{channel.name}' is left out: it has {count}, and no time."
    start, end = (float(instant - time[0]) for instant in (channel.time[0], channel.time[-1]))
    return (
        f"Channel '{channel.name}' is left out: it has {count}, from {start:.4g} s to {end:.4g} s,"
        f" and the measured channels cover 0 s to {float(time[-1] - time[0]):.4g} s. Map it to a"
        " quantity to read the rows that it covers."
    )


def _differ(first: Array | None, second: Array | None) -> bool:
    return first is not None and second is not None and not np.array_equal(first, second)


def _names(channels: Sequence[Channel]) -> str:
    return listed([channel.name for channel in channels], MAX_QUOTED)


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

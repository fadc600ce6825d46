"""Time base of a recording: recorded time stamps, also clock times as text, uniform sampling, or no
time; downsampling.

Loggers round time stamps: at 530 rows per second, stamps of 1 ms repeat. The rows themselves are
then uniform in time.
"""

import abc
import dataclasses
import datetime
import math
import re
from collections.abc import Callable, Iterable, Sequence
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from ....core import Array, ColumnError, Hint, HintedText, ParameterError, check_field_types
from ....recording.recording import RowNote
from .channels import Cells, RawTable

_GERMAN_DATE = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})[ T](.+)")
_TIME_OF_DAY = re.compile(r"(\d{1,3}):([0-5]\d):([0-5]\d(?:\.\d+)?)")


def seconds_from_clock(cells: Sequence[str]) -> Array | None:
    """Time since the first cell [s], shape (N,); None if any cell is not a clock time. For times
    without a date, a decrease by more than half a day is taken as the passing of midnight."""
    texts = [cell.strip().replace(",", ".") for cell in cells]
    times = [_parse_time(text) for text in texts]
    if not times or any(time is None for time in times):
        return None
    instants = np.array(times, dtype=float)
    if all(_TIME_OF_DAY.fullmatch(text) for text in texts):
        instants[1:] += 86_400e6 * np.cumsum(np.diff(instants) < -43_200e6)
    return np.asarray((instants - instants[0]) / 1e6)


EPOCH = (9e8, 4.2e9)
"""Range of times that count from 1970 [s]: from 1998 to 2103 (chosen)."""
_EPOCH_UNITS = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}


def epoch_unit(cells: Cells) -> str | None:
    """The unit of times (N,) that count from 1970, whose sizes differ by a factor of 1000; None for
    other times.
    """
    if isinstance(cells, list) or not len(cells):
        return None
    low, high = (float(value) for value in (np.min(cells), np.max(cells)))
    fits = (
        unit
        for unit, number in _EPOCH_UNITS.items()
        if EPOCH[0] * number <= low and high <= EPOCH[1] * number
    )
    return next(fits, None)


def is_clock(cells: Cells) -> bool:
    """Whether the first cell of a column is a clock time."""
    return isinstance(cells, list) and bool(cells) and seconds_from_clock(cells[:1]) is not None


USUAL_RATES = (0.5, 2e4)
USUAL_DURATIONS = (0.5, 86_400.0)
"""Ranges of the rows per second and of the duration [s] of a record (chosen)."""


@dataclasses.dataclass(frozen=True)
class GuessedUnit:
    """A unit that a file does not state, and the reason for it."""

    unit: str
    reason: str


def guessed_time_unit(cells: Cells) -> GuessedUnit | None:
    """The unit of times (N,) that rise, if one alone gives a usual rate and duration; None where
    several do, or none.
    """
    if isinstance(cells, list) or len(cells) < 3 or not np.all(np.diff(cells) > 0):
        return None
    step = float(np.median(np.diff(cells)))
    span = float(cells[-1] - cells[0])
    possible = []
    for unit, number in _EPOCH_UNITS.items():
        rate = number / step
        usual_rate = USUAL_RATES[0] <= rate <= USUAL_RATES[1]
        if usual_rate and USUAL_DURATIONS[0] <= span / number <= USUAL_DURATIONS[1]:
            possible.append((unit, rate))
    if len(possible) != 1:
        return None
    ((unit, rate),) = possible
    return GuessedUnit(
        unit,
        f"with a guessed unit, because no other gives a usual record than {rate:.4g} rows per"
        " second",
    )


def _parse_time(cell: str) -> float | None:
    """The time in a cell [us], counted from midnight or, with a date, from 1970; None if it is not
    a clock time. Microseconds are exact as floating-point numbers. A time that states its offset
    from UTC is converted to UTC.
    """
    clock = _TIME_OF_DAY.fullmatch(cell)
    if clock:
        return 3600e6 * float(clock[1]) + 60e6 * float(clock[2]) + 1e6 * float(clock[3])
    german = _GERMAN_DATE.fullmatch(cell)
    iso = f"{german[3]}-{int(german[2]):02}-{int(german[1]):02} {german[4]}" if german else cell
    try:
        moment = datetime.datetime.fromisoformat(iso)
    except ValueError:
        return None
    epoch = datetime.datetime(1970, 1, 1, tzinfo=datetime.UTC if moment.tzinfo else None)
    return (moment - epoch) / datetime.timedelta(microseconds=1)


MAX_DEVIATION = 5.0
"""Maximum deviation of a recorded time stamp from uniform sampling, in sample times, beside its
rounding (chosen).
"""


class TimeBase(abc.ABC):
    """Meaning of the time column of a file."""

    ordered: bool = True
    """Whether time must increase."""

    @abc.abstractmethod
    def apply(self, table: RawTable, time: Array) -> tuple[Array | None, str]:
        """The time [s], shape (N,), or None, and a note, from the recorded time (N,). Raises
        ColumnError.
        """


@dataclasses.dataclass(frozen=True)
class RecordedTime(TimeBase):
    """The recorded time stamps; they may repeat or decrease unless they are `ordered`."""

    ordered: bool = True

    def __post_init__(self) -> None:
        check_field_types(self)

    def apply(self, table: RawTable, time: Array) -> tuple[Array | None, str]:
        return time, ""


@dataclasses.dataclass(frozen=True)
class UniformTime(TimeBase):
    """Uniform sampling between the first and the last time stamp, by the number of rows.

    For stamps that the logger rounded. Stamps that decrease, or that deviate from uniform sampling
    by more than their rounding and five sample times, are refused: the file contains several runs,
    or gaps.
    """

    def apply(self, table: RawTable, time: Array) -> tuple[Array | None, str]:
        steps = np.diff(time)
        if time.size < 2 or not time[-1] > time[0]:
            raise ColumnError(
                f"{table.origin}: uniform sampling requires two rows or more, and time that"
                " increases."
            )
        if (steps < 0).any():
            row = int(np.argmax(steps < 0)) + 1
            raise ColumnError(
                f"{table.location(row)}: time decreases, so the rows are not sampled uniformly."
                " Write two runs to two files.",
                hint=WITHOUT_TIME,
            )
        uniform = np.linspace(time[0], time[-1], time.size)
        sample_time = float(uniform[1] - uniform[0])
        allowed = float(steps[steps > 0].min()) + MAX_DEVIATION * sample_time
        deviation = np.abs(time - uniform)
        if deviation.max() > allowed:
            place = (
                f"{table.location(int(np.argmax(deviation)))}: time deviates from uniform sampling"
            )
            limit = f"allowed range: 0 to {allowed:.4g} s. The file has gaps."
            message = f"{place} by {deviation.max():.4g} s; {limit}"
            raise ColumnError(HintedText(message, AS_RECORDED, WITHOUT_TIME))
        return (
            uniform,
            (
                f"Time is uniform by the number of rows, {1 / sample_time:.4g} rows per second; the"
                f" recorded stamps deviate by at most {deviation.max():.2g} s."
            ),
        )


@dataclasses.dataclass(frozen=True)
class NoTime(TimeBase):
    """No time: the time column is not used, and rows are steady states in their order."""

    def apply(self, table: RawTable, time: Array) -> tuple[Array | None, str]:
        return None, "The time column is not used, as specified by the user."


UNIFORM = Hint("For stamps that the logger rounded", "time", UniformTime(), "ColumnMapping")
AS_RECORDED = Hint(
    "To keep the stamps as they are", "time", RecordedTime(ordered=False), "ColumnMapping"
)
MAP_TIME = Hint("To state the column of the time", "columns", {"t": "time [s]"}, "ColumnMapping")
WITHOUT_TIME = Hint("To read without time", "time", NoTime(), "ColumnMapping")
TIME_BASES: dict[str, TimeBase] = {
    "recorded": RecordedTime(),
    "uniform": UniformTime(),
    "unordered": RecordedTime(ordered=False),
    "none": NoTime(),
}
"""Time bases by their names in mapping files and on the command line."""


ALL_ROWS = 2**62
"""Number of rows of a reduction that keeps all: no file has as many."""


@dataclasses.dataclass(frozen=True)
class Downsampling(abc.ABC):
    """Reduction of a longer file to at most `max_rows` rows."""

    rule: ClassVar[str]
    """What becomes of every {} rows, as a phrase for the note."""
    max_rows: int = 2_000_000

    def __post_init__(self) -> None:
        check_field_types(self)
        if self.max_rows < 1:
            raise ParameterError(f"max_rows is {self.max_rows}; it must be at least 1.")

    def step(self, rows: int) -> int:
        """The number of rows that are reduced to one."""
        return max(1, math.ceil(rows / self.max_rows))

    @abc.abstractmethod
    def reduce(self, cells: Cells, step: int) -> Cells:
        """The column with one row for every `step` rows."""

    def note(self, rows: int, step: int) -> str:
        """The note for the user on the reduction of `rows` rows."""
        remaining = math.ceil(rows / step)
        return RowNote(
            f"The file has {rows} rows; {self.rule.format(step)}, {remaining} in total (max_rows)."
        )


class Decimation(Downsampling):
    """Every n-th row as measured: resolution and saturation of the sensors are preserved, noise is
    not averaged.
    """

    rule = "one in {} is kept as measured"

    def reduce(self, cells: Cells, step: int) -> Cells:
        return cells[::step]


class BlockMeans(Downsampling):
    """Means over blocks of n rows: noise is averaged, outliers are smeared, saturation and
    resolution are lost.

    A text, such as a clock time, is that of the middle row of its block.
    """

    rule = "each block of {} is replaced by its mean"

    def reduce(self, cells: Cells, step: int) -> Cells:
        starts = np.arange(0, len(cells), step)
        sizes: npt.NDArray[np.int64] = np.diff(np.append(starts, len(cells)))
        if isinstance(cells, list):
            middles = starts + (sizes - 1) // 2
            return [cells[row] for row in middles.tolist()]
        sums = np.add.reduceat(cells, starts)
        return np.asarray(sums / sizes, dtype=float)


def downsample(table: RawTable, downsampling: Downsampling) -> RawTable:
    """The table with at most `downsampling.max_rows` rows, and a note if it was reduced."""
    step = downsampling.step(len(table.rows))
    if step == 1:
        return table
    columns = tuple(downsampling.reduce(cells, step) for cells in table.columns)
    reduced = dataclasses.replace(table, columns=columns, rows=table.rows[::step])
    return reduced.noted(downsampling.note(len(table.rows), step))


PIECE_ROWS = 500_000
"""Number of rows that are read at once (chosen): 4 MB of a column of numbers."""


@dataclasses.dataclass(frozen=True)
class Reduction:
    """The reduction of a table while it is read: `rows` rows of the file, of which `step` are
    reduced to one.
    """

    downsampling: Downsampling
    rows: int = 0

    @property
    def step(self) -> int:
        """The number of rows that are reduced to one."""
        return self.downsampling.step(self.rows)

    @property
    def note(self) -> str:
        """The note for the user; empty if nothing is reduced."""
        return self.downsampling.note(self.rows, self.step) if self.step > 1 else ""

    def read(self, get: Callable[[int, int], Any], rows: int) -> Any:
        """The reduced rows of a column, or of the first axis of a matrix. `get(first, end)` returns
        the rows from `first` up to `end`; at most `PIECE_ROWS` are requested at once."""
        if self.step == 1:
            return get(0, rows)
        size = max(PIECE_ROWS // self.step, 1) * self.step
        parts = []
        for first in range(0, rows, size):
            piece = np.asarray(get(first, min(first + size, rows)))
            columns = [
                self.downsampling.reduce(column, self.step) for column in np.atleast_2d(piece.T)
            ]
            parts.append(np.array(columns[0]) if piece.ndim == 1 else np.column_stack(columns))
        return np.concatenate(parts)

    def noted(self, table: RawTable) -> RawTable:
        """The table of reduced columns with its row numbers in the file and a note on the
        reduction.
        """
        if self.step == 1:
            return table
        return dataclasses.replace(table, rows=1 + self.step * np.arange(len(table.rows))).noted(
            self.note
        )


def check_reduced_lengths(origin: str, full: Iterable[int], reduced: Iterable[int]) -> None:
    """Raise ColumnError where columns of different lengths have the same length after the
    reduction.
    """
    sizes = sorted(set(full))
    if len(sizes) != len(set(reduced)):
        raise ColumnError(
            f"{origin}: the columns have different lengths ({', '.join(map(str, sizes))} rows),"
            " which the reduction of the rows would hide. Store the columns of one length in a"
            " group of their own."
        )

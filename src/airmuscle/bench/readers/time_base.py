"""Time base of a recording: recorded time stamps, also clock times as text, uniform sampling, or no time.

Loggers round time stamps: at 530 rows per second, stamps of 1 ms repeat. The rows themselves are then uniform in time.
"""

import abc
import dataclasses
import datetime
import re
from collections.abc import Sequence

import numpy as np

from ...core import Array, ColumnError, Hint, HintedText, check_field_types
from .channels import RawTable

_GERMAN_DATE = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})[ T](.+)")
_TIME_OF_DAY = re.compile(r"(\d{1,3}):([0-5]\d):([0-5]\d(?:\.\d+)?)")


def seconds_from_clock(cells: Sequence[str]) -> Array | None:
    """Time since the first cell [s], shape (N,); None if any cell is not a clock time.

    For times without a date, a decrease by more than half a day is taken as the passing of midnight.
    """
    texts = [cell.strip().replace(",", ".") for cell in cells]
    times = [_parse_time(text) for text in texts]
    if not times or any(time is None for time in times):
        return None
    instants = np.array(times, dtype=float)
    if all(_TIME_OF_DAY.fullmatch(text) for text in texts):
        instants[1:] += 86_400e6 * np.cumsum(np.diff(instants) < -43_200e6)
    return np.asarray((instants - instants[0]) / 1e6)


def _parse_time(cell: str) -> float | None:
    """The time in a cell [us], counted from midnight or, with a date, from 1970; None if it is not a clock time.

    Microseconds since 1970 are exact as floating-point numbers, seconds with a fraction are not.
    A time that states its offset from UTC is converted to UTC, so that the change to summer time is no gap.
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
"""Maximum deviation of a recorded time stamp from uniform sampling, in sample times, beside its rounding (chosen)."""


class TimeBase(abc.ABC):
    """Meaning of the time column of a file."""

    ordered: bool = True
    """Whether time must increase."""

    @abc.abstractmethod
    def apply(self, table: RawTable, time: Array) -> tuple[Array | None, str]:
        """The time [s], shape (N,), or None without any, and a note, from the recorded time (N,). Raises
        ColumnError."""


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

    For stamps that the logger rounded. Stamps that decrease, or that deviate from uniform sampling by more than their
    rounding and five sample times, are refused: the file contains several runs, or gaps.
    """

    def apply(self, table: RawTable, time: Array) -> tuple[Array | None, str]:
        steps = np.diff(time)
        if time.size < 2 or not time[-1] > time[0]:
            raise ColumnError(f"{table.origin}: uniform sampling requires two rows or more, and time that increases.")
        if (steps < 0).any():
            row = int(np.argmax(steps < 0)) + 1
            raise ColumnError(
                f"{table.location(row)}: time decreases, so the rows are not sampled uniformly. Write two runs "
                "to two files.",
                hint=WITHOUT_TIME,
            )
        uniform = np.linspace(time[0], time[-1], time.size)
        sample_time = float(uniform[1] - uniform[0])
        allowed = float(steps[steps > 0].min()) + MAX_DEVIATION * sample_time
        deviation = np.abs(time - uniform)
        if deviation.max() > allowed:
            row = int(np.argmax(deviation))
            message = (
                f"{table.location(row)}: time deviates from uniform sampling by {deviation.max():.4g} s; allowed "
                f"range: 0 to {allowed:.4g} s. The file has gaps."
            )
            raise ColumnError(HintedText(message, AS_RECORDED, WITHOUT_TIME))
        note = (
            f"Time is uniform by the number of rows, {1 / sample_time:.4g} rows per second; the recorded stamps "
            f"deviate by at most {deviation.max():.2g} s."
        )
        return uniform, note


@dataclasses.dataclass(frozen=True)
class NoTime(TimeBase):
    """No time: the time column is not used, and rows are steady states in their order."""

    def apply(self, table: RawTable, time: Array) -> tuple[Array | None, str]:
        return None, "The time column is not used, as specified by the user."


UNIFORM = Hint("For stamps that the logger rounded", "time", UniformTime(), "ColumnMapping")
AS_RECORDED = Hint("To keep the stamps as they are", "time", RecordedTime(ordered=False), "ColumnMapping")
WITHOUT_TIME = Hint("To read without time", "time", NoTime(), "ColumnMapping")
TIME_BASES: dict[str, TimeBase] = {
    "recorded": RecordedTime(), "uniform": UniformTime(), "unordered": RecordedTime(ordered=False), "none": NoTime(),
}  # fmt: skip
"""Time bases by their names in mapping files and on the command line."""

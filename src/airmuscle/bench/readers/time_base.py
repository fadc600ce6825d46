"""Time base of a recording: the recorded time stamps, uniform sampling by the number of rows, or no time.

Loggers round time stamps: at 530 rows per second, stamps of 1 ms repeat. The rows themselves are then uniform in time.
"""

from __future__ import annotations

import abc
import dataclasses

import numpy as np

from ...core.annotation import check_field_types
from ...core.arrays import Array
from ...core.errors import ColumnError, Hint, HintedText
from .table import RawTable

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

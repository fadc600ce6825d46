"""Clock times as text: `2024-05-17 12:00:03.25`, `17.05.2024 12:00:03`, `12:00:03,25`."""

from __future__ import annotations

import datetime
import re
from collections.abc import Sequence

import numpy as np

from ...core.arrays import Array

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

"""Time written as a clock shows it: `2024-05-17 12:00:03.25`, `17.05.2024 12:00:03`, `12:00:03,25`."""

from __future__ import annotations

import datetime
import re
from collections.abc import Sequence

import numpy as np

from ..core.arrays import Array

_GERMAN_DATE = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})[ T](.+)")
_TIME_OF_DAY = re.compile(r"(\d{1,3}):(\d{2}):(\d{2}(?:\.\d+)?)")


def seconds_from_clock(cells: Sequence[str]) -> Array | None:
    """Seconds from the first instant, or None where some cell is no time of a clock.

    Times without a date may pass midnight once: a step back by more than half a day is the next day.
    """
    instants = [_parse_time(cell.replace(",", ".")) for cell in cells]
    if not instants or any(instant is None for instant in instants):
        return None
    seconds = np.array(instants, dtype=float)
    seconds[1:] += 86_400.0 * np.cumsum(np.diff(seconds) < -43_200.0)
    return np.asarray(seconds - seconds[0])


def _parse_time(cell: str) -> float | None:
    clock = _TIME_OF_DAY.fullmatch(cell.strip())
    if clock:
        return 3600.0 * float(clock[1]) + 60.0 * float(clock[2]) + float(clock[3])
    german = _GERMAN_DATE.fullmatch(cell.strip())
    iso = f"{german[3]}-{int(german[2]):02}-{int(german[1]):02} {german[4]}" if german else cell.strip()
    try:
        moment = datetime.datetime.fromisoformat(iso)
    except ValueError:
        return None
    whole = datetime.datetime(1970, 1, 1, tzinfo=moment.tzinfo)
    return (moment - whole).total_seconds()

"""Check for codes of missing values: -999, 9999 or -1e30 among the readings of a column."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...core.arrays import Array
from ...core.errors import Hint, HintedText, UnitError
from ...core.units import STANDARD_GRAVITY, conversion
from ...recording.columns import quantity_of
from ...recording.recording import Recording
from ..readers.missing_values import DropMissing
from .bench_rows import file_list

CODES = (99.0, 999.0, 999.9, 9999.0, 9999.9, 99999.0, 999999.0, 32767.0, 32768.0, 1e30, 1e31, 1e36, 1e37, 1e38)
"""Magnitudes that loggers write for a missing value (chosen: the usual ones)."""
MIN_CODE = 500.0
"""Minimum magnitude of a code that is recognised in another power of ten of the unit (chosen)."""
MIN_DISTANCE = 0.2
"""Minimum distance of a code from all other readings, as a fraction of their range (chosen)."""
MAX_SHARE = 0.5
"""Maximum share of the rows that are missing (chosen)."""


class MissingCode(NamedTuple):
    """A code in a column: its value in the unit of the file, and the mask of its rows."""

    value: float
    rows: Array


def is_missing_code(value: float) -> bool:
    """Whether a number is one that loggers write for a missing value."""
    return any(abs(abs(value) - code) <= 1e-6 * code for code in CODES)


def code_of(value: float) -> float | None:
    """The code for a missing value that a number [SI] is, in some power of ten of its unit; None if it is none."""
    if value == 0.0 or not math.isfinite(value):
        return None
    ratios = ((code, abs(value) / code) for code in CODES if code > MIN_CODE)
    exact = (code for code, ratio in ratios if abs(math.log10(ratio) - round(math.log10(ratio))) < 1e-7)
    return math.copysign(code, value) if (code := next(exact, None)) is not None else None


def check_missing_codes(recordings: Sequence[Recording]) -> Iterator[HintedText]:
    """A column whose extreme reading is a code for a missing value, far from all other readings."""
    found: dict[tuple[str, float], list[tuple[str, int]]] = {}
    for each in recordings:
        for name in each.columns:
            code = find_missing_code(each, name)
            if code is not None:
                found.setdefault((name, code.value), []).append((each.origin, int(np.count_nonzero(code.rows))))
    for (name, value), places in found.items():
        rows = sum(count for _, count in places)
        count = f"{rows} row{'' if rows == 1 else 's'}"
        yield HintedText(
            f"{file_list([origin for origin, _ in places])}: the {name} is {value:g} in {count}, far from all "
            "other readings: this is a code for a missing value, which is read as a number.",
            Hint("To leave these rows out", "missing", DropMissing((value,)), "ColumnMapping"),
        )


def without_missing_codes(recordings: Sequence[Recording]) -> list[Recording]:
    """The recordings without the rows in which a value is missing."""
    kept = []
    for each in recordings:
        codes = [code.rows for name in each.columns if (code := find_missing_code(each, name)) is not None]
        kept.append(each.rows(~np.any(codes, axis=0)) if codes else each)
    return kept


def find_missing_code(recording: Recording, name: str) -> MissingCode | None:
    """The code for a missing value in a known column; None without one."""
    values = recording.columns[name]
    if quantity_of(name) is None or name.rpartition(".")[2] == "time" or values.size < 3:
        return None
    for extreme in (float(np.min(values)), float(np.max(values))):
        written = _as_written(recording, name, extreme)
        rows = values == extreme
        if not is_missing_code(written) or np.mean(rows) > MAX_SHARE:
            continue
        others = values[~rows]
        distance = float(np.min(np.abs(others - extreme)))
        if distance > MIN_DISTANCE * float(np.ptp(others)) and distance > 0:
            return MissingCode(written, rows)
    return None


def _as_written(recording: Recording, name: str, value: float) -> float:
    """A value [SI] in the unit of the file."""
    unit, quantity = recording.units.get(name), quantity_of(name)
    if unit is None or quantity is None:
        return value
    try:
        change = conversion(unit, quantity.unit)
    except UnitError:
        return value / (conversion(unit, "kg").factor * STANDARD_GRAVITY)  # a load stated as a mass
    return float((value - change.offset) / change.factor)

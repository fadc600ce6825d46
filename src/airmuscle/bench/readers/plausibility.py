"""Plausibility checks of a recording: pressures below vacuum, time that does not increase, percent read as a ratio."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...core.arrays import Array
from ...core.errors import ColumnError, Hint, HintedText
from ..checks.missing_codes import code_of
from .missing_values import DropMissing
from .table import RawTable
from .time_base import AS_RECORDED, UNIFORM, WITHOUT_TIME

CONTRACTION_RANGE = (-0.5, 1.0)
"""Plausible contractions (chosen): a contraction of 1 is impossible, as is a stretch by half of the length."""

CODE_PURPOSE = "If {:g} is a code for a missing value"

MAX_MAGNITUDE = 1e15
"""Maximum magnitude of a measured value in SI units (chosen: no measurement, but its powers do not overflow)."""


def check_plausible(
    table: RawTable,
    columns: Mapping[str, Array],
    resting_length: float | None,
    ambient: float,
    *,
    ordered: bool = True,
) -> None:
    """Raise ColumnError, with row and value, at the first value that cannot be a measurement."""
    for name, values in columns.items():
        _check_magnitude(table, name, values)
        quantity = name.rpartition(".")[2]
        if quantity == "time" and ordered:
            _check_ordered(table, values)
        elif quantity == "pressure":
            _check_above_vacuum(table, values, ambient)
        elif quantity == "contraction":
            remedy = "For values in percent, rename the column header to 'contraction [%]'."
            _check_contraction(table, values, "contraction", remedy)
        elif quantity == "length":
            _check_length(table, values, resting_length)


def _check_magnitude(table: RawTable, name: str, values: Array) -> None:
    excessive = np.abs(values) > MAX_MAGNITUDE
    if excessive.any():
        row = int(np.argmax(excessive))
        raise ColumnError(
            f"{table.location(row)}: {name} is {values[row]:.4g} in SI units; no measurement exceeds "
            f"{MAX_MAGNITUDE:g}. Correct the value, or delete the row.",
            hint=_code_hint(values[row]),
        )


def _check_ordered(table: RawTable, time: Array) -> None:
    not_increasing = np.diff(time) <= 0
    if not_increasing.any():
        row = int(np.argmax(not_increasing)) + 1
        hints = (WITHOUT_TIME,) if (np.diff(time) < 0).any() else (UNIFORM, AS_RECORDED, WITHOUT_TIME)
        relation = "repeats the time" if time[row] == time[row - 1] else "is less than the time"
        message = (
            f"{table.location(row)}: time {time[row]:.9g} s {relation} of the previous row ({time[row - 1]:.9g} s). "
            f"Time must increase: sort the rows, delete the repeated one, or write two runs to two files."
        )
        raise ColumnError(HintedText(message, *hints))


def _check_above_vacuum(table: RawTable, pressure: Array, ambient: float) -> None:
    below = ~(pressure + ambient > 0)
    if below.any():
        row = int(np.argmax(below))
        raise ColumnError(
            f"{table.location(row)}: a gauge pressure of {pressure[row] / 1e3:.4g} kPa is not above absolute vacuum "
            f"({-ambient / 1e3:.4g} kPa gauge). Check the unit, and whether the pressure is gauge or absolute.",
            hint=_code_hint(pressure[row]),
        )


def _code_hint(value: float) -> Hint | None:
    """The remedy where an impossible value is a code for a missing value."""
    code = code_of(float(value))
    return None if code is None else Hint(CODE_PURPOSE.format(code), "missing", DropMissing((code,)), "ColumnMapping")


def _check_contraction(table: RawTable, contraction: Array, label: str, remedy: str) -> None:
    low, high = CONTRACTION_RANGE
    outside = ~((contraction > low) & (contraction < high))
    if outside.any():
        row = int(np.argmax(outside))
        raise ColumnError(
            f"{table.location(row)}: {label} {contraction[row]:.4g} is outside the plausible range {low:g} to "
            f"{high:g}. {remedy}"
        )


def _check_length(table: RawTable, length: Array, resting_length: float | None) -> None:
    if not (length > 0).all():
        row = int(np.argmin(length > 0))
        raise ColumnError(
            f"{table.location(row)}: length is {length[row]:.4g} m; it must be positive.", hint=_code_hint(length[row])
        )
    if resting_length is not None:
        _check_contraction(
            table,
            (resting_length - length) / resting_length,
            f"with a resting length of {resting_length:.4g} m, the contraction",
            "Check the units of the length and of the resting length.",
        )

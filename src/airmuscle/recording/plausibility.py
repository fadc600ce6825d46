"""What cannot have been measured: pressures below vacuum, time that runs backwards, per cent read as a ratio."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..core.arrays import Array
from ..core.errors import ColumnError
from .table import RawTable

CONTRACTION_RANGE = (-0.5, 1.0)
"""Contractions that are believed (chosen): none reaches 1, and no muscle is stretched by half its length."""


def check_plausible(
    table: RawTable,
    columns: Mapping[str, Array],
    resting_length: float | None,
    ambient: float,
    *,
    ordered: bool = True,
) -> None:
    """Raise ColumnError, with the row and the value, for the first value that no bench can have measured."""
    for name, values in columns.items():
        quantity = name.rpartition(".")[2]
        if quantity == "time" and ordered:
            _check_ordered(table, values)
        elif quantity == "pressure":
            _check_above_vacuum(table, values, ambient)
        elif quantity == "contraction":
            _check_contraction(table, values, "contraction", "Is it in per cent? Then head it 'contraction [%]'.")
        elif quantity == "length":
            _check_length(table, values, resting_length)


def _check_ordered(table: RawTable, time: Array) -> None:
    late = np.diff(time) <= 0
    if late.any():
        row = int(np.argmax(late)) + 1
        said = "repeats the time of" if time[row] == time[row - 1] else "goes back behind"
        raise ColumnError(
            f"{table.location(row)}: time {time[row]:.9g} s {said} the row before ({time[row - 1]:.9g} s). Time must "
            "increase: sort the rows, delete the repeated one, or put two runs into two files."
        )


def _check_above_vacuum(table: RawTable, pressure: Array, ambient: float) -> None:
    below = ~(pressure + ambient > 0)
    if below.any():
        row = int(np.argmax(below))
        raise ColumnError(
            f"{table.location(row)}: a gauge pressure of {pressure[row] / 1e3:.6g} kPa lies at or below absolute zero "
            f"({-ambient / 1e3:.6g} kPa gauge). Is it in another unit, or gauge under an absolute unit?"
        )


def _check_contraction(table: RawTable, contraction: Array, what: str, remedy: str) -> None:
    low, high = CONTRACTION_RANGE
    outside = ~((contraction > low) & (contraction < high))
    if outside.any():
        row = int(np.argmax(outside))
        raise ColumnError(
            f"{table.location(row)}: {what} {contraction[row]:.6g} lies outside {low:g} to {high:g}. {remedy}"
        )


def _check_length(table: RawTable, length: Array, resting_length: float | None) -> None:
    if not (length > 0).all():
        row = int(np.argmin(length > 0))
        raise ColumnError(f"{table.location(row)}: length {length[row]:.6g} m; it must be greater than zero.")
    if resting_length is not None:
        _check_contraction(
            table,
            (resting_length - length) / resting_length,
            f"with a resting length of {resting_length:.6g} m the length makes a contraction that is implausible:",
            "Is the unit of the length or of the resting length another one?",
        )

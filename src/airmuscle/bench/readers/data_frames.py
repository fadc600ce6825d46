"""Conversion between recordings and the types of pandas and xarray."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core.errors import AirmuscleError, ParameterError
from ...recording.heading import split_unit
from ...recording.recording import Recording, column_heading
from .channels import to_cells
from .interpret import interpret
from .mapping import ColumnMapping, apply_mapping
from .table import Cells, RawTable


def from_pandas(frame: Any, mapping: ColumnMapping = ColumnMapping(), *, origin: str = "data frame") -> Recording:
    """A recording of a pandas.DataFrame, by the rules for files: `pressure [bar]` is converted to SI units.

    An index with a name, or each named level, becomes a column, such as `time [s]`. Dates are counted in seconds from
    the first. Raises ParameterError for another type, ColumnError or UnitError as `read`.
    """
    if not hasattr(frame, "columns") or not hasattr(frame, "index") or not hasattr(frame, "reset_index"):
        raise ParameterError(f"from_pandas: {type(frame).__name__} is not a pandas.DataFrame.")
    if any(name is not None for name in frame.index.names):
        frame = frame.reset_index()
    if not len(frame.columns) or not len(frame):
        raise ParameterError(f"from_pandas: {origin} has no columns or no rows.")
    series = [frame.iloc[:, i] for i in range(len(frame.columns))]
    dates = [each.dtype.kind in "Mm" for each in series]
    headings = tuple(
        split_unit(str(name))[0] if dated else str(name) for name, dated in zip(frame.columns, dates, strict=True)
    )  # dates become seconds whatever unit the heading states
    row = tuple("s" if each else "" for each in dates) if any(dates) else None
    columns = tuple(map(_cells, series))
    table = RawTable(origin, headings, row, columns, np.arange(len(frame)), "row", {}, _notes_on_dates(series))
    return interpret(apply_mapping(table, mapping), mapping)


def _notes_on_dates(columns: Sequence[Any]) -> tuple[str, ...]:
    dates = [each for each in columns if each.dtype.kind == "M"]
    return tuple(
        f"Column '{each.name}' contains dates; time is counted from the first, {each.iloc[0]}." for each in dates
    )


def _cells(series: Any) -> Cells:
    """Numbers where the column has a numeric type or contains dates or durations, otherwise texts."""
    if series.dtype.kind in "Mm":
        return to_cells(series.to_numpy(dtype=f"{'datetime' if series.dtype.kind == 'M' else 'timedelta'}64[ns]"))
    if series.dtype.kind in "biuf":
        return np.asarray(series.to_numpy(), dtype=float)
    return [str(value) for value in series]


def to_xarray(recording: Recording) -> Any:
    """An xarray.Dataset over `time`, or over the row number without time; units, origin and constants are attributes.

    Raises AirmuscleError without the package xarray.
    """
    try:
        import xarray
    except ImportError:
        raise AirmuscleError("to_xarray needs the package xarray; pip install xarray, or use to_pandas().") from None
    timed = "time" in recording.columns
    along = "time" if timed else "row"
    data = {name: (along, recording[name], _unit(name)) for name in recording if name != "time"}
    rows = ("time", recording["time"], {"units": "s"}) if timed else ("row", np.arange(len(recording)))
    attributes = {"origin": recording.origin, **recording.constants}
    return xarray.Dataset(data, coords={along: rows}, attrs=attributes)


def _unit(name: str) -> dict[str, str]:
    unit = split_unit(column_heading(name))[1]
    return {"units": unit} if unit else {}

"""Conversion between recordings and the types of pandas and xarray."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..core.errors import AirmuscleError, ParameterError
from .heading import split_unit
from .interpret import interpret
from .recording import Recording, column_heading
from .table import Cells, RawTable


def from_pandas(
    frame: Any, *, origin: str = "data frame", units: Mapping[str, str] | None = None,
    constants: Mapping[str, float | str] | None = None,
) -> Recording:  # fmt: skip
    """A recording of a pandas.DataFrame, by the rules for files: `pressure [bar]` is converted to SI units.

    units      units of columns whose headings state none, {"pressure": "bar"}
    constants  constants of the run, such as resting_length

    An index with a name becomes a column, such as `time [s]`. Raises ParameterError for another type, ColumnError or
    UnitError as `read`.
    """
    if not hasattr(frame, "columns") or not hasattr(frame, "index") or not hasattr(frame, "reset_index"):
        raise ParameterError(f"from_pandas: {type(frame).__name__} is not a pandas.DataFrame.")
    if frame.index.name is not None:
        frame = frame.reset_index()
    headings = tuple(str(name) for name in frame.columns)
    if not headings or not len(frame):
        raise ParameterError(f"from_pandas: {origin} has no columns or no rows.")
    columns = tuple(_cells(frame.iloc[:, i]) for i in range(len(headings)))
    table = RawTable(origin, headings, None, columns, np.arange(len(frame)), "row", {})
    return interpret(table, units=units or {}, constants=constants or {})


def _cells(series: Any) -> Cells:
    """Numbers where the column has a numeric type, otherwise texts."""
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

"""Display of a recording in a notebook: chart of its first panels, and ranges of its columns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..core.arrays import Array
from .display_units import display_scale
from .notebook import Card
from .plot import plot_columns

MAX_PANELS = 4
"""Maximum number of panels of the chart."""
ROUNDING = 1e-12
"""Values below this fraction of the largest one of a column are shown as 0 (chosen)."""
MAX_POINTS = 20_000
"""Maximum number of rows of the chart; of more, every n-th row is drawn."""


def recording_card(recording: Any, units: Mapping[str, str]) -> Card:
    """The display of a Recording; `units` are SI units of columns that are no known quantity."""
    rows: list[tuple[str, ...]] = [("column", "unit", "first", "minimum", "maximum", "last")]
    rows += [_row(name, values, units) for name, values in recording.columns.items()]
    title = f"{recording.origin}: {len(recording)} rows of {len(recording.columns)} columns"
    return Card(title, rows, (lambda: _draw(recording, units)) if len(recording) else None, recording.notes)


def _row(name: str, values: Array, units: Mapping[str, str]) -> tuple[str, ...]:
    factor, unit = display_scale(name)
    finite = values[np.isfinite(values)] * factor
    finite[np.abs(finite) < ROUNDING * np.max(np.abs(finite), initial=0.0)] = 0.0
    shown = (finite[0], finite.min(), finite.max(), finite[-1]) if finite.size else ()
    return (name, unit or units.get(name, ""), *(f"{value:.4g}" for value in shown))


def _draw(recording: Any, units: Mapping[str, str]) -> Any:
    every = slice(None, None, max(1, -(-len(recording) // MAX_POINTS)))
    columns = {name: values[every] for name, values in recording.columns.items() if name != "time"}
    time = recording.columns["time"][every] if "time" in recording.columns else None
    return plot_columns(columns, time, recording.origin, units=units, limit=MAX_PANELS)

"""Display of library entries in a notebook: title, provenance, chart, parameters and references."""

from __future__ import annotations

import abc
from typing import Any

import numpy as np

from ...core.annotation import check_field_types, one_line
from ...core.errors import ParameterError, suggestion
from ...core.plotting import LINES, new_figure, relabel_in_display_units
from ...core.reference import cite
from ...physics.muscle.display import PARAMETERS, parameter_rows, plot_isobars
from ...recording.notebook import Card, NotebookDisplay

PARTS = ("characteristic", "geometry", "spring", "damper", "friction", "wall", "series", "stop", "creep", "valve",
         "exhaust", "switching_times")  # fmt: skip
"""Components of an entry whose parameters are shown."""
PROVENANCES = (
    "printed", "corrected", "converted", "measured", "data sheet", "secondary source", "fitted", "chosen", "example",
)  # fmt: skip
"""Words for the origin of the numbers of an entry."""
FLOW_SUPPLY = 7e5
"""Absolute pressure [Pa] upstream of a valve in its chart (chosen)."""


class EntryDisplay(NotebookDisplay, abc.ABC):
    """Base of the library entries: the check of their fields, and their display."""

    def __post_init__(self) -> None:
        check_field_types(self)
        for word in map(str.strip, getattr(self, "provenance", "").split(",")):
            if word not in PROVENANCES:
                raise ParameterError(
                    f"provenance is '{one_line(word)}'; allowed are {', '.join(PROVENANCES)}, several between commas."
                    f"{suggestion(word, PROVENANCES)}"
                )

    def _card(self) -> Card:
        entry: Any = self
        parts = {name: getattr(entry, name) for name in PARTS if getattr(entry, name, None) is not None}
        if parts.get("geometry") is not None and parts["geometry"] == getattr(
            parts.get("characteristic"), "geometry", None
        ):
            del parts["geometry"]  # its parameters are those of the law
        notes = [f"provenance: {entry.provenance}", *(text for text in (entry.note, entry.warning) if text)]
        notes += [str(reference) for reference in cite(entry)]
        table = [PARAMETERS, *parameter_rows(parts)] if parts else self._table()
        return Card(f"{entry.name}: {entry.title}", table, self._chart(), notes)

    def _table(self) -> list[tuple[str, ...]]:
        """The table of an entry without parameters of components."""
        return []

    def _chart(self) -> Any:
        """Function that draws the chart, or None: the isobars of a law, the flow of a valve."""
        entry: Any = self
        if hasattr(entry, "characteristic"):
            return lambda: plot_isobars(entry.characteristic, type(entry.characteristic).__name__, entry.validity_range)
        return (lambda: _plot_flow(entry)) if hasattr(entry, "valve") else None


def _plot_flow(entry: Any) -> Any:
    """Volume flow of an open valve over the downstream pressure, from 7 bar absolute."""
    figure, axes = new_figure(height=2.6)
    downstream = np.linspace(0.0, 1.0, 81)[1:] * FLOW_SUPPLY
    flow = [6e4 * entry.flow(FLOW_SUPPLY, float(p)) for p in downstream]
    axes.plot(downstream / 1e3, flow, color=LINES[0])
    axes.set(xlabel="absolute pressure downstream [kPa(a)]", ylabel="flow [l/min (ANR)]", ylim=(0.0, None))
    axes.set_title(f"fully open, {FLOW_SUPPLY / 1e3:g} kPa absolute upstream", fontsize=9)
    relabel_in_display_units([axes])
    return figure

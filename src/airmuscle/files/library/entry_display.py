"""Description of library entries: provenance, components, parameters, checks, chart and
references.
"""

import abc
import dataclasses
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from ...bench.reported import Reported
from ...core import ParameterError, check_field_types, cite, leaves, one_line, suggestion
from ...core.plotting import LINES, new_figure, relabel_in_display_units
from ...physics.muscle import Ratings
from ...physics.muscle.isobars import plot_isobars
from ...report.chapter import BY_ROW, Chapter, NamedValue, Plot, Table, TableColumn
from ...report.shown import leaf_table

PROVENANCES = (
    "printed",
    "corrected",
    "converted",
    "measured",
    "data sheet",
    "secondary source",
    "fitted",
    "chosen",
    "example",
)
"""Words for the origin of the numbers of an entry."""
PARTS = (
    "characteristic",
    "geometry",
    "spring",
    "damper",
    "friction",
    "wall",
    "series",
    "stop",
    "creep",
    "ratings",
    "validity_range",
    "valve",
    "exhaust",
    "switching_times",
    "plant",
)
"""Components of an entry, in the order in which they are described."""
CHECK_UNITS = {
    "pressure": "Pa",
    "contraction": "1",
    "force": "N",
    "upstream": "Pa",
    "downstream": "Pa",
}
"""Conditions of a check with their unit; the last two are absolute pressures."""
SHOWN_UNITS = {"Pa": "kPa", "1": "%", "m3": "cm3", "m3/s": "l/min"}
"""Units in which published values and the conditions of a check are shown."""
FLOW_SUPPLY = 7e5
"""Absolute pressure [Pa] upstream of a valve in its chart (chosen)."""


@dataclasses.dataclass(frozen=True, repr=False)
class EntryDisplay(Reported, abc.ABC):
    """Base of the library entries: what all of them state, the check of their fields, and their
    description.

    `provenance` is the origin of the numbers, words of PROVENANCES between commas, `note` what was
    published and how it was converted, `warning` a restriction of use, which is issued when the
    entry is loaded.
    """

    name: str = dataclasses.field(metadata={"key": ""})
    title: str
    provenance: str
    _: dataclasses.KW_ONLY
    note: str = ""
    warning: str = ""

    def __post_init__(self) -> None:
        check_field_types(self)
        for word in map(str.strip, self.provenance.split(",")):
            if word not in PROVENANCES:
                raise ParameterError(
                    f"provenance is '{one_line(word)}'; allowed are {', '.join(PROVENANCES)},"
                    f" several between commas.{suggestion(word, PROVENANCES)}"
                )

    def chapter(self) -> Chapter:
        """The description of the entry."""
        parts = {name: part for name in PARTS if (part := getattr(self, name, None)) is not None}
        law_geometry = getattr(parts.get("characteristic"), "geometry", None)
        rows = [
            (f"{name}.{leaf.path}", leaf)
            for name, model in parts.items()
            if name != "geometry" or model != law_geometry  # its parameters are those of the law
            for leaf in leaves(model)
            if not isinstance(model, Ratings) or leaf.declared.name in model.stated
        ]
        models = {name: type(model).__name__ for name, model in parts.items()}
        tables = [
            Table(
                "components",
                "Components",
                {"component": list(models), "model": list(models.values())},
                shown=False,
            ),
            leaf_table(rows, "parameters", "Parameters", bounds=True, brief=True),
            *self._tables(),
        ]
        chart = self._chart()
        return Chapter(
            name="entry",
            title=f"{self.name}: {self.title}",
            summary=(
                f"Provenance: {self.provenance}. Components:"
                f" {', '.join(map(' '.join, models.items()))}."
            ),
            values=tuple(
                NamedValue(name, getattr(self, name), brief=False)
                for name in ("name", "provenance")
            ),
            tables=tuple(table for table in tables if len(table)),
            plots=() if chart is None else (Plot("entry", self.title, chart),),
            problems=(self.warning,) if self.warning else (),
            notes=tuple(filter(None, (self.note, *self._remarks()))),
            references=tuple(cite(self)),
        )

    def _tables(self) -> Iterator[Table]:
        """Checks, and the sources of single numbers."""
        checks = getattr(self, "checks", ())
        sources = dict(getattr(self, "sources", ()))
        at = {name: [dict(check.conditions).get(name) for check in checks] for name in CHECK_UNITS}
        units = [check.units_of_table({"quantity": check.quantity})["equals"] for check in checks]
        columns: dict[str, Any] = {
            "checked quantity": TableColumn([check.quantity for check in checks], short="check"),
            **{
                f"at {name}": TableColumn(at[name], unit, SHOWN_UNITS.get(unit, unit))
                for name, unit in CHECK_UNITS.items()
                if any(value is not None for value in at[name])
            },
            "published value": TableColumn(
                [check.equals for check in checks], BY_ROW, short="published"
            ),
            "tolerance": TableColumn([check.tolerance for check in checks], BY_ROW),
            "unit": TableColumn(units, shown=[SHOWN_UNITS.get(unit, unit) for unit in units]),
            "source": [check.source for check in checks],
        }
        yield Table("checks", "Checks", columns, brief=len(checks))
        columns = {"numbers": list(sources), "source": list(sources.values())}
        yield Table("sources", "Sources", columns, brief=len(sources))

    def _remarks(self) -> Iterator[str]:
        """Remarks besides the note of the entry."""
        return iter(())

    def _chart(self) -> Any:
        """Function that draws the chart, or None: the isobars of a law, the flow of a valve."""
        entry: Any = self
        if hasattr(entry, "characteristic"):
            name = type(entry.characteristic).__name__
            return partial(plot_isobars, entry.characteristic, name, entry.validity_range)
        return partial(_plot_flow, entry) if hasattr(entry, "valve") else None


def _plot_flow(entry: Any) -> Any:
    """Volume flow of an open valve over the downstream pressure, from 7 bar absolute."""
    figure, axes = new_figure(height=2.6)
    downstream = np.linspace(0.0, 1.0, 81)[1:] * FLOW_SUPPLY
    flow = [6e4 * entry.flow(FLOW_SUPPLY, float(p)) for p in downstream]
    axes.plot(downstream / 1e3, flow, color=LINES[0])
    axes.set(
        xlabel="absolute pressure downstream [kPa(a)]",
        ylabel="flow [l/min (ANR)]",
        ylim=(0.0, None),
    )
    axes.set_title(f"fully open, {FLOW_SUPPLY / 1e3:g} kPa absolute upstream", fontsize=9)
    relabel_in_display_units([axes])
    return figure

"""Description of a library entry: provenance, components, parameters, checks, chart and
references.
"""

from collections.abc import Iterator
from typing import Any

from ...core import cite, leaves
from ...physics.muscle import Ratings
from ...report.chapter import BY_ROW, Chapter, NamedValue, Plot, Table, TableColumn
from ...report.parameter_tables import leaf_table
from .check import CHECK_UNITS
from .entry_display import PARTS, EntryDisplay

SHOWN_UNITS = {"Pa": "kPa", "1": "%", "m3": "cm3", "m3/s": "l/min"}
"""Units in which published values and the conditions of a check are shown."""


def entry_chapter(entry: EntryDisplay) -> Chapter:
    """The description of the entry."""
    parts = {name: part for name in PARTS if (part := getattr(entry, name, None)) is not None}
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
        *_check_tables(entry),
        *entry.tables(),
    ]
    chart = entry.chart()
    return Chapter(
        name="entry",
        title=f"{entry.name}: {entry.title}",
        summary=(
            f"Provenance: {entry.provenance}. Grade: {entry.grade}. Components:"
            f" {', '.join(map(' '.join, models.items()))}."
        ),
        values=tuple(
            NamedValue(name, getattr(entry, name), brief=False)
            for name in ("name", "provenance", "grade")
        ),
        tables=tuple(table for table in tables if len(table)),
        plots=() if chart is None else (Plot("entry", entry.title, chart),),
        problems=(entry.warning,) if entry.warning else (),
        notes=tuple(filter(None, (entry.note, *entry.remarks()))),
        references=tuple(cite(entry)),
    )


def _check_tables(entry: EntryDisplay) -> Iterator[Table]:
    """Checks, and the sources of single numbers."""
    checks = getattr(entry, "checks", ())
    sources = dict(getattr(entry, "sources", ()))
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

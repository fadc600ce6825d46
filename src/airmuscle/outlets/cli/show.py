"""`airmuscle show`: parameters, sources and checks of a library entry."""

from __future__ import annotations

import math
from typing import Any

from ...core import cite, leaves
from ...core.display import in_display_unit
from ...core.tree import continues_list
from ...files.library.catalogue import load
from ...files.library.entry import Entry, PlantEntry, ProductEntry, ValveEntry
from ...files.library.files import entries_of_product
from ...files.library.scaling import scale_entry
from ...physics.muscle import Ratings
from ...report.formatting import format_number
from .options import Diameter, Json, Name, RestingLength
from .terminal import echo, print_json, print_table

PARTS = (
    "characteristic", "geometry", "spring", "damper", "friction", "wall", "series", "stop", "creep", "ratings",
    "validity_range", "valve", "exhaust", "switching_times", "plant",
)  # fmt: skip
MAX_VALUES = 30
"""Longest list of values that the table shows completely."""


def show(name: Name, resting_length: RestingLength = None, diameter: Diameter = None, json: Json = False) -> None:
    """Show parameters, sources and checks of a library entry.

    The table of parameters contains symbol, value, unit, meaning and bounds.

    \b
    Examples:
      airmuscle show dmsp-20-300
      airmuscle show matrix-821
      airmuscle show festo-dmsp-20
      airmuscle show my/muscle.toml --json
    """
    entry: Any = load(name)
    if resting_length is not None or diameter is not None:
        entry = scale_entry(entry, resting_length=resting_length, diameter=diameter)
    data = entry_to_dict(entry)
    if json:
        print_json(data)
    else:
        _print(data)


def entry_to_dict(entry: Entry | ValveEntry | PlantEntry | ProductEntry) -> dict[str, Any]:
    """An entry as plain data, all numbers SI."""
    parts = {part: getattr(entry, part) for part in PARTS if getattr(entry, part, None) is not None}
    # A geometric law contains the geometry among its own parameters; it is listed once.
    law_geometry = getattr(parts.get("characteristic"), "geometry", None)
    return {
        "name": entry.name,
        "title": entry.title,
        "provenance": entry.provenance,
        "note": entry.note,
        "warning": entry.warning,
        "models": {part: type(model).__name__ for part, model in parts.items()},
        "parameters": [
            row
            for part, model in parts.items()
            if part != "geometry" or model != law_geometry
            for row in _parameter_rows(part, model)
        ],
        "checks": [
            {
                "quantity": check.quantity,
                "given": dict(check.conditions),
                "equals": check.equals,
                "tolerance": check.tolerance,
                "source": check.source,
            }
            for check in getattr(entry, "checks", ())
        ],
        "sources": dict(getattr(entry, "sources", ())),
        "references": [str(reference) for reference in cite(entry)],
        **({"laws": list(entries_of_product(entry.name))} if isinstance(entry, ProductEntry) else {}),
    }


def _parameter_rows(part: str, model: Any) -> list[dict[str, Any]]:
    return [
        {
            "name": f"{part}.{leaf.path}",
            "symbol": leaf.declared.symbol,
            "value": leaf.value,
            "unit": leaf.declared.unit,
            "meaning": leaf.declared.meaning,
            "bounds": [bound if math.isfinite(bound) else None for bound in leaf.declared.bounds],
            "fitted": leaf.declared.fitted,
        }
        for leaf in leaves(model)
        if not isinstance(model, Ratings) or leaf.declared.name in model.stated
    ]


def _print(entry: dict[str, Any]) -> None:
    echo(f"{entry['name']}: {entry['title']}")
    echo(f"provenance: {entry['provenance']}")
    for key in ("note", "warning"):
        if entry[key]:
            echo(f"{key}: {entry[key]}")
    echo("components: " + ", ".join(f"{part} {model}" for part, model in entry["models"].items()) + "\n")
    rows = [
        (p["name"], p["symbol"], format_number(p["value"]), _unit(p["unit"]), p["meaning"], _bounds(p["bounds"]))
        for p in map(_displayed, _with_meanings_once(_shorten(entry["parameters"])))
    ]
    print_table(("parameter", "symbol", "value", "unit", "meaning", "bounds"), rows, right=("value",))
    if "laws" in entry:
        echo(f"\nmuscles and laws of this product: {', '.join(entry['laws']) or 'none; fit one to measurements'}")
    if entry["checks"]:
        checks = [
            (
                c["quantity"],
                _point(c["given"]),
                f"{format_number(c['equals'])} ± {format_number(c['tolerance'])}",
                c["source"],
            )
            for c in entry["checks"]
        ]
        echo()
        print_table(("checked quantity", "at (SI)", "published value (SI)", "source"), checks)
    if entry["sources"]:
        echo()
        print_table(("numbers", "source"), entry["sources"].items())
    echo()
    for reference in entry["references"]:
        echo(f"- {reference}")


def _with_meanings_once(parameters: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The parameters, of which the values of a list state their meaning once."""
    pairs = zip(parameters, continues_list([p["name"] for p in parameters]), strict=True)
    return [{**p, "meaning": ""} if continued else p for p, continued in pairs]


def _shorten(parameters: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The parameters without the middle of long lists."""
    stems = [p["name"].partition("[")[0] for p in parameters]
    rows = []
    for i, (stem, parameter) in enumerate(zip(stems, parameters, strict=True)):
        position = i - stems.index(stem)
        count = stems.count(stem)
        if count <= MAX_VALUES or position in (0, 1, count - 1):
            rows.append(parameter)
        elif position == 2:
            empty = dict.fromkeys(("symbol", "value", "unit", "meaning"), "")
            rows.append({**parameter, **empty, "name": f"... {count - 3} more", "bounds": [None, None]})
    return rows


def _displayed(parameter: dict[str, Any]) -> dict[str, Any]:
    """A parameter with value and bounds in the unit chosen for display."""
    factor, unit = in_display_unit(1.0, parameter["unit"])
    if factor == 1.0:
        return parameter
    value = parameter["value"] * factor if parameter["value"] != "" else ""
    bounds = [None if bound is None else bound * factor for bound in parameter["bounds"]]
    return {**parameter, "value": value, "unit": unit, "bounds": bounds}


def _unit(unit: str) -> str:
    return "" if unit == "1" else unit


def _bounds(bounds: list[float | None]) -> str:
    low, high = ("" if bound is None else f"{bound:g}" for bound in bounds)
    return f"{low or '-inf'} to {high or 'inf'}" if low or high else ""


def _point(values: dict[str, float]) -> str:
    return ", ".join(f"{quantity} {value:.6g}" for quantity, value in values.items())

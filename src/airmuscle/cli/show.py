"""`airmuscle show`: one library entry with its parameters, sources and checks."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import typer

from .options import Json, Name
from .terminal import print_json, print_table

if TYPE_CHECKING:
    from ..library.entry import Entry
    from ..library.valve_entry import ValveEntry

PARTS = (
    "characteristic", "geometry", "spring", "damper", "friction", "wall", "series", "stop", "creep", "validity_range", "valve",
    "exhaust", "switching_times",
)  # fmt: skip
MANY = 30
"""Values of one list above which the table shows its ends only."""


def show(name: Name, json: Json = False) -> None:
    """Show an entry: parameters with symbol, value, unit, meaning and bounds, its sources and its checks.

    \b
    Examples:
      airmuscle show dmsp-20-300
      airmuscle show matrix-821
      airmuscle show my/muscle.toml --json
    """
    from ..library.catalogue import load

    entry = load(name)
    if json:
        print_json(described(entry))
        return
    _print(described(entry))


def described(entry: Entry | ValveEntry) -> dict[str, Any]:
    """An entry as plain data, all numbers SI."""
    from ..core.reference import cite

    parts = {part: getattr(entry, part) for part in PARTS if getattr(entry, part, None) is not None}
    own_geometry = getattr(parts.get("characteristic"), "geometry", None)  # a geometric law has it among its parameters
    return {
        "name": entry.name,
        "title": entry.title,
        "provenance": entry.provenance,
        "note": entry.note,
        "warning": entry.warning,
        "models": {part: type(thing).__name__ for part, thing in parts.items()},
        "parameters": [
            row
            for part, thing in parts.items()
            if part != "geometry" or thing != own_geometry
            for row in _parameters(part, thing)
        ],
        "checks": [
            {
                "quantity": c.quantity,
                "given": dict(c.conditions),
                "equals": c.equals,
                "tolerance": c.tolerance,
                "source": c.source,
            }
            for c in entry.checks
        ],
        "references": [str(reference) for reference in cite(entry)],
    }


def _parameters(part: str, thing: Any) -> list[dict[str, Any]]:
    from ..core.tree import leaves

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
        for leaf in leaves(thing)
    ]


def _print(entry: dict[str, Any]) -> None:
    from ..report.formatting import format_number

    typer.echo(f"{entry['name']}: {entry['title']}")
    typer.echo(f"provenance: {entry['provenance']}")
    for key in ("note", "warning"):
        if entry[key]:
            typer.echo(f"{key}: {entry[key]}")
    typer.echo("made of: " + ", ".join(f"{part} {model}" for part, model in entry["models"].items()) + "\n")
    rows = [
        (p["name"], p["symbol"], format_number(p["value"], 6), _unit(p["unit"]), p["meaning"], _bounds(p["bounds"]))
        for p in _shortened(entry["parameters"])
    ]
    print_table(("parameter", "symbol", "value", "unit", "meaning", "bounds"), rows, right=("value",))
    if entry["checks"]:
        checks = [
            (
                c["quantity"],
                _given(c["given"]),
                f"{format_number(c['equals'], 6)} ± {format_number(c['tolerance'], 6)}",
                c["source"],
            )
            for c in entry["checks"]
        ]
        typer.echo()
        print_table(("checked", "at (SI)", "equals (SI)", "source"), checks)
    typer.echo()
    for reference in entry["references"]:
        typer.echo(f"- {reference}")


def _shortened(parameters: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The parameters without the middle of long lists."""
    stems = [p["name"].partition("[")[0] for p in parameters]
    kept = []
    for i, (stem, parameter) in enumerate(zip(stems, parameters, strict=True)):
        place = i - stems.index(stem)
        count = stems.count(stem)
        if count <= MANY or place in (0, 1, count - 1):
            kept.append(parameter)
        elif place == 2:
            kept.append({**parameter, "name": f"... {count - 3} more", "value": "", "meaning": ""})
    return kept


def _unit(unit: str) -> str:
    return "" if unit == "1" else unit


def _bounds(bounds: list[float | None]) -> str:
    low, high = ("" if bound is None else f"{bound:g}" for bound in bounds)
    return f"{low or '-inf'} to {high or 'inf'}" if low or high else ""


def _given(given: dict[str, float]) -> str:
    return ", ".join(f"{quantity} {value:.6g}" for quantity, value in given.items())

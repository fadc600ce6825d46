"""`airmuscle list`: the entries of the library, from their files alone."""

import itertools
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ...files.library.folders import DATA, FOLDERS, list_data, list_names
from ...files.library.grade import grade_of
from .options import Json
from .terminal import print_json, print_table

SOLVED_FOR_PRESSURE = frozenset({"ExactMeridian", "Saga2007"})
"""Laws with a geometry that no plant simulates, because they are solved for the pressure."""


def list_entries(json: Json = False) -> None:
    """List muscles, laws, valves, plants, products and data sets.

    A muscle can be simulated; a characteristic cannot, because it has no geometry or is not solved
    for the force. A product states the values that the maker of a muscle permits. A valve is used
    in a scenario as { library = NAME }, and a plant as [plant] library = NAME; `airmuscle simulate
    NAME` runs its example. A data set is used as FILES of `airmuscle fit`; that of a specimen is
    listed with its law. The provenance is the origin of the numbers: printed, measured, data sheet,
    secondary source, fitted or chosen. The grade is whose numbers they are: a table of the maker, a
    secondary source, who measured, who submitted the entry.

    \b
    Examples:
      airmuscle list
      airmuscle list --json
    """
    rows = _library_rows()
    if json:
        print_json(rows)
    else:
        print_table({key: [row[key] for row in rows] for key in rows[0]})


def _library_rows() -> list[dict[str, str]]:
    """All library entries, valves, plants and data sets, read from the files without building any
    model.
    """
    kinds: dict[str, Callable[[Mapping[str, Any]], str]] = {
        "muscle or law": _law_kind,
        "valve": lambda tables: f"valve, {tables['valve']['model']}",
        "plant": lambda tables: f"plant, {tables['plant']['mechanism']['model']}",
        "product": lambda _: "product, Ratings",
    }
    data = {name: _data_row(DATA / f"{name}.csv") for name in list_data()}
    rows = []
    for noun, kind_of in kinds.items():
        for name in list_names(FOLDERS[noun]):
            tables = tomllib.loads((FOLDERS[noun] / f"{name}.toml").read_text(encoding="utf-8"))
            kind = kind_of(tables)
            provenance = tables["provenance"]
            if kind_of is _law_kind and name in data:  # one row with the data set of the same name
                measured = data.pop(name)
                kind = f"{kind}; {measured['kind']}"
                provenance = "; ".join(
                    filter(None, dict.fromkeys((provenance, measured["provenance"])))
                )
            rows.append(
                {
                    "name": name,
                    "title": tables["title"],
                    "kind": kind,
                    "provenance": provenance,
                    "grade": grade_of(tables),
                }
            )
    return [*rows, *data.values()]


def _law_kind(tables: Mapping[str, Any]) -> str:
    law = tables["characteristic"]
    has_geometry = "geometry" in tables or "geometry" in law
    is_muscle = has_geometry and law["model"] not in SOLVED_FOR_PRESSURE
    return f"{'muscle' if is_muscle else 'characteristic'}, {law['model']}"


def _data_row(path: Path) -> dict[str, str]:
    """Title and provenance from the comments at the top of a data file."""
    with path.open(encoding="utf-8") as file:
        comments = list(itertools.takewhile(lambda line: line.startswith("#"), file))
    # the first comment is the title
    lines = [comment.lstrip("# ").strip() for comment in comments]
    text = " ".join(lines)
    title = lines[0] if lines else ""
    provenance = next((word for word in ("secondary source", "measured") if word in text), "")
    return {
        "name": path.stem,
        "title": title,
        "kind": "data set",
        "provenance": provenance,
        "grade": provenance,
    }

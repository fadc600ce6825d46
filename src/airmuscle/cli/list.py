"""`airmuscle list`: what the library holds."""

from __future__ import annotations

import dataclasses
import itertools
from pathlib import Path

from .options import Json
from .terminal import print_json, print_table


@dataclasses.dataclass(frozen=True)
class ListRow:
    """What a library file says of itself before anything is built from it."""

    name: str
    title: str
    kind: str
    provenance: str


def list_entries(json: Json = False) -> None:
    """List the muscles, laws, valves and data sets of the library.

    A muscle can be simulated; a characteristic lacks a geometry for that, or is not solved for the force.
    A valve stands in a scenario as { library = NAME }. A data set is a FILE that `airmuscle fit` knows by its
    name. Trust says how the numbers came here: printed, measured, data sheet, secondary source, fitted or chosen.

    \b
    Examples:
      airmuscle list
      airmuscle list --json
    """
    found = heads()
    if json:
        print_json([dataclasses.asdict(head) for head in found])
        return
    print_table(("name", "title", "kind", "provenance"), (dataclasses.astuple(head) for head in found))


def heads() -> list[ListRow]:
    """The heads of all library entries and data sets; nothing is built, so that listing stays quick."""
    from ..library.files import DATA, LAWS, VALVES, list_data, list_laws, list_valves

    return [
        *(_entry_head(LAWS / f"{name}.toml") for name in list_laws()),
        *(_valve_head(VALVES / f"{name}.toml") for name in list_valves()),
        *(_data_head(DATA / f"{name}.csv") for name in list_data()),
    ]


def _entry_head(path: Path) -> ListRow:
    import tomllib

    from ..characteristic.base import ForceLaw
    from ..library.models import model_class

    tables = tomllib.loads(path.read_text(encoding="utf-8"))
    law = tables["characteristic"]
    muscle = issubclass(model_class(law["model"], str(path)), ForceLaw) and ("geometry" in tables or "geometry" in law)
    return ListRow(
        path.stem, tables["title"], f"{'muscle' if muscle else 'characteristic'}, {law['model']}", tables["provenance"]
    )


def _valve_head(path: Path) -> ListRow:
    import tomllib

    tables = tomllib.loads(path.read_text(encoding="utf-8"))
    return ListRow(path.stem, tables["title"], f"valve, {tables['valve']['model']}", tables["provenance"])


def _data_head(path: Path) -> ListRow:
    """Title and provenance from the comments that open a data file."""
    with path.open(encoding="utf-8") as file:
        comments = list(itertools.takewhile(lambda line: line.startswith("#"), file))
    text = " ".join(line.lstrip("# ").strip() for line in comments)
    title = comments[0].lstrip("# ").strip() if comments else ""
    provenance = "secondary source" if "secondary source" in text else "measured" if "measured" in text else ""
    return ListRow(path.stem, title, "data set", provenance)

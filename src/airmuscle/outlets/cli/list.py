"""`airmuscle list`: contents of the library."""

import dataclasses
import itertools
import tomllib
from pathlib import Path

from ...files.library.files import (  # fmt: skip
    DATA,
    FOLDERS,
    LAWS,
    list_data,
    list_laws,
    list_plants,
    list_products,
    list_valves,
)
from ...files.library.models import model_class
from ...physics.muscle.characteristic import ForceLaw
from .options import Json
from .terminal import print_json, print_table


@dataclasses.dataclass(frozen=True)
class ListRow:
    """Name, title, kind and provenance of a library file."""

    name: str
    title: str
    kind: str
    provenance: str


def list_entries(json: Json = False) -> None:
    """List muscles, laws, valves, plants, products and data sets.

    A muscle can be simulated; a characteristic cannot, because it has no geometry or is not solved for the force.
    A product states the values that the maker of a muscle permits. A valve is used in a scenario as { library = NAME },
    and a plant as [plant] library = NAME; `airmuscle simulate NAME` runs its example. A data set is used as FILES of
    `airmuscle fit`; that of a specimen is listed with its law. The provenance is the origin of the numbers: printed,
    measured, data sheet, secondary source, fitted or chosen.

    \b
    Examples:
      airmuscle list
      airmuscle list --json
    """
    rows = library_rows()
    if json:
        print_json([dataclasses.asdict(row) for row in rows])
        return
    print_table({field.name: [getattr(row, field.name) for row in rows] for field in dataclasses.fields(ListRow)})


def library_rows() -> list[ListRow]:
    """All library entries, valves, plants and data sets, read from the files without building any model."""
    data = {name: _data_row(DATA / f"{name}.csv") for name in list_data()}
    laws = [_entry_row(LAWS / f"{name}.toml") for name in list_laws()]
    return [
        *(_with_data_set(row, data.pop(row.name)) if row.name in data else row for row in laws),
        *(_valve_row(FOLDERS["valve"] / f"{name}.toml") for name in list_valves()),
        *(_plant_row(FOLDERS["plant"] / f"{name}.toml") for name in list_plants()),
        *(_product_row(FOLDERS["product"] / f"{name}.toml") for name in list_products()),
        *data.values(),
    ]


def _with_data_set(law: ListRow, data: ListRow) -> ListRow:
    """One row for a law and the data set of the same name."""
    provenance = law.provenance if data.provenance in ("", law.provenance) else f"{law.provenance}; {data.provenance}"
    return dataclasses.replace(law, kind=f"{law.kind}; {data.kind}", provenance=provenance)


def _product_row(path: Path) -> ListRow:
    tables = tomllib.loads(path.read_text(encoding="utf-8"))
    return ListRow(path.stem, tables["title"], "product, Ratings", tables["provenance"])


def _entry_row(path: Path) -> ListRow:
    tables = tomllib.loads(path.read_text(encoding="utf-8"))
    law = tables["characteristic"]
    muscle = issubclass(model_class(law["model"], str(path)), ForceLaw) and ("geometry" in tables or "geometry" in law)
    kind = f"{'muscle' if muscle else 'characteristic'}, {law['model']}"
    return ListRow(path.stem, tables["title"], kind, tables["provenance"])


def _valve_row(path: Path) -> ListRow:
    tables = tomllib.loads(path.read_text(encoding="utf-8"))
    return ListRow(path.stem, tables["title"], f"valve, {tables['valve']['model']}", tables["provenance"])


def _plant_row(path: Path) -> ListRow:
    tables = tomllib.loads(path.read_text(encoding="utf-8"))
    mechanism = tables["plant"]["mechanism"]["model"]
    return ListRow(path.stem, tables["title"], f"plant, {mechanism}", tables["provenance"])


def _data_row(path: Path) -> ListRow:
    """Title and provenance from the comments at the top of a data file."""
    with path.open(encoding="utf-8") as file:
        comments = list(itertools.takewhile(lambda line: line.startswith("#"), file))
    text = " ".join(line.lstrip("# ").strip() for line in comments)
    title = comments[0].lstrip("# ").strip() if comments else ""
    secondary = "secondary source" in text
    provenance = "secondary source" if secondary else "measured" if "measured" in text else ""
    return ListRow(path.stem, title, "data set", provenance)

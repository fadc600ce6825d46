"""ProductEntry: a library file of a commercial muscle, with the values that its maker permits and their sources.

    title = "..."                   the product
    provenance = "secondary source" origin of the numbers
    note = "..."                    source of each number, and what is not known
    [ratings]                       permitted values
    [[reference]]                   sources

The file of a muscle or a law refers to it by `product = "festo-dmsp-20"`, or has a table [ratings] of its own.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...core.declaration import parameters
from ...core.errors import ParameterError
from ...core.reference import Reference
from ...physics.muscle import Ratings
from .build import TEXT_KEYS, build, read_entry_texts
from .entry_display import EntryDisplay
from .files import PRODUCTS, complete_name, list_products, read_toml
from .location import Location, check_keys, check_type, located_errors, read_text
from .references import read_references


@dataclasses.dataclass(frozen=True, repr=False)
class ProductEntry(EntryDisplay):
    """Library entry of a commercial muscle: permitted values in SI units, with provenance, note and sources.

    It has no characteristic; the entries of muscles and laws that were measured on this product refer to it.
    """

    name: str
    title: str
    provenance: str
    ratings: Ratings
    note: str = ""
    warning: str = ""
    references: tuple[Reference, ...] = ()

    def _table(self) -> list[tuple[str, ...]]:
        return [("permitted", "range"), *((row.quantity, str(row)) for row in self.ratings.ranges())]


def load_product(name: str) -> ProductEntry:
    """A commercial muscle by its name or a unique beginning of it. Raises UnknownNameError."""
    name = complete_name(name, list_products(), "product")
    return build_product_entry(read_toml(PRODUCTS / f"{name}.toml"), name, Path(f"{name}.toml"))


def build_product_entry(tables: Mapping[str, Any], name: str, file: Path) -> ProductEntry:
    """The product entry of the tables of a file; error messages name `file`. Raises ParameterError or UnitError."""
    location = Location(str(file), "", file.parent)
    check_keys(tables, (*TEXT_KEYS, "ratings", "reference"), location)
    texts = read_entry_texts(tables, location)
    ratings = build_limits(Ratings, tables.get("ratings", {}), location.inside("ratings"))
    return ProductEntry(name, ratings=ratings, references=read_references(tables, location), **texts)


def read_ratings(tables: Mapping[str, Any], location: Location) -> tuple[Ratings | None, tuple[Reference, ...]]:
    """Ratings of an entry file and the references of its product; (None, ()) if it states none.

    Raises ParameterError for a file with both a product and a table [ratings], UnknownNameError for an unknown product.
    """
    if "product" in tables and "ratings" in tables:
        raise ParameterError(
            f"{location}: both 'product' and [ratings] are given; the ratings of a product are in its own file. "
            "Remove one of them."
        )
    if "product" in tables:
        with located_errors(location):
            product = load_product(read_text(tables, "product", location, needed=True))
        return product.ratings, product.references
    if "ratings" in tables:
        return build_limits(Ratings, tables["ratings"], location.inside("ratings")), ()
    return None, ()


def build_limits(cls: type[Any], table: Any, location: Location) -> Any:
    """The validity range or the ratings of a table that need not name its model. Raises ParameterError."""
    if not isinstance(table, Mapping):
        keys = ", ".join(declared.name for declared in parameters(cls))
        raise ParameterError(f"{location} is {table!r}; it must be a table. Write its limits in it: {keys}.")
    return check_type(build({"model": cls.__name__, **table}, location), cls, location)

"""Folders of the library, and the names of the entries in them."""

import os
from pathlib import Path

LAWS = Path(__file__).parent
"""Folder of the muscles and laws."""
PLANTS = LAWS / "plants"
"""Folder of the plants."""
DATA = LAWS / "data"
"""Folder of the data sets."""
FOLDERS = {
    "valve": LAWS / "valves",
    "plant": PLANTS,
    "product": LAWS / "products",
    "muscle or law": LAWS,
}
"""Folders of the entries, by what they are."""


def list_names(folder: Path) -> tuple[str, ...]:
    """Names of the entries in a folder of the library, sorted."""
    return tuple(
        sorted(name.removesuffix(".toml") for name in os.listdir(folder) if name.endswith(".toml"))
    )


def list_library() -> tuple[str, ...]:
    """Names of all entries that `load` reads: muscles, laws, valves, plants and products,
    sorted.
    """
    return tuple(sorted(name for folder in FOLDERS.values() for name in list_names(folder)))


def list_laws() -> tuple[str, ...]:
    """Names of all muscles and laws, sorted."""
    return list_names(LAWS)


def list_valves() -> tuple[str, ...]:
    """Names of all valves, sorted."""
    return list_names(FOLDERS["valve"])


def list_plants() -> tuple[str, ...]:
    """Names of all plants, sorted."""
    return list_names(PLANTS)


def list_products() -> tuple[str, ...]:
    """Names of all commercial muscles of which the ratings are known, sorted."""
    return list_names(FOLDERS["product"])


def list_data() -> tuple[str, ...]:
    """Names of all measured or tabulated data sets, sorted."""
    return tuple(sorted(path.stem for path in DATA.glob("*.csv")))

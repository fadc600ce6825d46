"""Readers of Parquet and HDF5 files: columns with their names and units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import FileError, suggestion
from .channels import Channel, merge_channels
from .optional_dependency import import_lab_package, run_reader
from .separate_process import read_in_separate_process
from .table import RawTable

MAX_VALUES = 200_000_000
"""Values of a dataset that are read at most (chosen): 1.6 GB."""


def read_parquet_tables(path: Path, group: str | None = None) -> tuple[RawTable, ...]:
    """Read the table of a Parquet file; the metadata `unit` of a column states its unit, that of the file constants.

    A Parquet file has no groups; `group` is not used. Raises FileError or ColumnError.
    """
    tables: tuple[RawTable, ...] = read_in_separate_process("pyarrow", __name__, "read_parquet_tables_here", path)
    return tables


def read_parquet_tables_here(path: Path) -> tuple[RawTable, ...]:
    """As `read_parquet_tables`, in this process."""
    parquet = import_lab_package("pyarrow.parquet", path)

    def read() -> tuple[RawTable, ...]:
        table = parquet.read_table(str(path))
        channels = [
            Channel(field.name, table.column(i).to_numpy(), unit=_text((field.metadata or {}).get(b"unit", b"")))
            for i, field in enumerate(table.schema)
            if not field.name.startswith("__index_level_")
        ]
        metadata = {_text(name): _text(value) for name, value in (table.schema.metadata or {}).items()}
        constants: dict[str, float | str] = {
            name: _number(text) for name, text in metadata.items() if name not in ("pandas", "ARROW:schema")
        }
        return (merge_channels(path.name, channels, constants),)

    return run_reader(path, "Parquet", read)


def read_hdf5_tables(path: Path, group: str | None = None) -> tuple[RawTable, ...]:
    """Read one table from each group with vectors, or from the named group; the attribute `unit` states a unit.

    A dataset of records (named fields) is a table of its own, and so is a matrix with an attribute `columns`. Raises
    FileError or ColumnError.
    """
    tables: tuple[RawTable, ...] = read_in_separate_process("h5py", __name__, "read_hdf5_tables_here", path, group)
    return tables


def read_hdf5_tables_here(path: Path, group: str | None) -> tuple[RawTable, ...]:
    """As `read_hdf5_tables`, in this process."""
    h5py = import_lab_package("h5py", path)

    def read() -> dict[str, tuple[list[Channel], dict[str, float | str]]]:
        with h5py.File(path, "r") as file:
            check_own_values(h5py, file, path)
            return {name: content for name, content in _groups(h5py, file) if content[0]}

    contents = run_reader(path, "HDF5", read)
    if not contents:
        raise FileError(
            f"{path.name}: no dataset is a vector of numbers, a matrix with columns, or a table of records."
        )
    if group is not None and group not in contents:
        names = ", ".join(contents)
        raise FileError(f"{path.name}: no group '{group}'; the groups are {names}.{suggestion(group, contents)}")
    several, selected = len(contents) > 1, contents if group is None else {group: contents[group]}
    return tuple(
        merge_channels(f"{path.name}, group '{name}'" if several else path.name, channels, constants)
        for name, (channels, constants) in selected.items()
    )


def check_own_values(h5py: Any, file: Any, path: Path) -> None:
    """Raise FileError if the values of a dataset are in another file, which might be any file of this machine."""

    def is_outside(name: str, item: Any) -> bool | None:
        return True if isinstance(item, h5py.Dataset) and (item.external or item.is_virtual) else None

    if file.visititems(is_outside):
        raise FileError(
            f"{path.name}: the values of a dataset are in another file, which is not read. Store them in this file."
        )


def check_no_external_links(h5py: Any, group: Any, path: Path) -> None:
    """Raise FileError if a group, or one inside it, has a link to another file."""
    for name in group:
        link = group.get(name, getlink=True)
        if isinstance(link, h5py.ExternalLink):
            raise FileError(f"{path.name}: '{name}' is a link to another file, which is not read. Store the values.")
        if isinstance(link, h5py.HardLink) and isinstance(group[name], h5py.Group):
            check_no_external_links(h5py, group[name], path)


def _groups(h5py: Any, group: Any) -> Iterator[tuple[str, tuple[list[Channel], dict[str, float | str]]]]:
    """Channels and constants of each group with vectors and each dataset that is a table; no links are followed."""
    vectors: list[Any] = []
    tables: list[Any] = []
    groups: list[Any] = []
    for name in group:
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue
        item = group[name]
        if isinstance(item, h5py.Group):
            groups.append(item)
        elif item.size and item.size <= MAX_VALUES:
            (vectors if item.ndim == 1 and item.dtype.names is None else tables).append(item)
    constants = _constants(group.attrs)
    yield (
        group.name,
        ([Channel(_name(d), d[:], unit=_unit(d.attrs)) for d in vectors if d.dtype.kind in "biuf"], constants),
    )
    for dataset in tables:
        yield dataset.name, (_columns(dataset), {**constants, **_constants(dataset.attrs)})
    for inner in groups:
        yield from _groups(h5py, inner)


def _columns(dataset: Any) -> list[Channel]:
    """Channels of a dataset of records, or of a matrix with an attribute `columns`; empty for another dataset."""
    units = _texts(dataset.attrs.get("units", ()))
    if dataset.dtype.names is not None and dataset.ndim == 1:
        names, values = list(dataset.dtype.names), [dataset[name] for name in dataset.dtype.names]
    else:
        names = _texts(dataset.attrs.get("columns", ()))
        if dataset.ndim != 2 or len(names) != dataset.shape[1]:
            return []
        values = list(np.asarray(dataset[:]).T)
    units = units if len(units) == len(names) else [""] * len(names)
    return [Channel(name, value, unit=unit) for name, value, unit in zip(names, values, units, strict=True)]


def _name(dataset: Any) -> str:
    return str(dataset.name).rpartition("/")[2]


def _unit(attributes: Mapping[str, Any]) -> str:
    return next((_text(attributes[key]) for key in ("unit", "units", "Unit", "Units") if key in attributes), "")


def _constants(attributes: Mapping[str, Any]) -> dict[str, float | str]:
    """Attributes that are single numbers or texts."""
    scalars = {name: value for name, value in attributes.items() if np.ndim(value) == 0}
    return {
        name: float(value) if isinstance(value, np.number | int | float) else _text(value)
        for name, value in scalars.items()
        if isinstance(value, np.number | int | float | str | bytes) and name.isidentifier()
    }


def _text(value: Any) -> str:
    return value.decode("utf-8", errors="replace") if isinstance(value, bytes) else str(value)


def _texts(values: Any) -> list[str]:
    return [_text(value) for value in np.atleast_1d(np.asarray(values, dtype=object))]


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text

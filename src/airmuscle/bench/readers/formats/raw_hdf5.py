"""Reader of HDF5 files: columns with their names and units, and arrays of episodes."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from ....core import FileError
from ..tables import (
    Arrays,
    Channel,
    Downsampling,
    RawTable,
    Reduction,
    Selection,
    check_reduced_lengths,
    episodes_of,
    flat,
    import_lab_package,
    merge_channels,
    reading,
)

StoredTable = tuple[str, list[Channel], dict[str, float | str], Reduction]
"""Name, channels and constants of a group or a dataset of an HDF5 file, and the reduction of its
rows.
"""


def read_hdf5_tables(path: Path, selection: Selection = Selection()) -> tuple[RawTable, ...]:
    """Read one table from each group with vectors, or from the selected groups; the attribute
    `unit` states a unit.

    A dataset of records (named fields) is a table of its own, and so is a matrix with an attribute
    `columns`. A table of more than `downsampling.max_rows` rows is read by pieces and reduced.
    Raises FileError or ColumnError.
    """
    h5py = import_lab_package("h5py", path)
    with reading(path, "HDF5"), h5py.File(path, "r") as file:
        check_own_values(h5py, file, path)
        links = tuple(_external_links(h5py, file))
        tables = _groups(h5py, file, path.name, selection.downsampling)
        contents = {
            name: (channels, constants, reduction)
            for name, channels, constants, reduction in tables
            if channels
        }
    if not contents:
        raise FileError(
            f"{path.name}: no dataset is a vector of numbers, a matrix with columns, or a table of"
            " records."
        )
    selected = selection.groups(path.name, "group", contents)
    origins = {
        name: f"{path.name}, group '{name}'" if len(contents) > 1 else path.name
        for name in contents
    }
    return tuple(
        reduction.noted(merge_channels(origins[name], channels, constants)).noted(*links)
        for name, (channels, constants, reduction) in contents.items()
        if name in selected
    )


def _external_links(h5py: Any, group: Any) -> Iterator[str]:
    """Notes on the links to other files, which are not read, in a group and in those inside it."""
    for name in group:
        link = group.get(name, getlink=True)
        if isinstance(link, h5py.ExternalLink):
            yield f"Not read: '{name}', which is a link to another file. Store its values here."
        elif isinstance(link, h5py.HardLink) and isinstance(group[name], h5py.Group):
            yield from _external_links(h5py, group[name])


def read_hdf5_arrays(path: Path) -> list[Arrays]:
    """The arrays of numbers of every episode: those of a group each, or of the file without groups.
    Raises FileError.
    """
    h5py = import_lab_package("h5py", path)
    with reading(path, "HDF5"), h5py.File(path, "r") as file:
        check_own_values(h5py, file, path)
        check_no_external_links(h5py, file, path)
        return [
            {name: np.asarray(dataset, dtype=float) for name, dataset in flat(episode)}
            for episode in episodes_of(_datasets(h5py, file))
        ]


def _datasets(h5py: Any, group: Any) -> dict[str, Any]:
    """The datasets of numbers in a group, and those of the groups inside it; no links are
    followed.
    """
    datasets: dict[str, Any] = {}
    for name in group:
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue
        item = group[name]
        if isinstance(item, h5py.Group):
            datasets[name] = _datasets(h5py, item)
        elif isinstance(item, h5py.Dataset) and item.dtype.kind in "biuf":
            datasets[name] = item
    return datasets


def check_own_values(h5py: Any, file: Any, path: Path) -> None:
    """Raise FileError if the values of a dataset are in another file, which might be any file of
    this machine.
    """
    file.visititems(lambda name, item: check_own_dataset(h5py, item, path.name))


def check_own_dataset(h5py: Any, item: Any, origin: str) -> None:
    """Raise FileError if the values of an item, which may also be reached by a reference, are in
    another file.
    """
    if isinstance(item, h5py.Dataset) and (item.external or item.is_virtual):
        raise FileError(
            f"{origin}: the values of a dataset are in another file, which is not read. Store"
            " them in this file."
        )


def check_no_external_links(h5py: Any, group: Any, path: Path) -> None:
    """Raise FileError if a group, or one inside it, has a link to another file."""
    for name in group:
        link = group.get(name, getlink=True)
        if isinstance(link, h5py.ExternalLink):
            raise FileError(
                f"{path.name}: '{name}' is a link to another file, which is not read. Store the"
                " values."
            )
        if isinstance(link, h5py.HardLink) and isinstance(group[name], h5py.Group):
            check_no_external_links(h5py, group[name], path)


def _groups(
    h5py: Any,
    group: Any,
    origin: str,
    downsampling: Downsampling,
    outer: Mapping[str, float | str] = MappingProxyType({}),
) -> Iterator[StoredTable]:
    """The table of each group with vectors and of each dataset that is a table; no links are
    followed. The constants of the `outer` groups and of the file count in each group, which may
    state others."""
    vectors: list[Any] = []
    tables: list[Any] = []
    groups: list[Any] = []
    for name in group:
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue
        item = group[name]
        if isinstance(item, h5py.Group):
            groups.append(item)
        elif item.size and item.ndim:
            (vectors if _is_vector(item) else tables).append(item)
    constants = {**outer, **_constants(group.attrs)}
    numeric = [d for d in vectors if d.dtype.kind in "biuf"]
    reduction = Reduction(downsampling, max((d.size for d in numeric), default=0))
    channels = [
        Channel(d.name.rpartition("/")[2], _values(d, reduction), unit=_unit(d)) for d in numeric
    ]
    place = f"{origin}, group '{group.name}'"
    check_reduced_lengths(place, (d.size for d in numeric), (len(c.values) for c in channels))
    yield group.name, channels, constants, reduction
    for dataset in tables:
        reduction = Reduction(downsampling, dataset.shape[0])
        yield (
            dataset.name,
            _columns(dataset, reduction),
            {**constants, **_constants(dataset.attrs)},
            reduction,
        )
    for inner in groups:
        yield from _groups(h5py, inner, origin, downsampling, constants)


def _is_vector(dataset: Any) -> bool:
    """Whether a dataset is a vector, which MATLAB writes as a matrix of one row."""
    single = dataset.ndim == 2 and 1 in dataset.shape and "columns" not in dataset.attrs
    return (dataset.ndim == 1 or single) and dataset.dtype.names is None


def _values(dataset: Any, reduction: Reduction, field: str | None = None) -> Any:
    """The reduced rows of a dataset, or of one of its fields."""
    is_row = dataset.ndim == 2 and dataset.shape[0] == 1

    def vector(first: int, end: int) -> Any:
        values = dataset[0, first:end] if is_row else dataset[first:end]
        return values.reshape(-1)

    if field is not None:
        return reduction.read(lambda first, end: dataset[first:end][field], dataset.shape[0])
    if not _is_vector(dataset):
        return reduction.read(lambda first, end: dataset[first:end], dataset.shape[0])
    return reduction.read(vector, dataset.size)


def _columns(dataset: Any, reduction: Reduction) -> list[Channel]:
    """Channels of a dataset of records, or of a matrix with an attribute `columns`; empty for
    another dataset.
    """
    units = _texts(dataset.attrs.get("units", ()))
    if dataset.dtype.names is not None and dataset.ndim == 1:
        names = list(dataset.dtype.names)
        values = [_values(dataset, reduction, name) for name in names]
    else:
        names = _texts(dataset.attrs.get("columns", ()))
        if dataset.ndim != 2 or len(names) != dataset.shape[1]:
            return []
        values = list(np.asarray(_values(dataset, reduction)).T)
    units = units if len(units) == len(names) else [""] * len(names)
    return [
        Channel(name, value, unit=unit)
        for name, value, unit in zip(names, values, units, strict=True)
    ]


def _unit(dataset: Any) -> str:
    keys = ("unit", "units", "Unit", "Units")
    return next((_text(dataset.attrs[key]) for key in keys if key in dataset.attrs), "")


def _constants(attributes: Mapping[str, Any]) -> dict[str, float | str]:
    """Attributes that are single numbers or texts."""
    single = np.number | int | float | str | bytes
    stated = {
        name: value
        for name, value in attributes.items()
        if name.isidentifier() and isinstance(value, single)
    }
    return {
        name: _text(v) if isinstance(v, str | bytes) else float(v) for name, v in stated.items()
    }


def _text(value: Any) -> str:
    return value.decode("utf-8", errors="replace") if isinstance(value, bytes) else str(value)


def _texts(values: Any) -> list[str]:
    return [_text(value) for value in np.atleast_1d(np.asarray(values, dtype=object))]

"""Reader of MATLAB files, v5 to v7.3: one table for the vectors of each struct, and for those
outside any struct.

Each element of a struct array, `runs(2)`, and each struct in a cell array is a struct of its own;
so are the elements of a struct of cell arrays, `runs.force{2}`, of which version 7.3 does not
distinguish a struct array. Also supported: a matrix next to a list of column names (`importdata`
writes `data` and `colheaders`), and the structure with time that Simulink saves; tables and
timetables with the package mat-io.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ....core import ColumnError, FileError, Hint
from ....recording.columns import parse_heading
from ..tables import (
    ALL_ROWS,
    Arrays,
    Channel,
    Decimation,
    RawTable,
    Reduction,
    Selection,
    episodes_of,
    flat,
    merge_channels,
    reading,
)
from .mat_contents import (
    READABLE,
    MatlabObject,
    find_objects,
    is_plain_hdf5,
    read_contents,
    read_objects,
)
from .raw_hdf5 import read_hdf5_arrays, read_hdf5_tables


def read_mat_tables(path: Path, selection: Selection = Selection()) -> tuple[RawTable, ...]:
    """Read one table from each struct with vectors, or from the selected structs. Raises FileError
    or ColumnError.

    If the vectors of a struct differ in length, those of the length of the mapped columns are
    read, or without any those of the length of the known quantities. A long variable is reduced
    while it is read.
    """
    with reading(path, "MATLAB"):
        if is_plain_hdf5(path):
            return read_hdf5_tables(path, selection)
        contents = read_contents(path, selection.downsampling)
        objects = find_objects(path)
        tables = read_objects(path, objects)
    unread = [stored_object for stored_object in objects if stored_object.name not in tables]
    opaque = {stored_object.name for stored_object in objects}
    variables = {
        name: value for name, value in contents.variables.items() if name not in opaque
    } | tables
    groups = dict(_find_groups("", variables))
    names = selection.groups(path.name, "struct", groups)
    selected = {name: groups[name] for name in names}
    if not selected:
        raise FileError(
            f"{path.name}: no vector of numbers (the file contains "
            f"{', '.join([*variables, *map(str, unread)]) or 'no variables'}). {_remedy(unread)}"
        )
    constants = _scalar_fields(variables)
    notes = (
        *(f"Not read: {stored_object}. {_remedy([stored_object])}" for stored_object in unread),
        *contents.notes,
    )
    origins = {
        name: f"{path.name}, {name or 'variables'}" if len(groups) > 1 else path.name
        for name in groups
    }
    made = {
        name: _make_table(origins[name], fields, constants, selection.columns)
        for name, fields in selected.items()
    }
    no_reduction = Reduction(selection.downsampling)
    return tuple(
        contents.reductions.get(name, no_reduction).noted(table).noted(*notes)
        for name, table in made.items()
    )


def read_mat_arrays(path: Path) -> list[Arrays]:
    """The arrays of numbers of every episode: those of each struct, also in an array of structs, or
    the variables outside any. Raises FileError or ColumnError.
    """
    with reading(path, "MATLAB"):
        if is_plain_hdf5(path):
            return read_hdf5_arrays(path)
        contents = read_contents(path, Decimation(ALL_ROWS))
        tables = read_objects(path, find_objects(path))
    return [
        {
            name: np.asarray(values, dtype=float)
            for name, values in flat(episode)
            if isinstance(values, np.ndarray | np.number | float | int)
            and np.asarray(values).dtype.kind in "biuf"
        }
        for episode in episodes_of(dict(contents.variables) | tables)
    ]


def _remedy(unread: Sequence[MatlabObject]) -> str:
    """The commands of MATLAB that export the objects, and the package that reads tables."""
    if not unread:
        return "Save the measured columns as vectors, or as a struct with vectors."
    commands = "; ".join(
        f"{stored_object.name}: {stored_object.export}" for stored_object in unread
    )
    readable = any(stored_object.class_name in READABLE for stored_object in unread)
    package = (
        " Tables and timetables are also read with the package mat-io: pip install mat-io."
        if readable
        else ""
    )
    return f"Export in MATLAB: {commands}.{package}"


def _find_groups(name: str, fields: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """The structs with vectors by their dotted names; the variables outside any struct have the
    name ''.
    """
    signals = _simulink_signals(fields) if "time" in fields and "signals" in fields else None
    if signals is not None:
        yield name, signals
        return
    if any(map(_is_array, fields.values())):
        yield name, fields
    for key, value in fields.items():
        inner = f"{name}.{key}".lstrip(".")
        for i, element in enumerate(elements := _elements(value), 1):
            yield from _find_groups(f"{inner}({i})", element)
        if isinstance(value, Mapping) and not len(elements):
            yield from _find_groups(inner, value)


def _elements(value: Any) -> Sequence[Mapping[str, Any]]:
    """The structs of a struct array, of a cell array of structs, or of a struct of cell arrays;
    else none.
    """
    if isinstance(value, Mapping):
        cells = {name: cell for name, cell in value.items() if _is_cell(cell)}
        if any(map(_is_array, value.values())) or len({len(cell) for cell in cells.values()}) != 1:
            return ()
        return [
            {**value, **dict(zip(cells, run, strict=True))}
            for run in zip(*cells.values(), strict=True)
        ]
    return (
        value if _is_cell(value) and all(isinstance(element, Mapping) for element in value) else ()
    )


def _is_cell(value: Any) -> bool:
    """Whether a value is a cell array or a struct array of one dimension."""
    return isinstance(value, list) or (
        isinstance(value, np.ndarray) and value.dtype.kind == "O" and value.ndim == 1
    )


def _is_array(value: Any) -> bool:
    """Whether a value is a vector of several numbers, or a matrix."""
    numeric = isinstance(value, np.ndarray) and value.dtype.kind in "biuf"
    return numeric and (value.size > 1 if value.ndim == 1 else value.ndim == 2 and value.size > 0)


def _simulink_signals(fields: Mapping[str, Any]) -> dict[str, Any] | None:
    """The signals of the structure with time that Simulink saves; None for another struct with
    these fields.
    """
    signals = fields["signals"]
    if isinstance(signals, Mapping) and isinstance(
        signals.get("values"), list
    ):  # an array of structs, by field
        signals = [
            dict(zip(signals, field_values, strict=True))
            for field_values in zip(*signals.values(), strict=True)
        ]
    parts = (
        [signals]
        if isinstance(signals, Mapping)
        else list(signals)
        if isinstance(signals, Sequence)
        else []
    )
    if not parts or not all(isinstance(part, Mapping) and "values" in part for part in parts):
        return None
    named = {
        str(part.get("label") or f"signal {i}"): np.asarray(part["values"])
        for i, part in enumerate(parts, 1)
    }
    return {"time_s": fields["time"], **named}


def _scalar_fields(fields: Mapping[str, Any]) -> dict[str, float | str]:
    """The fields that are single numbers or texts."""
    return {
        name: value.item() if isinstance(value, np.generic) else value
        for name, value in fields.items()
        if isinstance(value, float | int | str | np.generic) and not isinstance(value, bool)
    }


def _make_table(
    origin: str,
    fields: Mapping[str, Any],
    constants: Mapping[str, float | str],
    columns: Sequence[str],
) -> RawTable:
    channels, notes = _of_one_length(origin, list(_channels(origin, fields)), columns)
    table = merge_channels(origin, channels, {**constants, **_scalar_fields(fields)})
    left_out = []
    for key, value in fields.items():
        if (
            isinstance(value, np.ndarray | list)
            and len(value) == len(table.rows)
            and not _is_array(value)
        ):
            is_complex = isinstance(value, np.ndarray) and value.dtype.kind == "c"
            kind = "texts" if all(isinstance(cell, str) for cell in value) else "cells"
            left_out.append(f"{key} ({'complex numbers' if is_complex else kind})")
    if left_out:
        notes = (*notes, f"Not read, because it contains no real numbers: {', '.join(left_out)}.")
    return table.noted(*notes)


def _of_one_length(
    origin: str, channels: list[Channel], columns: Sequence[str]
) -> tuple[list[Channel], tuple[str, ...]]:
    """The channels of the length of the mapped ones, or of the known quantities, and a note on the
    others. Raises ColumnError where the length remains open."""
    lengths = sorted({len(channel.values) for channel in channels})
    if len(lengths) < 2:
        return channels, ()
    mapped = [
        c for c in channels if c.name in columns or c.name.partition("[")[0].strip() in columns
    ]
    selected = {
        len(channel.values)
        for channel in mapped or [c for c in channels if parse_heading(c.name).known]
    }
    if len(selected) != 1:
        sizes = "; ".join(
            f"{length} rows: {', '.join(c.name for c in channels if len(c.values) == length)}"
            for length in lengths
        )
        raise ColumnError(
            f"{origin}: the vectors have different lengths ({sizes}). Name the columns of one"
            " length; the others are then not read.",
            hint=Hint(
                "To map a column",
                "columns",
                {f"{channels[0].name}": "time [s]"},
                function="ColumnMapping",
            ),
        )
    (length,) = selected
    left_out = [f"{c.name} ({len(c.values)} rows)" for c in channels if len(c.values) != length]
    note = (
        f"Not read, because their length differs from the {length} rows of the table:"
        f" {', '.join(left_out)}."
    )
    return [c for c in channels if len(c.values) == length], (note,)


def _lists_of_texts(values: Iterable[Any]) -> Iterator[list[str]]:
    """The lists of texts, which may name the columns of a matrix."""
    for value in values:
        is_array = isinstance(value, np.ndarray) and value.dtype.kind in "UO"
        entries = value.tolist() if is_array else value
        if isinstance(entries, list) and all(isinstance(text, str) for text in entries):
            yield [text.strip() for text in entries]


def _channels(origin: str, fields: Mapping[str, Any]) -> Iterator[Channel]:
    units_field = fields.get("units", fields.get("unit", {}))
    units = units_field if isinstance(units_field, Mapping) else {}
    columns = list(_lists_of_texts(fields.values()))
    for name, value in fields.items():
        if _is_array(value) and value.ndim == 1:
            yield Channel(name, value, unit=str(units.get(name, "")))
        elif _is_array(value):
            width = value.shape[1]
            # without a list of texts next to the matrix, expressions of MATLAB: `data(:,1)`
            indexed = [f"{name}(:,{j})" for j in range(1, width + 1)]
            names = next((headings for headings in columns if len(headings) == width), indexed)
            yield from (Channel(names[j], value[:, j]) for j in range(width))
        elif isinstance(value, np.ndarray) and value.ndim > 2:
            raise ColumnError(
                f"{origin}: '{name}' has {value.ndim} dimensions; a table has two. Save its columns"
                " separately."
            )

"""Reader of Parquet files: columns with their names and units."""

import contextlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ....core import Array, ColumnError
from ..tables import (
    STEPS,
    Arrays,
    Channel,
    RawTable,
    Selection,
    import_lab_package,
    merge_channels,
    reading,
)
from .lerobot import named_episodes


def read_parquet_tables(path: Path, selection: Selection = Selection()) -> tuple[RawTable, ...]:
    """Read the table of a Parquet file; the metadata `unit` of a column states its unit, that of
    the file constants. A Parquet file has no groups; the selection is not used. Raises FileError or
    ColumnError."""
    parquet = import_lab_package("pyarrow.parquet", path)
    with reading(path, "Parquet"):
        table = parquet.read_table(str(path))
        channels = [
            Channel(
                field.name,
                table.column(i).to_numpy(),
                unit=_text((field.metadata or {}).get(b"unit", b"")),
            )
            for i, field in enumerate(table.schema)
            if not field.name.startswith("__index_level_")
        ]
        metadata = {
            _text(name): _text(value) for name, value in (table.schema.metadata or {}).items()
        }
        constants = {
            name: _number(text)
            for name, text in metadata.items()
            if name not in ("pandas", "ARROW:schema")
        }
        return (merge_channels(path.name, channels, constants),)


def read_parquet_arrays(path: Path) -> list[Arrays]:
    """The columns of numbers as the arrays of one episode: of lists of one length with further
    dimensions, of structs, such as observations, with dotted names. Raises FileError or
    ColumnError.
    """
    pyarrow = import_lab_package("pyarrow", path)
    parquet = import_lab_package("pyarrow.parquet", path)
    with reading(path, "Parquet"):
        table = parquet.read_table(str(path))
        arrays: dict[str, Array] = {}
        for name in table.column_names:
            for part, column in _flat_columns(pyarrow, name, table.column(name)):
                values = _rows(pyarrow, path, part, column.combine_chunks())
                if values is not None:
                    arrays[part] = values
        return named_episodes(path, arrays)


def _flat_columns(pyarrow: Any, name: str, column: Any) -> Iterator[tuple[str, Any]]:
    """A column, or the columns of its fields."""
    if not pyarrow.types.is_struct(column.type):
        yield name.replace("/", ".").removeprefix(f"{STEPS}."), column
        return
    parts = column.flatten()
    for i in range(column.type.num_fields):
        field = column.type.field(i).name
        yield from _flat_columns(pyarrow, f"{name}.{field}", parts[i])


def _rows(pyarrow: Any, path: Path, name: str, column: Any) -> Array | None:
    """The numbers of a column (rows, ...); None for texts and other kinds."""
    types = pyarrow.types
    if types.is_dictionary(column.type):
        column = column.dictionary_decode()
    kind = column.type
    if types.is_boolean(kind) or types.is_integer(kind) or types.is_floating(kind):
        return np.asarray(column.to_numpy(zero_copy_only=False), dtype=float)
    if not (types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind)):
        return None
    inner = _rows(pyarrow, path, name, column.flatten())
    if inner is None:
        return None
    lengths = np.unique(pyarrow.compute.list_value_length(column).to_numpy(zero_copy_only=False))
    if len(lengths) > 1 or column.null_count:
        raise ColumnError(
            f"{path.name}: '{name}' is no array of numbers; its rows must have the same length."
        )
    return inner.reshape(len(column), *map(int, lengths), *inner.shape[1:])


def _number(text: str) -> float | str:
    """A constant in the metadata: a number, or a text, which `write` puts in quotation marks if it
    looks like one.
    """
    with contextlib.suppress(ValueError):
        return float(text)
    with contextlib.suppress(json.JSONDecodeError):
        if isinstance(value := json.loads(text), str):
            return value
    return text


def _text(value: Any) -> str:
    return value.decode("utf-8", errors="replace") if isinstance(value, bytes) else str(value)

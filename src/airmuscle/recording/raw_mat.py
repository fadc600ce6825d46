"""MATLAB files, v5 to v7.3: vectors of one length are a table, a struct of them is one too.

Also read: a matrix beside a list of texts that names its columns (`importdata` writes `data` and `colheaders`), and
what Simulink saves as a structure with time.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import ColumnError, FileError, suggestion
from .channels import Channel, merge_channels
from .optional_dependency import run_reader, import_lab_package
from .table import RawTable

_INTERNAL_NAMES = ("__header__", "__version__", "__globals__", "#refs#", "#subsystem#")


def read_mat_tables(path: Path, group: str | None = None) -> tuple[RawTable, ...]:
    """A table for each struct that holds vectors, and for those outside any, or for the one struct named."""
    pymatreader = import_lab_package("pymatreader", path)

    def read() -> Mapping[str, Any]:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # on objects it cannot read; what is missing then is said below
            return dict(pymatreader.read_mat(str(path)))

    variables = {name: value for name, value in run_reader(path, "MATLAB", read).items() if name not in _INTERNAL_NAMES}
    found = dict(_find_groups("", variables))
    if group is not None and group not in found:
        there = f"there are {', '.join(name or '(no struct)' for name in found)}.{suggestion(group, found)}"
        raise FileError(f"{path.name}: no struct '{group}' with vectors; {there}")
    chosen = found if group is None else {group: found[group]}
    if not chosen:
        raise FileError(
            f"{path.name}: no vector of numbers was found among {', '.join(variables) or 'no variables'}. Objects "
            "(timeseries, table) cannot be read: save vectors or a struct of them, or write the table as CSV."
        )
    constants = _scalar_fields(variables)
    return tuple(_make_table(path, name, fields, constants, len(found) > 1) for name, fields in chosen.items())


def _find_groups(name: str, fields: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """The structs with vectors by their dotted names, the variables outside any under ''."""
    if "time" in fields and "signals" in fields:
        yield name, _simulink_signals(fields)
        return
    if any(_is_vector(value) or _is_matrix(value) for value in fields.values()):
        yield name, fields
    for key, value in fields.items():
        if isinstance(value, Mapping):
            yield from _find_groups(f"{name}.{key}".lstrip("."), value)


def _is_vector(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind in "biuf" and value.size > 1


def _is_matrix(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.ndim == 2 and value.dtype.kind in "biuf" and min(value.shape) > 0


def _simulink_signals(fields: Mapping[str, Any]) -> dict[str, Any]:
    signals = fields["signals"]
    parts = signals if isinstance(signals, Sequence) else [signals]
    if isinstance(signals, Mapping) and isinstance(signals.get("values"), list):  # an array of structs, by fields
        parts = [dict(zip(signals, each, strict=True)) for each in zip(*signals.values(), strict=True)]
    named = {str(p.get("label") or f"signal {i}"): np.asarray(p["values"]) for i, p in enumerate(parts, 1)}
    return {"time_s": fields["time"], **named}


def _scalar_fields(fields: Mapping[str, Any]) -> dict[str, float | str]:
    """Single numbers and texts of the file."""
    return {
        name: value.item() if isinstance(value, np.generic) else value
        for name, value in fields.items()
        if isinstance(value, float | int | str | np.generic) and not isinstance(value, bool)
    }


def _make_table(
    path: Path, name: str, fields: Mapping[str, Any], constants: Mapping[str, float | str], several: bool
) -> RawTable:
    origin = f"{path.name}, {name or 'variables'}" if several else path.name
    channels = list(_channels(origin, fields))
    return merge_channels(origin, channels, {**constants, **_scalar_fields(fields)})


def _channels(origin: str, fields: Mapping[str, Any]) -> Iterator[Channel]:
    stated = fields.get("units", fields.get("unit", {}))
    units = stated if isinstance(stated, Mapping) else {}
    for name, value in fields.items():
        if _is_vector(value):
            yield Channel(name, value, unit=str(units.get(name, "")))
        elif _is_matrix(value):
            names = _column_names(name, value.shape[1], fields)
            yield from (Channel(names[j], value[:, j]) for j in range(value.shape[1]))
        elif isinstance(value, np.ndarray) and value.ndim > 2:
            raise ColumnError(f"{origin}: '{name}' has {value.ndim} dimensions; a table has two. Save columns of it.")


def _column_names(name: str, width: int, fields: Mapping[str, Any]) -> list[str]:
    """The names that a list of texts beside the matrix gives its columns, else MATLAB's own: `data(:,1)`."""
    for value in fields.values():
        texts = value.tolist() if isinstance(value, np.ndarray) and value.dtype.kind in "UO" else value
        if isinstance(texts, list) and len(texts) == width and all(isinstance(t, str) for t in texts):
            return [t.strip() for t in texts]
    return [f"{name}(:,{j})" for j in range(1, width + 1)]

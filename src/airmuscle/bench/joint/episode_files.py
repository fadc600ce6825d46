"""Reader of episodes: a folder with one file each, or one file for all, with what a mapping file says of them."""

from __future__ import annotations

import itertools
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...core.arrays import Array
from ...core.errors import ColumnError, FileError, suggestion
from ..readers.raw_csv import read_csv_table
from ..readers.separate_process import import_lab_package, run_reader
from .episode_mapping import Channels, EpisodeMapping, read_episode_mapping
from .episodes import Episode, Episodes, join, speed_of

Arrays = Mapping[str, Array]


def read_episodes(source: str | Path, mapping: str | Path | EpisodeMapping) -> Episodes:
    """Read the episodes of an arm from NPZ, CSV, JSON, HDF5 or Parquet files.

    source   one file, or a folder, whose files are read in the order of their names
    mapping  what the columns are, an EpisodeMapping or the path of a mapping file (TOML)

    A JSON file holds an object of lists, or a list of such objects, one for each episode. An HDF5 file holds arrays, or
    a group for each episode. Angles become radians, pressures Pa (or counts times their scale). Raises FileError for a
    file that cannot be read, ColumnError for a column that is missing, has other rows or is not finite.
    """
    path = Path(source)
    rules = mapping if isinstance(mapping, EpisodeMapping) else read_episode_mapping(mapping)
    files = sorted(each for each in path.iterdir() if each.suffix.lower() in READERS) if path.is_dir() else [path]
    if not files:
        raise FileError(f"{path}: the folder holds no file of episodes; supported are {', '.join(READERS)}.")
    return join([_episodes_of(each, rules) for each in files])


def _episodes_of(path: Path, mapping: EpisodeMapping) -> Episodes:
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise FileError(f"{path}: no format of episodes; supported are {', '.join(READERS)}.")
    tables = run_reader(path, path.suffix[1:].upper(), lambda: reader(path))
    runs, times = [], []
    for number, arrays in enumerate(tables):
        name = path.name if len(tables) == 1 else f"{path.name}, episode {number + 1}"
        whole, step = _episode(name, arrays, mapping)
        times.append(step)
        runs += _split(whole, arrays, mapping)
    return Episodes(tuple(runs), float(np.median(times)))


def _split(whole: Episode, arrays: Arrays, mapping: EpisodeMapping) -> list[Episode]:
    if mapping.starts is None:
        return [whole]
    starts = [int(row) for row in _array(whole.name, arrays, mapping.starts).ravel()]
    edges = sorted({*starts, len(whole)})
    return [
        Episode(
            whole.angle[a:b], whole.speed[a:b], whole.pressure[a:b],
            None if whole.command is None else whole.command[a:b], f"{whole.name}, episode {number}",
        )
        for number, (a, b) in enumerate(itertools.pairwise(edges), start=1)
    ]  # fmt: skip


def _episode(name: str, arrays: Arrays, mapping: EpisodeMapping) -> tuple[Episode, float]:
    """The rows of a table, and its sample time [s]."""
    angle = _columns(name, arrays, mapping.angles)
    pressure = _columns(name, arrays, mapping.pressures)
    if mapping.time is not None:
        time = _array(name, arrays, mapping.time).ravel()
        step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
        if not step > 0.0 or np.max(np.abs(np.diff(time) - step)) > 0.5 * step:
            raise ColumnError(
                f"{name}: the times of column '{mapping.time}' have gaps or do not rise; they must be uniform to half "
                "a row. Split the episode at its gaps, or state sample_time in the mapping file."
            )
    else:
        step = mapping.sample_time or 0.0
    speed = _columns(name, arrays, mapping.speeds) if mapping.speeds else speed_of(angle, step)
    command = _columns(name, arrays, mapping.commands) if mapping.commands else None
    for what, given in (("pressures", pressure), ("speeds", speed), ("commands", command)):
        if given is not None and len(given) != len(angle):
            raise ColumnError(f"{name}: {what} have {len(given)} rows, angles {len(angle)}; they must have as many.")
    return Episode(angle, speed, pressure, command, name), step


def _columns(name: str, arrays: Arrays, channels: Channels) -> Array:
    parts = [_array(name, arrays, column) for column in channels.columns]
    stacked = np.concatenate([part.reshape(len(part), -1) for part in parts], axis=1) * channels.scale
    if channels.divisors is not None:
        stacked = stacked / _array(name, arrays, channels.divisors).ravel()
    if not np.isfinite(stacked).all():
        row, column = np.argwhere(~np.isfinite(stacked))[0]
        raise ColumnError(
            f"{name}: row {row + 1} of {', '.join(channels.columns)} (column {column + 1}) is not a finite number; "
            "leave the episode out, or split it there."
        )
    return np.asarray(stacked, dtype=float)


def _array(name: str, arrays: Arrays, column: str) -> Array:
    if column not in arrays:
        raise ColumnError(f"{name}: no column '{column}'; there are {', '.join(arrays)}.{suggestion(column, arrays)}")
    return arrays[column]


def _numbers(path: Path, name: str, values: Any) -> Array:
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise ColumnError(f"{path}: '{name}' is no array of numbers; its rows must have the same length.") from None


def _read_npz(path: Path) -> list[Arrays]:
    with np.load(path, allow_pickle=False) as file:
        return [{n: np.asarray(file[n], dtype=float) for n in file.files if file[n].dtype.kind in "fiub"}]


def _read_json(path: Path) -> list[Arrays]:
    content = json.loads(path.read_text(encoding="utf-8"))
    tables = content if isinstance(content, list) else [content]
    if not tables or not all(isinstance(table, dict) for table in tables):
        raise FileError(f"{path}: an object of lists is expected, or a list of such objects, one for each episode.")
    return [{n: _numbers(path, n, v) for n, v in table.items() if isinstance(v, list)} for table in tables]


def _read_text(path: Path) -> list[Arrays]:
    table = read_csv_table(path)
    return [{n: c for n, c in zip(table.headings, table.columns, strict=True) if isinstance(c, np.ndarray)}]


def _read_hdf5(path: Path) -> list[Arrays]:
    h5py = import_lab_package("h5py", path)

    def arrays(group: Any) -> Arrays:
        return {
            n: np.asarray(d, dtype=float) for n, d in group.items() if hasattr(d, "dtype") and d.dtype.kind in "fiu"
        }

    with h5py.File(path) as file:
        groups = [file[name] for name in sorted(file) if not hasattr(file[name], "dtype")]
        return [arrays(group) for group in groups] if groups else [arrays(file)]


def _read_parquet(path: Path) -> list[Arrays]:
    table = import_lab_package("pyarrow.parquet", path).read_table(str(path))
    columns = {n: table.column(n).to_pylist() for n in table.column_names}
    return [{n: _numbers(path, n, v) for n, v in columns.items() if v and not isinstance(v[0], str)}]


READERS = {
    ".npz": _read_npz, ".json": _read_json, ".csv": _read_text, ".txt": _read_text, ".h5": _read_hdf5,
    ".hdf5": _read_hdf5, ".parquet": _read_parquet,
}  # fmt: skip
"""Readers by the extension; each returns the arrays of every episode in the file."""

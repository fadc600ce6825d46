"""Reader of episodes: a folder with one file or bag each, or one file for all, with what a mapping
file says of them:

sample_time = "10.46 ms"
starts = "start"

[angles]
columns = ["q1", "q2"]
unit = "deg"

[speeds]
columns = ["v1", "v2"]
scale = 10

[pressures]
columns = ["p1", "p2", "p3", "p4"]
scale = "1 Pa"
divisors = "count_divisors"

[commands]
columns = ["u1", "u2", "u3", "u4"]

[arm]
pairs = [[1, 2], [4, 3]]
axes = ["z", "-y"]
"""

import dataclasses
import itertools
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...core import Array, ColumnError, FileError, alternatives, check_known, counted, quantity
from ..readers import Arrays, read_toml
from .episode_formats import find_episode_files, read_arrays
from .episode_units import QUESTION, UNITS
from .episodes import Episode, Episodes, join, speed_of

TABLES = ("angles", "speeds", "pressures", "commands", "arm")
KEYS = ("sample_time", "time", "starts", *TABLES)
TABLE_KEYS = ("columns", "unit", "scale", "divisors")
AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}
AXES |= {f"+{name}": axis for name, axis in AXES.items()} | {
    f"-{n}": (-x, -y, -z) for n, (x, y, z) in AXES.items()
}
TIMES = ("t", "time", "stamp", "timestamp")
"""Names of columns of times, in seconds or a thousandth, millionth or billionth of them."""
SAME_TIME = 0.02
"""Difference of the decimal logarithms of two sample times, over 3, up to which they are the same
(chosen).
"""


@dataclasses.dataclass(frozen=True)
class Channels:
    """Columns of one quantity, or the name of one array with all of them; value = number * scale /
    divisors.
    """

    columns: tuple[str, ...]
    scale: float = 1.0
    divisors: str | None = None


@dataclasses.dataclass(frozen=True)
class EpisodeMapping:
    """Contents of a file of episodes, as its mapping file states them.

    sample_time  [s], or None if `time` names a column [s]; starts: array with the first row of
                 every episode, where a
    file holds all of them; angles, speeds, pressures, commands: Channels; pairs: for each joint the
    numbers, from 1, of the muscle that raises its angle and of its antagonist; axes of the joints
    in the frames of their links.
    """

    angles: Channels
    pressures: Channels
    speeds: Channels | None = None
    commands: Channels | None = None
    sample_time: float | None = None
    time: str | None = None
    starts: str | None = None
    pairs: tuple[tuple[int, int], ...] = ()
    axes: tuple[tuple[int, int, int], ...] = ()

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of all columns and arrays that are used."""
        quantities = (self.angles, self.pressures, self.speeds, self.commands)
        named = [
            name for channels in quantities if channels is not None for name in channels.columns
        ]
        return (*named, *(name for name in (self.time, self.starts) if name is not None))


def read_episode_mapping(path: str | Path) -> EpisodeMapping:
    """Read a mapping file (TOML). Raises FileError, which names the key and what is allowed."""
    path = Path(path)
    return mapping_of(read_toml(path), path)


def mapping_of(tables: Mapping[str, Any], path: object) -> EpisodeMapping:
    """The mapping in the tables of a mapping file; messages name its `path`. Raises FileError."""
    _check_keys(path, "", tables, KEYS)
    for name in ("angles", "pressures"):
        if name not in tables:
            raise FileError(
                f"{path}: no table [{name}]; name its columns: [{name}] columns = [...]."
            )
    if ("sample_time" in tables) == ("time" in tables):
        raise FileError(
            f'{path}: state either sample_time = "10 ms" or time = "name of the column of times'
            ' [s]".'
        )
    arm = tables.get("arm", {})
    step = tables.get("sample_time")
    _check_keys(path, "arm.", arm, ("pairs", "axes"))
    axes = arm.get("axes", ())
    for name in axes:
        if not isinstance(name, str) or name not in AXES:
            raise FileError(f"{path}: arm.axes holds '{name}'; allowed: {', '.join(AXES)}.")
    return EpisodeMapping(
        **{name: _channels(path, name, tables[name]) for name in TABLES[:4] if name in tables},
        sample_time=None if step is None else quantity(step, "s", where=f"{path}: sample_time"),
        time=tables.get("time"),
        starts=tables.get("starts"),
        pairs=_pairs(path, arm.get("pairs", ())),
        axes=tuple(AXES[name] for name in axes),
    )


def mapping_tables(mapping: EpisodeMapping) -> dict[str, Any]:
    """The tables of a mapping file, of which `mapping_of` makes this mapping; without the arm."""
    single = {
        name: getattr(mapping, name)
        for name in ("sample_time", "time", "starts")
        if getattr(mapping, name) is not None
    }
    quantities = {}
    for name in TABLES[:4]:
        channels: Channels | None = getattr(mapping, name)
        if channels is not None:
            divisors = {} if channels.divisors is None else {"divisors": channels.divisors}
            quantities[name] = {
                "columns": list(channels.columns),
                "scale": channels.scale,
                **divisors,
            }
    return {**single, **quantities}


def _check_keys(path: object, prefix: str, table: Any, known: tuple[str, ...]) -> None:
    if not isinstance(table, Mapping):
        raise FileError(
            f"{path}: {prefix.rstrip('.')} must be a table with the keys {', '.join(known)}."
        )
    for key in table:
        if key not in known:
            raise FileError(f"{path}: unknown key '{prefix}{key}'{alternatives(key, known)}")


def _channels(path: object, name: str, table: Any) -> Channels:
    _check_keys(path, f"{name}.", table, TABLE_KEYS)
    columns = table.get("columns")
    columns = (columns,) if isinstance(columns, str) else columns
    if (
        not isinstance(columns, list | tuple)
        or not columns
        or not all(isinstance(column, str) for column in columns)
    ):
        raise FileError(
            f'{path}: {name}.columns must be a name or a list of names, columns = ["q1", "q2"].'
        )
    allowed = UNITS.get(name, {})
    if table.get("unit") == QUESTION:
        raise FileError(
            f"{path}: the unit of the {name} is open. Write it in place of the question mark, one"
            f" of {', '.join(allowed)}; the comment beside it says which are possible."
        )
    if "unit" in table and table["unit"] not in tuple(allowed):
        raise FileError(
            f"{path}: {name}.unit is '{table['unit']}'; allowed: {', '.join(allowed) or 'none'}."
            " State other units as a number, scale."
        )
    factor = allowed[table["unit"]] if "unit" in table else 1.0
    target = "Pa" if name == "pressures" else "1"
    scale = quantity(table.get("scale", 1.0), target, where=f"{path}: {name}.scale")
    return Channels(tuple(columns), factor * scale, table.get("divisors"))


def _pairs(path: object, pairs: Any) -> tuple[tuple[int, int], ...]:
    is_list_of_pairs = isinstance(pairs, list | tuple) and all(
        isinstance(pair, list) and len(pair) == 2 for pair in pairs
    )
    flat = [muscle for pair in pairs for muscle in pair] if is_list_of_pairs else [None]
    if not all(isinstance(muscle, int) and muscle > 0 for muscle in flat) or len(set(flat)) < len(
        flat
    ):
        raise FileError(
            f"{path}: arm.pairs is {pairs}; give for each joint the numbers of two muscles, each"
            " muscle once: [[1, 2], [3, 4]], first the one that raises the angle."
        )
    return tuple((int(a), int(b)) for a, b in pairs)


def read_episodes(source: str | Path, mapping: str | Path | EpisodeMapping) -> Episodes:
    """Read the episodes of an arm from NPZ, CSV, JSON, HDF5 or Parquet files, ROS bags or RLDS-like
    steps.

    source   one file or bag, or a folder, whose files and bags are read in the order of their names
    mapping  what the columns are, an EpisodeMapping or the path of a mapping file (TOML)

    A JSON file holds an object of lists, or a list of such objects, one for each episode (.jsonl:
    one in each line). An HDF5 file holds arrays, or a group for each episode. Steps with an
    observation and an action are one episode with columns `observation.angle` and so on; so is a
    bag, with columns `joint_states.position.elbow` and so on. Angles become radians, pressures Pa
    (or counts times their scale). Raises FileError for a file that cannot be read, ColumnError for
    a column that is missing, has other rows or is not finite.
    """
    path = Path(source)
    rules = mapping if isinstance(mapping, EpisodeMapping) else read_episode_mapping(mapping)
    files = find_episode_files(path)
    episodes = join([_episodes_of(file, rules) for file in files])
    kinds = sorted({file.suffix or "bags" for file in files})
    count = (
        f"{counted(len(episodes), 'episode')} from {counted(len(files), 'file')}"
        f" ({', '.join(kinds)})"
    )
    return dataclasses.replace(episodes, notes=(count, *episodes.notes))


def _episodes_of(path: Path, mapping: EpisodeMapping) -> Episodes:
    tables, notes = read_arrays(path, mapping.sample_time, mapping.columns)
    runs = []
    times = []
    for number, arrays in enumerate(tables):
        name = path.name if len(tables) == 1 else f"{path.name}, episode {number + 1}"
        record, step = _episode(name, arrays, mapping)
        times.append(step)
        runs += _split(record, arrays, mapping, step)
    known = (
        mapping.speeds is not None
        or mapping.time is not None
        or all(_times(arrays) for arrays in tables)
    )
    return Episodes(tuple(runs), float(np.median(times)), notes, known)


def _split(record: Episode, arrays: Arrays, mapping: EpisodeMapping, step: float) -> list[Episode]:
    if mapping.starts is None:
        return [record]
    marks = _array(record.name, arrays, mapping.starts).ravel()
    flags = len(marks) == len(record) and bool(np.isin(marks, (0, 1)).all())
    starts = np.flatnonzero(marks) if flags else marks
    if (
        not len(starts)
        or np.any(starts != starts.astype(int))
        or np.any(np.diff([*starts, len(record) + 0.5]) <= 0.0)
    ):
        raise ColumnError(
            f"{record.name}: starts, column '{mapping.starts}', must be the first rows of the"
            f" episodes, from 0, whole and rising below {len(record)} rows, or 1 in these rows and"
            " 0 elsewhere."
        )
    edges = [*(int(row) for row in starts if row < len(record)), len(record)]
    runs = []
    for number, (a, b) in enumerate(itertools.pairwise(edges), start=1):
        angle = record.angle[a:b]
        command = None if record.command is None else record.command[a:b]
        speed = record.speed[a:b] if mapping.speeds else speed_of(angle, step)
        runs.append(
            Episode(angle, speed, record.pressure[a:b], command, f"{record.name}, episode {number}")
        )
    return runs


def _episode(name: str, arrays: Arrays, mapping: EpisodeMapping) -> tuple[Episode, float]:
    """The rows of a table, and its sample time [s]."""
    angle = _columns(name, arrays, mapping.angles)
    pressure = _columns(name, arrays, mapping.pressures)
    if mapping.time is not None:
        time = _array(name, arrays, mapping.time).ravel()
        step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
        if not step > 0.0 or np.max(np.abs(np.diff(time) - step)) > 0.5 * step:
            raise ColumnError(
                f"{name}: the times of column '{mapping.time}' have gaps or do not rise; they must"
                " be uniform to half a row. Split the episode at its gaps, or state sample_time in"
                " the mapping file."
            )
    else:
        step = mapping.sample_time or 0.0
        for column in _times(arrays):  # in whatever unit it is
            ratio = float(np.median(np.diff(arrays[column].ravel()))) / step
            if ratio > 0.0 and abs(np.log10(ratio) / 3 - round(np.log10(ratio) / 3)) > SAME_TIME:
                raise ColumnError(
                    f"{name}: column '{column}' advances by {ratio * step:.4g} in a row, the"
                    " mapping file states a "
                    f"sample time of {1e3 * step:.4g} ms. Correct sample_time, or state time ="
                    f' "{column}" [s] in its '
                    "place."
                )
    speed = _columns(name, arrays, mapping.speeds) if mapping.speeds else speed_of(angle, step)
    command = _columns(name, arrays, mapping.commands) if mapping.commands else None
    for what, readings in (("pressures", pressure), ("speeds", speed), ("commands", command)):
        if readings is not None and len(readings) != len(angle):
            raise ColumnError(
                f"{name}: {what} have {len(readings)} rows, angles {len(angle)}; they must have as"
                " many."
            )
    return Episode(angle, speed, pressure, command, name), step


def _times(arrays: Arrays) -> list[str]:
    return [name for name in arrays if name.lower() in TIMES and arrays[name].size > 1]


def _columns(name: str, arrays: Arrays, channels: Channels) -> Array:
    parts = [_array(name, arrays, column) for column in channels.columns]
    if not all(part.ndim and part.size for part in parts):
        raise ColumnError(
            f"{name}: {', '.join(channels.columns)} has no row; leave the episode out."
        )
    stacked = (
        np.concatenate([part.reshape(len(part), -1) for part in parts], axis=1) * channels.scale
    )
    if channels.divisors is not None:
        stacked = stacked / _array(name, arrays, channels.divisors).ravel()
    if not np.isfinite(stacked).all():
        row, column = np.argwhere(~np.isfinite(stacked))[0]
        raise ColumnError(
            f"{name}: row {row + 1} of {', '.join(channels.columns)} (column {column + 1}) is not a"
            " finite number; leave the episode out, or split it there."
        )
    return np.asarray(stacked, dtype=float)


def _array(name: str, arrays: Arrays, column: str) -> Array:
    check_known(f"{name}: no column", column, arrays, error=ColumnError)
    return arrays[column]

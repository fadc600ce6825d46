"""Mapping file of episodes: which array or column is what, in which unit and scale.

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

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...core.errors import FileError, suggestion
from ...core.units import quantity
from ..readers.file_kind import read_toml

TABLES = ("angles", "speeds", "pressures", "commands", "arm")
KEYS = ("sample_time", "time", "starts", *TABLES)
TABLE_KEYS = ("columns", "unit", "scale", "divisors")
AXES = {
    sign + name: axis for name, axis in zip("xyz", ((1, 0, 0), (0, 1, 0), (0, 0, 1)), strict=True) for sign in ("", "+")
}
AXES |= {f"-{name}": (-AXES[name][0], -AXES[name][1], -AXES[name][2]) for name in "xyz"}
ANGLES = {"rad": 1.0, "deg": 0.017453292519943295}


@dataclasses.dataclass(frozen=True)
class Channels:
    """Columns of one quantity, or the name of one array with all of them; value = number * scale / divisors."""

    columns: tuple[str, ...]
    scale: float = 1.0
    divisors: str | None = None


@dataclasses.dataclass(frozen=True)
class EpisodeMapping:
    """Contents of a file of episodes, as its mapping file states them.

    sample_time  [s], or None if `time` names a column [s]; starts: array with the first row of every episode, where a
    file holds all of them; angles, speeds, pressures, commands: Channels; pairs: for each joint the numbers, from 1, of
    the muscle that raises its angle and of its antagonist; axes of the joints in the frames of their links.
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


def read_episode_mapping(path: str | Path) -> EpisodeMapping:
    """Read a mapping file (TOML). Raises FileError, which names the key and what is allowed."""
    path = Path(path)
    tables = read_toml(path)
    _check_keys(path, "", tables, KEYS)
    for name in ("angles", "pressures"):
        if name not in tables:
            raise FileError(f"{path}: no table [{name}]; name its columns: [{name}] columns = [...].")
    if ("sample_time" in tables) == ("time" in tables):
        raise FileError(f'{path}: state either sample_time = "10 ms" or time = "name of the column of times [s]".')
    arm = tables.get("arm", {})
    _check_keys(path, "arm.", arm, ("pairs", "axes"))
    return EpisodeMapping(
        **{name: _channels(path, name, tables[name]) for name in TABLES[:4] if name in tables},
        sample_time=quantity(tables["sample_time"], "s", where=f"{path}: sample_time")
        if "sample_time" in tables
        else None,
        time=tables.get("time"),
        starts=tables.get("starts"),
        pairs=_pairs(path, arm.get("pairs", ())),
        axes=tuple(_axis(path, name) for name in arm.get("axes", ())),
    )


def _check_keys(path: Path, prefix: str, table: Any, known: tuple[str, ...]) -> None:
    if not isinstance(table, Mapping):
        raise FileError(f"{path}: {prefix.rstrip('.')} must be a table with the keys {', '.join(known)}.")
    for key in table:
        if key not in known:
            raise FileError(
                f"{path}: unknown key '{prefix}{key}'; there are {', '.join(known)}.{suggestion(key, known)}"
            )


def _channels(path: Path, name: str, table: Any) -> Channels:
    _check_keys(path, f"{name}.", table, TABLE_KEYS)
    columns = table.get("columns")
    columns = (columns,) if isinstance(columns, str) else columns
    if not isinstance(columns, list | tuple) or not columns or not all(isinstance(column, str) for column in columns):
        raise FileError(f'{path}: {name}.columns must be a name or a list of names, columns = ["q1", "q2"].')
    unit = table.get("unit", "rad")
    if name == "angles" and unit not in ANGLES:
        raise FileError(f'{path}: angles.unit is \'{unit}\'; it must be "rad" or "deg".')
    factor = ANGLES[unit] if name in ("angles", "speeds") and unit in ANGLES else 1.0
    target = "Pa" if name == "pressures" else "1"
    scale = quantity(table.get("scale", 1.0), target, where=f"{path}: {name}.scale")
    return Channels(tuple(columns), factor * scale, table.get("divisors"))


def _pairs(path: Path, pairs: Any) -> tuple[tuple[int, int], ...]:
    flat = [m for pair in pairs for m in (pair if isinstance(pair, list) else [pair])]
    if any(not isinstance(pair, list) or len(pair) != 2 for pair in pairs) or len(set(flat)) < len(flat):
        raise FileError(
            f"{path}: arm.pairs is {pairs}; give for each joint the numbers of two muscles, each muscle once: "
            "[[1, 2], [3, 4]], first the one that raises the angle."
        )
    return tuple((int(a), int(b)) for a, b in pairs)


def _axis(path: Path, name: Any) -> tuple[int, int, int]:
    if name not in AXES:
        raise FileError(f"{path}: arm.axes holds '{name}'; allowed: {', '.join(AXES)}.")
    return AXES[name]

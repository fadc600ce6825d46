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
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...core import ColumnError, FileError, alternatives, counted, quantity
from ..readers import Arrays, read_toml
from .episode_formats import find_episode_files, read_arrays
from .episode_mapping import Channels, EpisodeMapping, array_of, columns_of
from .episode_pieces import pieces_of
from .episode_units import QUESTION, UNITS
from .episodes import Episode, Episodes, join, speed_of

TABLES = ("angles", "speeds", "pressures", "commands", "arm")
KEYS = ("sample_time", "time", "starts", "rests", *TABLES)
TABLE_KEYS = ("columns", "unit", "scale", "divisors")
AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}
AXES |= {f"+{name}": axis for name, axis in AXES.items()} | {
    f"-{n}": (-x, -y, -z) for n, (x, y, z) in AXES.items()
}
COMMANDED = (
    "commands stand for pressures, which were not recorded: the lag of each muscle contains that of"
    " its regulator, and commands must be levels of the pressures and no increments"
)
LENGTHS = ("m", "cm", "mm", "um", "in")
"""Units of positions, which are no angles."""
TIMES = ("t", "time", "stamp", "timestamp")
"""Names of columns of times, in seconds or a thousandth, millionth or billionth of them."""
SAME_TIME = 0.02
"""Difference of the decimal logarithms of two sample times, over 3, up to which they are the same
(chosen).
"""


def read_episode_mapping(path: str | Path) -> EpisodeMapping:
    """Read a mapping file (TOML). Raises FileError, which names the key and what is allowed."""
    path = Path(path)
    return mapping_of(read_toml(path), path)


def mapping_of(tables: Mapping[str, Any], path: object) -> EpisodeMapping:
    """The mapping in the tables of a mapping file; messages name its `path`. Raises FileError."""
    _check_keys(path, "", tables, KEYS)
    for name in ("angles", "pressures"):
        if name not in tables and not (name == "pressures" and "commands" in tables):
            raise FileError(
                f"{path}: no table [{name}]; name its columns: [{name}] columns = [...]."
                " Where pressures were not recorded, [commands] alone stand for them."
            )
    if "sample_time" not in tables and "time" not in tables:
        raise FileError(
            f'{path}: state either sample_time = "10 ms" or time = "name of the column of times'
            ' [s]", or both, to interpolate the rows to the sample time.'
        )
    rests = tables.get("rests")
    if rests is not None and "starts" in tables:
        raise FileError(f"{path}: starts and rests exclude each other; leave one of them out.")
    arm = tables.get("arm", {})
    step = tables.get("sample_time")
    _check_keys(path, "arm.", arm, ("pairs", "axes"))
    axes = arm.get("axes", ())
    for name in axes:
        if not isinstance(name, str) or name not in AXES:
            raise FileError(f"{path}: arm.axes holds '{name}'; allowed: {', '.join(AXES)}.")
    channels = {name: _channels(path, name, tables[name]) for name in TABLES[:4] if name in tables}
    from_commands = "pressures" not in channels
    if from_commands:
        channels["pressures"] = channels.pop("commands")
    return EpisodeMapping(
        **channels,
        from_commands=from_commands,
        rests=None if rests is None else quantity(rests, "s", where=f"{path}: rests"),
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
        for name in ("sample_time", "time", "starts", "rests")
        if getattr(mapping, name) is not None
    }
    quantities = {}
    for name in TABLES[:4]:
        channels: Channels | None = getattr(mapping, name)
        if channels is not None:
            stands = mapping.from_commands and name == "pressures"
            divisors = {} if channels.divisors is None else {"divisors": channels.divisors}
            quantities["commands" if stands else name] = {
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
    if name == "angles" and table.get("unit") in LENGTHS:
        raise FileError(
            f"{path}: angles.unit is '{table['unit']}': a position is no angle. Divide it by the"
            " lever arm about the joint: without unit, scale = 20 reads metres at an arm of 50 mm"
            " as rad, scale = 0.02 millimetres."
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
    stands = [COMMANDED] if rules.from_commands else []
    return dataclasses.replace(episodes, notes=(count, *stands, *episodes.notes))


def _episodes_of(path: Path, mapping: EpisodeMapping) -> Episodes:
    tables, notes = read_arrays(path, mapping.sample_time, mapping.columns)
    runs = []
    times = []
    said = list(notes)
    for number, arrays in enumerate(tables):
        name = path.name if len(tables) == 1 else f"{path.name}, episode {number + 1}"
        pieces, remarks = pieces_of(name, arrays, mapping)
        said += remarks
        for piece_name, piece in pieces:
            run, step = _episode(piece_name, piece, mapping)
            runs.append(run)
            times.append(step)
    known = (
        mapping.speeds is not None
        or mapping.time is not None
        or all(_times(arrays) for arrays in tables)
    )
    return Episodes(tuple(runs), float(np.median(times)), tuple(said), known)


def _episode(name: str, arrays: Arrays, mapping: EpisodeMapping) -> tuple[Episode, float]:
    """The rows of a table, and its sample time [s]."""
    angle = columns_of(name, arrays, mapping.angles)
    pressure = columns_of(name, arrays, mapping.pressures)
    step = _step(name, arrays, mapping)
    speed = command = None
    if mapping.speeds is not None:
        speed = columns_of(name, arrays, mapping.speeds)
    if mapping.commands is not None:
        command = columns_of(name, arrays, mapping.commands)
    for what, readings in (("pressures", pressure), ("speeds", speed), ("commands", command)):
        if readings is not None and len(readings) != len(angle):
            raise ColumnError(
                f"{name}: {what} have {len(readings)} rows, angles {len(angle)}; they must have as"
                " many."
            )
    if speed is None:
        speed = speed_of(angle, step)
    return Episode(angle, speed, pressure, command, name), step


def _step(name: str, arrays: Arrays, mapping: EpisodeMapping) -> float:
    """The sample time [s] of a table with even rows."""
    if mapping.time is not None:
        times = array_of(name, arrays, mapping.time).ravel()
        return mapping.sample_time or float(np.median(np.diff(times)))
    step = mapping.sample_time or 0.0
    for column in _times(arrays):  # in whatever unit it is
        ratio = float(np.median(np.diff(arrays[column].ravel()))) / step
        if ratio > 0.0 and abs(np.log10(ratio) / 3 - round(np.log10(ratio) / 3)) > SAME_TIME:
            raise ColumnError(
                f"{name}: column '{column}' advances by {ratio * step:.4g} in a row, the mapping"
                f" file states a sample time of {1e3 * step:.4g} ms. Correct sample_time, or state"
                f' time = "{column}" [s] beside it: rows are then interpolated to it.'
            )
    return step


def _times(arrays: Arrays) -> list[str]:
    return [name for name in arrays if name.lower() in TIMES and arrays[name].size > 1]

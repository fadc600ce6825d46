"""Files of episodes: one file or bag for each, or one for all, of every format of the readers, and
the proposal of a mapping file.

An array inside another table has a dotted name: the steps of an RLDS episode have
`observation.angle` and `action`, the messages of a bag `joint_states.position.elbow`. A row of an
array is a step.
"""

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from ...core import Array, ColumnError, FileError
from ...recording import read_heading
from ..readers import (
    EPISODE_EXTENSIONS,
    TEXT,
    Arrays,
    Selection,
    arrays_of_table,
    dataset_files,
    format_of,
    is_dataset,
)
from .episode_inspection import TURN
from .episode_units import QUESTION, UNITS

METADATA = "metadata.yaml"
MAX_GAP = 5.0
"""Greatest interval of two messages of a bag, in rows, that is interpolated (chosen)."""
TFRECORD = (
    "TFRecord files are not read. Write each episode with the package that made them:"
    " numpy.savez('1.npz', **{'observation.angle': angles, 'action': actions}), one array (rows,"
    " columns) for each quantity."
)


def find_episode_files(path: Path) -> list[Path]:
    """The files and bags of a folder by name, or the path itself if it is a file or a bag. Raises
    FileError.
    """
    if not path.is_dir() or _is_bag(path):
        return [path]
    if is_dataset(path):
        return dataset_files(path)
    files = sorted(entry for entry in path.iterdir() if _is_episode(entry))
    if not files:
        steps = any(".tfrecord" in entry.name for entry in path.iterdir())
        raise FileError(
            f"{path}: {TFRECORD if steps else f'the folder holds no file of episodes; {FORMATS}'}"
        )
    return files


def _is_episode(path: Path) -> bool:
    named = path.suffix.lower() in EPISODE_EXTENSIONS and not path.name.startswith(".")
    return (named and path.is_file()) or _is_bag(path)


def _is_bag(path: Path) -> bool:
    return path.is_dir() and (path / METADATA).exists()


def read_arrays(
    path: Path, sample_time: float | None = None, columns: Sequence[str] = ()
) -> tuple[list[Arrays], tuple[str, ...]]:
    """The arrays of every episode in a file or a bag, which is interpolated to multiples of the
    sample time [s] or its median interval, and notes on their reading. Of a bag, the messages of
    the `columns` decide which rows there are. Raises FileError or ColumnError.
    """
    if _is_bag(path) or path.suffix.lower() == ".bag":
        return _read_bag(path, sample_time, columns)
    if ".tfrecord" in path.name:
        raise FileError(f"{path}: {TFRECORD}")
    form = format_of(path)
    if form is TEXT and path.suffix.lower() not in EPISODE_EXTENSIONS:
        raise FileError(f"{path}: no format of episodes; {FORMATS}")
    return form.read_arrays(path), ()


def _read_bag(
    path: Path, sample_time: float | None, mapped: Sequence[str]
) -> tuple[list[Arrays], tuple[str, ...]]:
    file = path
    if not path.is_file():
        file = min(entry for entry in path.iterdir() if entry.suffix in (".db3", ".mcap"))
    (table,) = format_of(file).read_tables(file, Selection(columns=tuple(mapped)))
    columns = arrays_of_table(table)
    time = columns.pop("time", np.zeros(0))
    intervals = np.diff(time)
    median = float(np.median(intervals)) if len(intervals) else 0.0
    step = sample_time or median
    longest = float(np.max(intervals, initial=0.0))
    if not step > 0.0 or longest > MAX_GAP * max(step, median):
        raise ColumnError(
            f"{path.name}: {len(time)} rows, with up to {longest:.3g} s between two messages; an"
            " episode needs messages without a gap. Split the bag there, or leave it out."
        )
    grid = step * np.arange(int((time[-1] - time[0]) / step + 1e-6) + 1)
    uneven = 1e3 * float(np.ptp(intervals))
    note = (
        f"{path.name}: intervals of messages differ by {uneven:.2g} ms; rows are interpolated to"
        f" {1e3 * step:.4g} ms"
    )
    arrays: dict[str, Array] = {"time": np.asarray(grid, dtype=np.float64)}
    for name, column in columns.items():
        arrays[name] = np.interp(grid, time - time[0], column)
    notes = (*table.notes, note) if uneven > 100.0 * step else table.notes
    return [arrays], tuple(notes)


FORMATS = f"supported are {', '.join(EPISODE_EXTENSIONS)}, and folders of ROS 2 bags."


# Proposal of a mapping file, from the names and the sizes of the arrays

ROLES = {
    "divisors": "divisors",
    "commands": (
        "u command commands cmd action actions setpoint setpoints desired target reference valve"
    ),
    "pressures": "p pressure pressures counts",
    "speeds": "v dq qd speed speeds velocity velocities vel omega",
    "angles": "q angle angles position positions pos theta phi",
    "time": "t time stamp timestamp",
    "starts": "start starts first begin",
}
"""Words in the names of arrays, by what they contain; the first role whose word a name has."""
STEP_WORDS = {"sample", "time", "dt", "step", "period"}
"""Words in the name of a single number that is the sample time [s]."""
USUAL_PRESSURES = (2e4, 2e6)
"""Range of the greatest pressure of a record [Pa] in which a unit is possible (chosen)."""
SIZES_OF_UNITS = 3000.0
"""Numbers above which pressures are in Pa, or counts (chosen)."""
PRESSURE_UNITS = {"bar": 1e5, "kPa": 1e3, "MPa": 1e6, "psi": 6894.757293168361}
"""Units of pressures that are offered [Pa]."""
ROLES_OF_QUANTITIES = {
    "pressure": "pressures",
    "setpoint": "commands",
    "angle": "angles",
    "angular_speed": "speeds",
    "time": "time",
}
"""Roles of the quantities that the words of a name state."""


def propose_mapping(source: str | Path) -> str:
    """Text of a mapping file for a record, to be corrected by its user; its comments state what it
    is guessed from.

    Raises FileError or ColumnError for a record that cannot be read.
    """
    path = find_episode_files(Path(source))[0]
    arrays = read_arrays(path)[0][0]
    names_by_role = {
        role: [n for n, a in arrays.items() if _role(n) == role and a.size > 1] for role in ROLES
    }
    lines = [
        f"# arrays of the record: {', '.join(f'{n} {tuple(a.shape)}' for n, a in arrays.items())}"
    ]
    if _is_bag(path) or path.suffix == ".bag":
        interval = 1e3 * float(arrays["time"][1])
        lines.append(
            f'sample_time = "{interval:.2g} ms"  # of the messages, which are interpolated to it'
        )
    else:
        lines.append(
            f'time = "{names_by_role["time"][0]}"'
            if names_by_role["time"]
            else _sample_time(arrays, names_by_role)
        )
    lines += [f'starts = "{names_by_role["starts"][0]}"'] if names_by_role["starts"] else []
    for role in ("angles", "speeds", "pressures", "commands"):
        if names_by_role[role] or role in ("angles", "pressures"):
            columns = json.dumps(names_by_role[role] or ["name the columns"])
            lines += ["", f"[{role}]", f"columns = {columns}", *_scale(role, names_by_role, arrays)]
    return "\n".join(lines) + "\n"


def _role(name: str) -> str:
    """The role of an array by the words in its name."""
    words = set(re.findall("[a-z]+", name.lower()))
    for role, known in ROLES.items():
        if words & set(known.split()):
            return role
    reading = read_heading(name.rpartition(".")[2])
    if reading is None:
        return ""
    return ROLES_OF_QUANTITIES.get(reading.quantity, "")


def _unit_in_names(names: Sequence[str]) -> str:
    """The unit that all names of arrays state, `wrist_angle_deg`; empty if they state none."""
    units = set[str]()
    for name in names:
        reading = read_heading(name.rpartition(".")[2])
        units.add("" if reading is None else reading.unit or "")
    return units.pop() if len(units) == 1 else ""


def _size(names: Iterable[str], arrays: Arrays) -> float:
    return max(
        (float(np.quantile(np.abs(arrays[n]), 0.99)) for n in names if arrays[n].size), default=0.0
    )


def _sample_time(arrays: Arrays, names_by_role: Mapping[str, list[str]]) -> str:
    """The step with which the angles move as fast as the speeds say."""
    for name, array in arrays.items():
        if array.size == 1 and STEP_WORDS & set(re.findall("[a-z]+", name.lower())):
            return f'sample_time = "{1e3 * float(array.ravel()[0]):.6g} ms"  # {name} of the record'
    angles, speeds = (
        (
            np.concatenate(
                [arrays[n].reshape(len(arrays[n]), -1) for n in names_by_role[role]], axis=1
            )
            if names_by_role[role]
            else np.zeros((1, 0))
        )
        for role in ("angles", "speeds")
    )
    if not angles.size or angles.shape != speeds.shape or len(angles) < 3:
        return 'sample_time = "10 ms"  # not in the record: state it'
    middle = speeds[1:-1]
    step = np.median(
        np.sum((angles[2:] - angles[:-2]) * middle, axis=0) / np.sum(2.0 * middle**2, axis=0)
    )
    return (
        f'sample_time = "{1e3 * step:.4g} ms"  # with which the angles move as fast as the speeds:'
        " check it"
    )


def _scale(role: str, names_by_role: Mapping[str, list[str]], arrays: Arrays) -> list[str]:
    stated = _unit_in_names(names_by_role[role])
    if stated in UNITS.get(role, {}):
        return [f'unit = "{stated}"  # by the names']
    if role in ("angles", "speeds"):
        unit = "deg" if _size(names_by_role["angles"], arrays) > TURN else "rad"
        return [f'unit = "{unit}"  # guessed from the size of the angles']
    if role == "commands":
        return []
    divisors = [f'divisors = "{name}"' for name in arrays if _role(name) == "divisors"]
    return [*divisors, _unit_of_pressures(_size(names_by_role[role], arrays))]


def _unit_of_pressures(size: float) -> str:
    """The line for the unit of pressures of a size: a question where several are possible."""
    if size >= SIZES_OF_UNITS:
        return 'scale = "1 Pa"  # guessed from the size; counts need the pressure of one count'
    low, high = USUAL_PRESSURES
    possible = [unit for unit, factor in PRESSURE_UNITS.items() if low <= size * factor <= high]
    if len(possible) == 1:
        return f'unit = "{possible[0]}"  # guessed: no other unit gives a usual pressure'
    offered = possible or list(PRESSURE_UNITS)
    return f'unit = "{QUESTION}"  # {" or ".join(offered)}? the numbers reach {size:.3g}'

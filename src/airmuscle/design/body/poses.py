"""Poses of a body: grids and Sobol sequences over the ranges of joints, and tables of poses and
motions as CSV.
"""

import csv
import itertools
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...core import Array, FileError, UnitError, check_known, quantity, quotable
from .body import Body
from .kinematics import Poses

GRID_POINTS = {0: 1, 1: 1001, 2: 101, 3: 25}
"""Points of each joint in a grid, by the number of joints (chosen); more joints have a Sobol
sequence."""
SOBOL_POINTS = 2**13
"""Points of a Sobol sequence (chosen)."""
MOST_CORNERS = 10
"""Greatest number of joints all corners of whose ranges are added to a Sobol sequence (chosen)."""
MAX_ROWS = 200_000
"""Greatest number of rows of a table of poses (chosen)."""
TIME = "time"
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d*,\d+(?:[eE][+-]?\d+)?\s*")
_HEADING = re.compile(r"\s*(?P<name>[^\[\]]+?)\s*(?:\[(?P<unit>[^\[\]]*)\])?\s*\Z")


def swept_poses(body: Body, joints: Sequence[str]) -> Poses:
    """Poses over the ranges of joints: a grid of up to three, else a Sobol sequence with the
    corners.
    """
    ranges = [(body.joints[name].low, body.joints[name].high) for name in joints]
    count = len(joints)
    if count in GRID_POINTS:
        axes = [np.linspace(low, high, GRID_POINTS[count]) for low, high in ranges]
        mesh = np.meshgrid(*axes, indexing="ij") if axes else [np.zeros(1)]
        positions = np.stack([axis.ravel() for axis in mesh], axis=1)
        return Poses(tuple(joints), positions if axes else np.zeros((1, 0)))
    positions = sobol_points(ranges, SOBOL_POINTS)
    if count <= MOST_CORNERS:
        corners = np.array(list(itertools.product(*ranges)))
        positions = np.concatenate([positions, corners])
    return Poses(tuple(joints), positions)


def sobol_points(ranges: Sequence[tuple[float, float]], count: int) -> Array:
    """Points (N, J) of an unscrambled Sobol sequence within ranges; `count` a power of 2."""
    from scipy.stats import qmc

    sampler = qmc.Sobol(len(ranges), scramble=False)
    unit = sampler.random_base2(round(math.log2(count)))
    low, high = np.transpose(ranges)
    return np.asarray(low + unit * (high - low))


class PoseTable(NamedTuple):
    """Poses of a file, with their times [s] (N,), None without a column of times."""

    poses: Poses
    time: Array | None


def read_poses(path: Path, body: Body, *, needs_time: bool = False) -> PoseTable:
    """The poses of a CSV file with a column 'knee [deg]' of each joint, and 'time [s]' of a motion.

    A heading without a unit is in rad, m or s. Raises FileError.
    """
    rows = read_table_of_numbers(path)
    heading, *lines = rows
    names = []
    factors = []
    for number, text in enumerate(heading, 1):
        name, unit = named_heading(text, f"{path}: heading {number}")
        if name != TIME:
            check_known(f"{path}: there is no joint", [name], body.joints)
        is_hinge = name != TIME and body.joints[name].is_hinge
        target = "s" if name == TIME else "rad" if is_hinge else "m"
        factors.append(factor_of(unit or target, target, f"{path}: heading {quotable(text)!r}"))
        names.append(name)
    if len(set(names)) < len(names):
        raise FileError(f"{path}: two columns have the same name.")
    values = numbers_of(path, lines, len(names)) * np.array(factors)
    columns = [column for column, name in enumerate(names) if name != TIME]
    poses = Poses(tuple(names[column] for column in columns), values[:, columns])
    if TIME not in names:
        if needs_time:
            raise FileError(f"{path}: a motion needs a column 'time [s]'.")
        return PoseTable(poses, None)
    time = values[:, names.index(TIME)]
    if needs_time and (len(time) < 4 or not (np.diff(time) > 0.0).all()):
        raise FileError(f"{path}: a motion needs at least four rows with increasing times.")
    return PoseTable(poses, np.asarray(time))


def read_table_of_numbers(path: Path) -> list[list[str]]:
    """The rows of a CSV file, the heading first, without empty ones, read by `separated_rows`.
    Raises FileError.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = []
            for row in separated_rows(file):
                if any(cell.strip() for cell in row):
                    rows.append(row)
                if len(rows) > MAX_ROWS:
                    raise FileError(f"{path}: has more than {MAX_ROWS} rows.")
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or error
        raise FileError(f"{path}: cannot be read as CSV: {reason}.") from None
    if len(rows) < 2:
        raise FileError(f"{path}: needs a heading and at least one row of numbers.")
    return rows


def separated_rows(lines: Iterable[str]) -> Iterator[list[str]]:
    """The rows of text whose heading is separated by commas, semicolons or tabulators; with the
    latter two a number may have a decimal comma, as spreadsheets of many countries write it.
    """
    lines = itertools.dropwhile(lambda line: not line.strip(), lines)
    heading = next(lines, "")
    separator = next((mark for mark in ";\t" if mark in heading), ",")
    rows = csv.reader(itertools.chain([heading], lines), delimiter=separator)
    if separator == ",":
        yield from rows
        return
    for row in rows:
        yield [cell.replace(",", ".") if _DECIMAL_COMMA.fullmatch(cell) else cell for cell in row]


def numbers_of(path: Path, lines: list[list[str]], width: int) -> Array:
    """The numbers of rows (N, width). Raises FileError with the row."""
    values = np.empty((len(lines), width))
    for number, line in enumerate(lines):
        if len(line) != width:
            raise FileError(
                f"{path}: row {number + 2} has {len(line)} cells; the heading has {width}."
            )
        for column, cell in enumerate(line):
            try:
                values[number, column] = float(cell)
            except ValueError:
                values[number, column] = math.nan
        if not np.isfinite(values[number]).all():
            raise FileError(
                f"{path}: row {number + 2} contains {quotable(','.join(line))!r}; all cells must be"
                " finite numbers, with a decimal point."
            )
    return values


def named_heading(text: str, where: str) -> tuple[str, str]:
    """Name and unit of a heading."""
    match = _HEADING.match(text)
    if match is None:
        raise FileError(f"{where} is {quotable(text)!r}; write it as 'knee [deg]'.")
    return match["name"], (match["unit"] or "").strip()


def factor_of(unit: str, target: str, where: str) -> float:
    """Factor from a unit to another one. Raises FileError."""
    try:
        return quantity(f"1 {unit}", target, where=where)
    except UnitError as error:
        raise FileError(str(error)) from None

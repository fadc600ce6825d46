"""Pairs of runs of one specimen that measured the same pressures and contractions in the same
direction of motion.

The force of each row is taken relative to a polynomial of degree 3 in pressure and contraction,
fitted to all rows of the specimen, so that the distance of two matched rows does not count. Rows of
different directions are not matched: their difference is hysteresis.
"""

import dataclasses
import functools
import itertools
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import Array
from ...recording import Recording
from ...recording.columns import quantity_of
from ..estimation import specimen_name
from ..inspection import POINT_COLUMNS, branch_directions, find_branches, find_runs, merged_readings

PRESSURE_REACH = 0.015
CONTRACTION_REACH = 0.004
"""Maximum distance of matched rows: in pressure, as a fraction of the highest, and in contraction
(chosen).
"""
MIN_MATCHES = 5
MIN_BRANCH_ROWS = 5
"""Minimum numbers of matched rows of two runs, and of rows of a branch (chosen)."""
MAX_ROWS = 4000
MAX_BLOCKS = 80
"""Maximum numbers of rows and of runs of a specimen that are matched (chosen)."""
NEIGHBOURS = 4
SPREAD_NEIGHBOURS = 9
"""Number of nearest rows of one block that are compared, with the row itself (chosen); of rows of
which no two have one place also those at the next pressures."""
MIN_SPREAD_ROWS = 30
"""Minimum number of rows without time of which no two have one place, and neighbours are compared
(chosen).
"""
MIN_FORCE = 0.02
"""Minimum force of a matched row, as a fraction of the maximum (chosen); slack rows agree in any
case.
"""
MAX_VALUES = 8
"""Maximum number of values of a column that may tell specimens apart (chosen)."""
DEGREE = 3


@dataclasses.dataclass(frozen=True, eq=False)
class Block:
    """Rows of one run in one direction: recording, row numbers in it, direction, and values of its
    unknown columns.
    """

    recording: Recording
    rows: npt.NDArray[np.intp]
    direction: int
    labels: Mapping[str, float]
    residuals: Array
    """Force minus that of the polynomial [N]."""
    slopes: Array
    """Derivative of the polynomial by the pressure [N/Pa]."""

    @property
    def points(self) -> Array:
        """Pressure [Pa] and contraction of the rows, shape (N, 2)."""
        return np.column_stack(
            [self.recording[name][self.rows] for name in ("pressure", "contraction")]
        )


@dataclasses.dataclass(frozen=True, eq=False)
class MatchedRuns:
    """Two blocks with the indices of matched rows."""

    first: Block
    second: Block
    pairs: npt.NDArray[np.intp]
    """Indices of the matched rows in both blocks, shape (M, 2)."""
    are_near: bool = True
    """Whether the matched rows are at equal pressure and contraction; otherwise they are
    neighbouring static points, and the polynomial accounts for their distance."""

    @functools.cached_property
    def differences(self) -> Array:
        """The force of the first block minus that of the second at the matched rows [N], shape
        (M,).
        """
        return self.first.residuals[self.pairs[:, 0]] - self.second.residuals[self.pairs[:, 1]]

    @property
    def forces(self) -> tuple[Array, Array]:
        """The forces of the matched rows in the first and in the second block [N], shape (M,)
        each.
        """
        i, j = self.pairs.T
        a, b = (self.first, self.second)
        return a.recording["force"][a.rows[i]], b.recording["force"][b.rows[j]]

    @property
    def is_unordered(self) -> bool:
        """Whether the rows are of one block without time, so that the direction of the motion is
        not known.
        """
        return self.first is self.second

    @property
    def typical(self) -> float:
        """The median difference of the force [N]; of rows of one block, whose signs are random, the
        upper quartile.
        """
        if self.is_unordered:
            return float(np.quantile(np.abs(self.differences), 0.75))
        return float(np.median(self.differences))


class Matches(NamedTuple):
    """All matched runs of a bench, and its maximum force [N]."""

    runs: tuple[MatchedRuns, ...]
    greatest: float


def match_rows(recordings: Sequence[Recording], *, by_branch: bool = False) -> Matches:
    """The matched runs of recordings with pressure, contraction and force, by specimen; with
    `by_branch` each branch of a run is matched with its other branches of the same direction,
    too."""
    complete = [
        run for run in recordings if len(run) and all(name in run for name in POINT_COLUMNS)
    ]
    greatest = max((float(np.nanquantile(run["force"], 0.99)) for run in complete), default=0.0)
    if not greatest > 0:
        return Matches((), 0.0)
    names = [specimen_name(run) for run in complete]
    matched: list[MatchedRuns] = []
    for name in dict.fromkeys(names):
        members = [run for run, specimen in zip(complete, names, strict=True) if specimen == name]
        step = -(-sum(map(len, members)) // MAX_ROWS)
        blocks = [
            block
            for run in members
            for block in _blocks_of(run, MIN_FORCE * greatest, step, by_branch)
        ]
        usable = [block for block in blocks if len(block.rows) >= MIN_MATCHES][:MAX_BLOCKS]
        matched += _matched_runs(_with_residuals(usable), members)
    return Matches(tuple(matched), greatest)


def _blocks_of(recording: Recording, least: float, step: int, by_branch: bool) -> Iterator[Block]:
    """The blocks of a recording: rows of one run, direction and combination of labels; every n-th
    row.
    """
    complete = np.isfinite(np.stack([recording[name] for name in POINT_COLUMNS])).all(axis=0)
    recording = recording if complete.all() else recording.rows(complete)
    pulls = recording["force"] > least
    branches = tuple(b for b in find_branches(recording) if len(b.interval) >= MIN_BRANCH_ROWS)
    keys = [branch_directions(recording, branches), np.full(len(recording), -1.0)]
    for i, run in enumerate(find_runs(recording)):
        keys[1][run.interval.rows] = i
    for i, branch in enumerate(branches if by_branch else ()):
        keys[1][branch.interval.rows] += 1e3 * (i + 1)
    unknown = {
        name: values for name, values in recording.columns.items() if quantity_of(name) is None
    }
    labelling = {
        name: merged_readings(values)
        for name, values in unknown.items()
        if 2 <= np.unique(merged_readings(values)).size <= MAX_VALUES
    }
    keys += labelling.values()
    values, member = np.unique(np.stack(keys), axis=1, return_inverse=True)
    for i, key in enumerate(values.T):
        rows = np.flatnonzero((member.ravel() == i) & pulls)[::step]
        labels = dict(zip(labelling, key[2:].tolist(), strict=True))
        yield Block(recording, rows, int(key[0]), labels, np.zeros(0), np.zeros(0))


def _with_residuals(blocks: list[Block]) -> list[Block]:
    """The blocks with residuals and slopes of the polynomial of all their rows."""
    if not blocks:
        return []
    columns = ([block.recording[name][block.rows] for block in blocks] for name in POINT_COLUMNS)
    p, c, force = map(np.concatenate, columns)
    scale = max(float(np.max(np.abs(p))), 1.0)
    low = float(np.min(c))
    high = float(np.max(c))
    x = p / scale
    y = (c - low) / max(high - low, 1e-6)
    powers = [(i, j) for i in range(DEGREE + 1) for j in range(DEGREE + 1 - i)]
    values = np.linalg.lstsq(
        np.stack([x**i * y**j for i, j in powers], axis=1), force, rcond=1e-10
    )[0]
    residuals = force - sum(v * x**i * y**j for v, (i, j) in zip(values, powers, strict=True))
    slopes = (
        sum(v * i * x ** max(i - 1, 0) * y**j for v, (i, j) in zip(values, powers, strict=True))
        / scale
    )
    ends = np.cumsum([len(block.rows) for block in blocks])[:-1]
    parts = zip(blocks, np.split(residuals, ends), np.split(slopes, ends), strict=True)
    return [dataclasses.replace(block, residuals=r, slopes=s) for block, r, s in parts]


def _matched_runs(blocks: Sequence[Block], recordings: Sequence[Recording]) -> list[MatchedRuns]:
    """Every pair of blocks of one direction with enough matched rows."""
    highest = max(float(np.nanmax(np.abs(run["pressure"]), initial=0.0)) for run in recordings)
    reach = np.array([PRESSURE_REACH * max(highest, 1.0), CONTRACTION_REACH])
    points = [block.points / reach for block in blocks]
    limits = [(x.min(axis=0) - 1.0, x.max(axis=0) + 1.0) for x in points]
    without_time = [
        pair for pair in zip(blocks, points, strict=True) if "time" not in pair[0].recording
    ]
    within = [
        _within(block, scaled, NEIGHBOURS, 1.0)
        for block, scaled in without_time
        if len(scaled) >= NEIGHBOURS
    ]
    matched = [pair for pair in within if len(pair.pairs) >= MIN_MATCHES]
    for i, j in itertools.combinations(range(len(blocks)), 2):
        apart = (limits[i][0] > limits[j][1]).any() or (limits[j][0] > limits[i][1]).any()
        if not apart and blocks[i].direction == blocks[j].direction:
            pairs = _nearest_of_fewer(points[i], points[j])
            if len(pairs) >= MIN_MATCHES:
                matched.append(MatchedRuns(blocks[i], blocks[j], pairs))
    return [*matched, *_spread(blocks)]


def _spread(blocks: Sequence[Block]) -> Iterator[MatchedRuns]:
    """The pairs of neighbouring rows of recordings without time, whatever their runs and their
    distance.
    """
    parts: dict[int, list[Block]] = {}
    for block in blocks:
        if "time" not in block.recording:
            parts.setdefault(id(block.recording), []).append(block)
    for group in parts.values():
        joined = [
            np.concatenate([getattr(block, n) for block in group])
            for n in ("rows", "residuals", "slopes")
        ]
        if len(joined[0]) >= MIN_SPREAD_ROWS:
            block = Block(group[0].recording, joined[0], 0, {}, *joined[1:])
            spread = block.points / np.maximum(np.ptp(block.points, axis=0), 1e-9)
            yield _within(block, spread, SPREAD_NEIGHBOURS, np.inf)


def _within(block: Block, points: Array, count: int, reach: float) -> MatchedRuns:
    """The rows of a block, at these scaled points (N, 2), with their nearest ones; near with a
    finite reach.
    """
    pairs = _nearest(points, points, count, reach)
    return MatchedRuns(block, block, pairs[pairs[:, 0] != pairs[:, 1]], bool(np.isfinite(reach)))


def _nearest_of_fewer(first: Array, second: Array) -> npt.NDArray[np.intp]:
    """Each of the fewer points, (N, 2) and (M, 2), with the nearest of the more; indices in both,
    shape (K, 2). Which of them are the first has no effect."""
    of_first = (len(first), *np.sum(first, axis=0).tolist())
    of_second = (len(second), *np.sum(second, axis=0).tolist())
    if of_first <= of_second:
        return _nearest(first, second, 1, 1.0)
    return _nearest(second, first, 1, 1.0)[:, ::-1]


def _nearest(points: Array, candidates: Array, count: int, reach: float) -> npt.NDArray[np.intp]:
    """Each point (N, 2) with the nearest ones of others within the reach; indices of shape (M,
    2).
    """
    from scipy.spatial import cKDTree

    distance, index = cKDTree(candidates).query(
        points, range(1, count + 1), distance_upper_bound=reach
    )
    first, place = np.nonzero(np.isfinite(distance))
    return np.column_stack([first, index[first, place]])

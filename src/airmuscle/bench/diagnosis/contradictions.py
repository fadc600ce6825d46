"""Contradictions: runs of one specimen whose forces differ at equal pressure, contraction and
direction of motion, also in two groups as of two muscles in one file; rows in two recordings, as
where files overlap, which are one measurement.
"""

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...core import AMBIENT_PRESSURE, Hint, HintedText, listed
from ...recording import Recording
from ..inspection import distinct_readings, magnitude, rounding, true_intervals
from .bench_rows import file_list
from .matched_rows import Block, MatchedRuns, Matches

MIN_ROWS = 10
"""Minimum number of successive equal rows that are one measurement, or all rows of a shorter
recording (chosen: the rounded readings of two measurements agree in single rows)."""
MIN_LEVELS = 3
"""Minimum number of different values of the force in these rows (chosen)."""
_FACTORS = (1.0, 1.2345678912345e6, 1.3247179572447e3)
"""Factors of the columns in the sum by which equal rows are searched; without a common divisor."""
_CELL = 1e-8
_CELL_OFFSET = 0.381966
"""Width of the cells whose numbers are summed, as a fraction of the maximum, and the place of their
edges, which is no round number (chosen): equal rows but for rounding have equal numbers."""


class RepeatedRows(NamedTuple):
    """Successive rows of a recording, by its index, that another one has already."""

    recording: int
    rows: slice
    origins: tuple[str, str]

    def __str__(self) -> str:
        count = self.rows.stop - self.rows.start
        here, there = self.origins
        return f"{count} rows of {here} are also in {there}; they are counted once."


def find_repeated_rows(
    recordings: Sequence[Recording], columns: Sequence[str]
) -> tuple[RepeatedRows, ...]:
    """The stretches of rows whose columns are equal, but for rounding, to those of successive rows
    of another recording. Those of the later recording are given. Equal rows within one recording
    are not searched."""
    if len(recordings) < 2:
        return ()
    least = [
        max((rounding(name, run[name]) for run in recordings), default=0.0) for name in columns
    ]
    repeated = []
    for here, there, offset in _candidates(recordings, columns):
        later = recordings[here]
        earlier_run = recordings[there]
        first = max(offset, 0)
        last = min(len(later), len(earlier_run) + offset)
        rows = slice(first, last)
        earlier = slice(first - offset, last - offset)
        same = np.logical_and.reduce(
            [
                np.abs(later[name][rows] - earlier_run[name][earlier]) <= tolerance
                for name, tolerance in zip(columns, least, strict=True)
            ]
        )
        for stretch in true_intervals(same):
            rows = slice(first + stretch.start, first + stretch.stop)
            is_long = len(stretch) >= min(MIN_ROWS, len(later), len(earlier_run))
            if is_long and distinct_readings(later["force"][rows]).size >= MIN_LEVELS:
                repeated.append(RepeatedRows(here, rows, (later.origin, earlier_run.origin)))
    return tuple(repeated)


def _candidates(
    recordings: Sequence[Recording], columns: Sequence[str]
) -> Iterator[tuple[int, int, int]]:
    """Pairs of recordings (later, earlier) and the offset of their rows at which several rows have
    one weighted sum.
    """
    cells = {
        name: _CELL * max((magnitude(name, run[name]) for run in recordings), default=0.0) or 1.0
        for name in columns
    }
    keys = [
        np.add.reduce(
            [
                factor * np.floor(run[name] / cells[name] + _CELL_OFFSET)
                for factor, name in zip(_FACTORS, columns, strict=True)
            ]
        )
        for run in recordings
    ]
    row = np.concatenate([np.arange(key.size) for key in keys])
    run = np.repeat(np.arange(len(keys)), [key.size for key in keys])
    joined = np.concatenate(keys)
    order = np.argsort(joined, kind="stable")
    joined = joined[order]
    run = run[order]
    row = row[order]
    equal = np.flatnonzero((joined[1:] == joined[:-1]) & (run[1:] > run[:-1]))
    if equal.size < MIN_LEVELS:
        return
    pairs = np.stack([run[equal + 1], run[equal], row[equal + 1] - row[equal]])
    candidates, counts = np.unique(pairs, axis=1, return_counts=True)
    yield from candidates[:, counts >= MIN_LEVELS].T.tolist()


MIN_DIFFERENCE = 0.04
"""Median difference of two runs that contradict each other, as a fraction of the maximum force
(chosen).
"""
UNORDERED_DIFFERENCE = 0.05
"""The same where the direction of the motion is not known (chosen); the remark then names
hysteresis, too.
"""
MAX_HYSTERESIS = 0.15
"""The same of two runs of which neither shows a direction, which may be hysteresis (chosen)."""
MIN_RMS = 0.03
"""Minimum root mean square of the differences of all matched runs, as a fraction of the maximum
force (chosen).
"""
HYSTERESIS = " Without time the direction of the motion is not known: it may be hysteresis."
SHIFT_TOLERANCE = 0.3
"""Relative tolerance of a shift of the pressure that is that of the atmosphere (chosen)."""


def repeatability(matches: Matches) -> float | None:
    """The standard deviation of the force of a run from that of another at equal pressure,
    contraction and direction [N]; None where no runs overlap."""
    squares = [
        float(np.mean(runs.differences**2)) for runs in matches.runs if not runs.is_unordered
    ]
    return float(np.sqrt(np.mean(squares) / 2.0)) if squares else None


def contradiction_notes(matches: Matches) -> list[str]:
    """The remark that runs contradict each other, with its cause; empty if they do not."""
    differing = [runs for runs in matches.runs if _differ(runs, matches.greatest)]
    contradicting = [runs for runs in differing if runs.are_near] or differing
    if not contradicting or _rms_difference(matches) < MIN_RMS * matches.greatest:
        return []
    return [_contradiction(contradicting, matches)]


def _differ(runs: MatchedRuns, greatest: float) -> bool:
    """Whether two runs differ by more than their hysteresis may be, at this maximum force [N]."""
    if runs.is_unordered:
        share = UNORDERED_DIFFERENCE
    else:
        share = MIN_DIFFERENCE if runs.first.direction else MAX_HYSTERESIS
    return bool(abs(runs.typical) > share * greatest)


def _rms_difference(matches: Matches) -> float:
    squares = [np.mean(runs.differences**2) for runs in matches.runs]
    return float(np.sqrt(np.mean(squares)))


def _contradiction(contradicting: Sequence[MatchedRuns], matches: Matches) -> HintedText:
    """The remark on contradicting runs, with an example and the cause."""
    typical = float(np.median([abs(runs.typical) for runs in contradicting]))
    worst = max(contradicting, key=lambda runs: abs(runs.typical))
    unordered = all(runs.is_unordered for runs in contradicting)
    who = "rows" if unordered else f"{len(contradicting)} of {len(matches.runs)} pairs of runs"
    at_one_place = all(runs.are_near for runs in contradicting)
    where = (
        "at equal pressure and contraction"
        if at_one_place
        else "apart from a smooth dependence on both quantities"
    )
    text = (
        f"Rows contradict each other: {where} the forces of {who} differ by {typical:.3g} N "
        f"(median), which no law can follow. {_example(worst)}"
    )
    return HintedText(text, *_cause(contradicting, matches), HYSTERESIS if unordered else "")


def _example(runs: MatchedRuns) -> str:
    """The matched rows whose difference is the median one, as a sentence."""
    i, j = runs.pairs[int(np.argmin(np.abs(np.abs(runs.differences) - abs(runs.typical))))]
    rows = (
        (runs.first.recording, int(runs.first.rows[i])),
        (
            runs.second.recording,
            int(runs.second.rows[j]),
        ),
    )
    texts = [
        f"{run.origin}, row {row + 1}: {run['force'][row]:.4g} N at"
        f" {run['pressure'][row] / 1e3:.4g} kPa and {100 * run['contraction'][row]:.3g} %"
        for run, row in rows
    ]
    return f"For example {'; '.join(texts)}."


def _cause(contradicting: Sequence[MatchedRuns], matches: Matches) -> list[str | Hint]:
    """The cause and the remedy, as far as the contradictions show them."""
    chosen = {id(runs) for runs in contradicting}
    for column in contradicting[0].first.labels:
        differs = {
            id(runs)
            for runs in matches.runs
            if runs.first.labels.get(column) != runs.second.labels.get(column)
        }
        if not chosen <= differs or len(differs - chosen) > 0.5 * len(differs):
            continue  # its values do not differ in all contradicting pairs, or in many others
        mapped = {re.sub(r"\s*[\[(].*", "", column): "specimen"}
        return [
            (
                f" Column '{column}' tells the contradicting rows apart: it probably names the"
                " specimen."
            ),
            Hint("To state it as the specimen", "columns", mapped, "ColumnMapping"),
            " Fit each specimen by itself, or at least three together with --compare.",
        ]
    # The error of the pressure of the first block that would explain the differences.
    slopes = [np.maximum(runs.first.slopes[runs.pairs[:, 0]], 1e-12) for runs in contradicting]
    shifts = -np.array(
        [np.median(runs.differences / s) for runs, s in zip(contradicting, slopes, strict=True)]
    )
    if np.mean(np.abs(np.abs(shifts) / AMBIENT_PRESSURE - 1.0) < SHIFT_TOLERANCE) > 0.5:
        pairs = zip(contradicting, shifts, strict=True)
        names = [
            (runs.first if shift > 0 else runs.second).recording.origin for runs, shift in pairs
        ]
        return [
            f" A pressure of one atmosphere, {AMBIENT_PRESSURE / 1e3:.4g} kPa, explains the"
            f" difference: the pressures of {file_list(names)} are probably absolute. State their"
            " unit in the heading, 'kPa(a)'."
        ]
    return [
        " Check whether these runs are of one muscle, with the same zeros, units and resting"
        " length, and leave out what is not."
    ]


MIN_GROUPED = 4
MIN_GAP = 3.0
"""Minimum number of runs that are divided; gap of the groups in standard deviations of the runs of
a group (chosen).
"""
MAX_PLACES = 80
"""Characters of the recordings of a group that are named (chosen)."""


class TwoGroups(NamedTuple):
    """Blocks of two levels of force, the lower one first, their relative difference, and the
    scatter within.
    """

    sides: tuple[list[Block], list[Block]]
    difference: float
    scatter: float


def two_muscle_notes(matches: Matches) -> list[str]:
    """The remark that the runs fall into two groups, as those of two muscles do; empty if they do
    not. A drift has no gap between two levels. Hysteresis, and friction that grows with the speed,
    raise the force of one direction of the motion and lower that of the other, so that both
    directions must give the same groups; static points must differ by more than hysteresis."""
    runs = [pair for pair in matches.runs if not pair.is_unordered]
    is_static = all(pair.first.direction == 0 for pair in runs)
    directions, least = ((0,), MAX_HYSTERESIS) if is_static else ((1, -1), MIN_DIFFERENCE)
    groups = [
        _two_groups([pair for pair in runs if pair.first.direction == direction], least)
        for direction in directions
    ]
    divided = [pair for pair in groups if pair is not None]
    if len(divided) < len(directions) or not all(_agree(divided[0], pair) for pair in divided[1:]):
        return []
    difference = min(pair.difference for pair in divided)
    scatter = max(pair.scatter for pair in divided)
    sides = (_places([block for pair in divided for block in pair.sides[i]]) for i in (0, 1))
    text = (
        f"The runs fall into two groups: their forces differ by {100 * difference:.2g} % at equal"
        f" pressure and contraction, and agree to {100 * scatter:.2g} % within a group"
        f" ({'; '.join(sides)}). Are they two muscles, or has the muscle or a zero changed between"
        " them? "
    )
    purpose = "To fit each muscle by itself, write its name in a column, and"
    return [HintedText(text, Hint(purpose, "columns", {"muscle": "specimen"}, "ColumnMapping"))]


def _two_groups(runs: Sequence[MatchedRuns], least: float) -> TwoGroups | None:
    """The two levels of force of runs; None unless a gap wider than `least` and three times the
    scatter divides them. The levels, of mean zero where matched rows connect them, solve the
    relative differences by least squares.
    """
    blocks = list({id(b): b for pair in runs for b in (pair.first, pair.second)}.values())
    if len(blocks) < MIN_GROUPED:
        return None
    number = {id(block): i for i, block in enumerate(blocks)}
    matrix = np.zeros((len(runs), len(blocks)))
    ratios = np.zeros(len(runs))
    for i, pair in enumerate(runs):
        ratios[i] = 2.0 * np.median(pair.differences / sum(pair.forces))
        matrix[i, [number[id(pair.first)], number[id(pair.second)]]] = 1.0, -1.0
    levels = np.linalg.lstsq(matrix, ratios, rcond=1e-10)[0]
    order = np.argsort(levels)
    gaps = np.diff(levels[order])
    low, high = np.split(order, [int(np.argmax(gaps)) + 1])
    means = float(levels[low].mean()), float(levels[high].mean())
    scatter = float(np.sqrt(np.mean(np.r_[levels[low] - means[0], levels[high] - means[1]] ** 2)))
    if min(low.size, high.size) < 2 or gaps.max() < max(least, MIN_GAP * scatter):
        return None
    return TwoGroups(
        ([blocks[i] for i in low], [blocks[i] for i in high]), means[1] - means[0], scatter
    )


def _agree(first: TwoGroups, second: TwoGroups) -> bool:
    """Whether the higher group is the later one, or the only one, of the same recordings in both
    directions.
    """
    orders = []
    for groups in (first, second):
        rows: dict[int, tuple[list[float], list[float]]] = {}
        for higher, side in enumerate(groups.sides):
            for block in side:
                rows.setdefault(id(block.recording), ([-1.0], [-1.0]))[higher].append(
                    float(np.mean(block.rows))
                )
        orders.append({key: max(high) > max(low) for key, (low, high) in rows.items()})
    common = orders[0].keys() & orders[1].keys()
    return bool(common) and sum(orders[0][key] == orders[1][key] for key in common) >= 0.8 * len(
        common
    )


def _places(blocks: Sequence[Block]) -> str:
    """The recordings of blocks, with the range of their rows."""
    rows: dict[str, list[int]] = {}
    for block in blocks:
        rows.setdefault(block.recording.origin, []).extend(
            (int(block.rows[0]) + 1, int(block.rows[-1]) + 1)
        )
    return listed(
        [f"{name} rows {min(ends)} to {max(ends)}" for name, ends in rows.items()], MAX_PLACES
    )

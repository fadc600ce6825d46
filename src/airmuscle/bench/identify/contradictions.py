"""Contradictions: runs of one specimen whose forces differ at equal pressure, contraction and direction of motion; rows
that occur in two recordings, as where files overlap, which are one measurement."""

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...core import AMBIENT_PRESSURE, Array, Hint, HintedText
from ...recording import Recording
from ..checks.bench_rows import file_list
from ..segment.interval import true_intervals
from .matched_rows import Block, MatchedRuns, Matches

MIN_ROWS = 10
"""Minimum number of successive equal rows that are one measurement, or all rows of a shorter recording (chosen: the
rounded readings of two measurements agree in single rows)."""
MIN_LEVELS = 3
"""Minimum number of different values of the force in these rows (chosen)."""
_FACTORS = (1.0, 1.2345678912345e6, 1.3247179572447e3)
"""Factors of the columns in the sum by which equal rows are searched; without a common divisor."""


class RepeatedRows(NamedTuple):
    """Successive rows of a recording that another one has already, by the indices of the recordings."""

    recording: int
    rows: slice
    of: int
    origins: tuple[str, str]

    def __str__(self) -> str:
        count, (here, there) = self.rows.stop - self.rows.start, self.origins
        return f"{count} rows of {here} are also in {there}; they are counted once."


def find_repeated_rows(recordings: Sequence[Recording], columns: Sequence[str]) -> tuple[RepeatedRows, ...]:
    """The stretches of rows whose columns are equal, digit by digit, to those of successive rows of another recording.

    Those of the later recording are given. Equal rows within one recording are not searched.
    """
    if len(recordings) < 2:
        return ()
    keys = [_keys(run, columns) for run in recordings]
    found = []
    for here, there, offset in _candidates(keys):
        one, other = recordings[here], recordings[there]
        stretches = _equal_stretches(one, other, offset, columns)
        found += [RepeatedRows(here, rows, there, (one.origin, other.origin)) for rows in stretches]
    return tuple(found)


def _keys(run: Recording, columns: Sequence[str]) -> Array:
    """A number for each row, which equal rows have in common; term by term, so that it is equal to the last digit."""
    keys = np.zeros(len(run))
    for factor, name in zip(_FACTORS, columns, strict=True):
        keys += factor * run[name]
    return keys


def _candidates(keys: Sequence[Array]) -> Iterator[tuple[int, int, int]]:
    """Pairs of recordings (later, earlier) and the offset of their rows at which several keys are equal."""
    row = np.concatenate([np.arange(key.size) for key in keys])
    run = np.repeat(np.arange(len(keys)), [key.size for key in keys])
    joined = np.concatenate(keys)
    order = np.argsort(joined, kind="stable")
    joined, run, row = joined[order], run[order], row[order]
    equal = np.flatnonzero((joined[1:] == joined[:-1]) & (run[1:] > run[:-1]))
    if equal.size < MIN_LEVELS:
        return
    pairs = np.stack([run[equal + 1], run[equal], row[equal + 1] - row[equal]])
    found, counts = np.unique(pairs, axis=1, return_counts=True)
    yield from found[:, counts >= MIN_LEVELS].T.tolist()


def _equal_stretches(here: Recording, there: Recording, offset: int, columns: Sequence[str]) -> Iterator[slice]:
    """The stretches of rows of a recording that equal those of another one by this many rows earlier."""
    first, last = max(offset, 0), min(len(here), len(there) + offset)
    same = np.ones(last - first, dtype=bool)
    for name in columns:
        same &= here[name][first:last] == there[name][first - offset : last - offset]
    needed = min(MIN_ROWS, len(here), len(there))
    for stretch in true_intervals(same):
        rows = slice(first + stretch.start, first + stretch.stop)
        if len(stretch) >= needed and np.unique(here["force"][rows]).size >= MIN_LEVELS:
            yield rows


MIN_DIFFERENCE = 0.04
"""Median difference of two runs that contradict each other, as a fraction of the maximum force (chosen)."""
UNORDERED_DIFFERENCE = 0.05
"""The same where the direction of the motion is not known (chosen); the remark then names hysteresis, too."""
MAX_HYSTERESIS = 0.15
"""The same of two runs of which neither shows a direction, which may be hysteresis (chosen)."""
MIN_RMS = 0.03
"""Minimum root mean square of the differences of all matched runs, as a fraction of the maximum force (chosen)."""
HYSTERESIS = " Without time the direction of the motion is not known: it may be hysteresis."
SHIFT_TOLERANCE = 0.3
"""Relative tolerance of a shift of the pressure that is that of the atmosphere (chosen)."""


def repeatability(matches: Matches) -> float | None:
    """The standard deviation of the force of a run from that of another at equal pressure, contraction and direction
    [N]; None where no runs overlap."""
    squares = [float(np.mean(each.differences**2)) for each in matches.runs if not each.is_unordered]
    return float(np.sqrt(np.mean(squares) / 2.0)) if squares else None


def contradiction_notes(matches: Matches) -> list[str]:
    """The remark that runs contradict each other, with its cause; empty if they do not."""
    found = [each for each in matches.runs if abs(each.typical) > _limit(each, matches.greatest)]
    contradicting = [each for each in found if each.are_near] or found
    if not contradicting:
        return []
    rms = np.sqrt(np.mean([np.mean(each.differences**2) for each in matches.runs]))
    if rms < MIN_RMS * matches.greatest:
        return []
    typical = float(np.median([abs(each.typical) for each in contradicting]))
    worst = max(contradicting, key=lambda each: abs(each.typical))
    unordered = all(each.is_unordered for each in contradicting)
    who = "rows" if unordered else f"{len(contradicting)} of {len(matches.runs)} pairs of runs"
    at_one_place = all(each.are_near for each in contradicting)
    where = "at equal pressure and contraction" if at_one_place else "apart from a smooth dependence on both quantities"
    text = (
        f"Rows contradict each other: {where} the forces of {who} differ by {typical:.3g} N "
        f"(median), which no law can follow. {_example(worst)}"
    )
    return [HintedText(text, *_cause(contradicting, matches), HYSTERESIS if unordered else "")]


def _limit(runs: MatchedRuns, greatest: float) -> float:
    limit = UNORDERED_DIFFERENCE if runs.is_unordered else MIN_DIFFERENCE if runs.first.direction else MAX_HYSTERESIS
    return limit * greatest


def _example(runs: MatchedRuns) -> str:
    """The matched rows whose difference is the median one, as a sentence."""
    i, j = runs.pairs[int(np.argmin(np.abs(np.abs(runs.differences) - abs(runs.typical))))]
    rows = [(block, int(block.rows[k])) for block, k in ((runs.first, i), (runs.second, j))]
    texts = [
        f"{block.recording.origin}, row {row + 1}: {block.recording['force'][row]:.4g} N at "
        f"{block.recording['pressure'][row] / 1e3:.4g} kPa and {100 * block.recording['contraction'][row]:.3g} %"
        for block, row in rows
    ]
    return f"For example {texts[0]}; {texts[1]}."


def _cause(contradicting: Sequence[MatchedRuns], matches: Matches) -> list[str | Hint]:
    """The cause and the remedy, as far as the contradictions show them."""
    column = _separating_column(contradicting, matches)
    if column is not None:
        mapped = {re.sub(r"\s*[\[(].*", "", column): "specimen"}
        return [
            f" Column '{column}' tells the contradicting rows apart: it probably names the specimen.",
            Hint("To state it as the specimen", "columns", mapped, "ColumnMapping"),
            " Fit each specimen by itself, or at least three together with --compare.",
        ]
    shifts = np.array([each.pressure_shift for each in contradicting])
    if np.mean(np.abs(np.abs(shifts) / AMBIENT_PRESSURE - 1.0) < SHIFT_TOLERANCE) > 0.5:
        pairs = zip(contradicting, shifts, strict=True)
        names = [(each.first if shift > 0 else each.second).recording.origin for each, shift in pairs]
        return [
            f" A pressure of one atmosphere, {AMBIENT_PRESSURE / 1e3:.4g} kPa, explains the difference: the pressures "
            f"of {file_list(names)} are probably absolute. State their unit in the heading, 'kPa(a)'."
        ]
    return [
        " Check whether these runs are of one muscle, with the same zeros, units and resting length, and leave out "
        "what is not."
    ]


def _separating_column(contradicting: Sequence[MatchedRuns], matches: Matches) -> str | None:
    """The column whose values differ in all contradicting pairs and in no other; None without one."""
    chosen = {id(each) for each in contradicting}
    for name, _ in contradicting[0].first.labels:
        differs = {id(each) for each in matches.runs if _label(each.first, name) != _label(each.second, name)}
        if chosen <= differs and len(differs - chosen) <= 0.5 * len(differs):
            return name
    return None


def _label(block: Block, name: str) -> float | None:
    return dict(block.labels).get(name)

"""Pieces of a file of episodes: cut at starts, gaps of the times or rests, with even rows."""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...core import Array, ColumnError, counted
from ..inspection import Mask
from ..readers import Arrays
from .episode_mapping import EpisodeMapping, array_of, columns_of

MAX_GAP = 5.0
"""Greatest interval of two rows, in sample times, that is interpolated (chosen)."""
UNEVEN = 0.1
"""Deviation of an interval from the sample time, relative to it, from which rows are interpolated
(chosen).
"""
STILL = 0.01
"""Motion of an angle in a rest, relative to its range (chosen)."""
FEWEST = 2
"""Rows of a piece at least."""


class EpisodePart(NamedTuple):
    """A part of a record with its name."""

    name: str
    arrays: Arrays


def pieces_of(
    name: str, arrays: Arrays, mapping: EpisodeMapping
) -> tuple[list[EpisodePart], list[str]]:
    """The episodes of a record, with even rows, and notes on cuts and on interpolated rows. Raises
    ColumnError for starts, times or rests that allow none.
    """
    pieces = [EpisodePart(name, arrays)]
    notes: list[str] = []
    if mapping.starts is not None:
        pieces = _cut(pieces[0], _starts(name, arrays, mapping), len(_angles(pieces[0], mapping)))
    if mapping.time is not None:
        pieces, notes = _with_even_rows(name, pieces, mapping)
    if mapping.rests is not None:
        pieces, remarks = _cut_at_rests(name, pieces, mapping)
        notes += remarks
    return pieces, notes


def _angles(piece: EpisodePart, mapping: EpisodeMapping) -> Array:
    return columns_of(piece.name, piece.arrays, mapping.angles)


def _cut(piece: EpisodePart, starts: Sequence[int], rows: int) -> list[EpisodePart]:
    """The parts that begin at these rows; arrays of other lengths belong to each of them."""
    edges = [*(int(row) for row in starts if row < rows), rows]
    parts = []
    for number, (begin, end) in enumerate(itertools.pairwise(edges), start=1):
        part = {
            name: array[begin:end] if len(array) == rows else array
            for name, array in piece.arrays.items()
            if array.ndim
        }
        single = {name: array for name, array in piece.arrays.items() if not array.ndim}
        parts.append(EpisodePart(f"{piece.name}, episode {number}", {**part, **single}))
    return parts


def _starts(name: str, arrays: Arrays, mapping: EpisodeMapping) -> list[int]:
    """First rows of the episodes. Raises ColumnError."""
    rows = len(columns_of(name, arrays, mapping.angles))
    assert mapping.starts is not None
    marks = array_of(name, arrays, mapping.starts).ravel()
    flags = len(marks) == rows and bool(np.isin(marks, (0, 1)).all())
    starts = np.flatnonzero(marks) if flags else marks
    if (
        not len(starts)
        or np.any(starts != starts.astype(int))
        or np.any(np.diff([*starts, rows + 0.5]) <= 0.0)
    ):
        raise ColumnError(
            f"{name}: starts, column '{mapping.starts}', must be the first rows of the"
            f" episodes, from 0, whole and rising below {rows} rows, or 1 in these rows and"
            " 0 elsewhere."
        )
    rising: list[int] = starts.astype(int).tolist()
    return rising


def _with_even_rows(
    name: str, pieces: Sequence[EpisodePart], mapping: EpisodeMapping
) -> tuple[list[EpisodePart], list[str]]:
    """Pieces whose rows stand at multiples of the sample time, cut at gaps, and notes."""
    even = []
    deviations = []
    gaps = 0
    for piece in pieces:
        assert mapping.time is not None
        time = array_of(piece.name, piece.arrays, mapping.time).ravel()
        intervals = np.diff(time)
        step = mapping.sample_time or (float(np.median(intervals)) if len(intervals) else 0.0)
        if not step > 0.0 or not np.all(intervals > 0.0):
            raise ColumnError(
                f"{piece.name}: the times of column '{mapping.time}' do not rise from row to row."
                " Correct them, or state sample_time in the mapping file in place of time."
            )
        cuts = np.flatnonzero(intervals > MAX_GAP * max(step, float(np.median(intervals)))) + 1
        gaps += len(cuts)
        parts = _cut(piece, [0, *cuts.tolist()], len(time)) if len(cuts) else [piece]
        for part in parts:
            times = part.arrays[mapping.time].ravel()
            if len(times) < FEWEST:
                continue
            worst = float(np.max(np.abs(np.diff(times) - step)))
            if worst > UNEVEN * step:
                deviations.append(worst)
                part = EpisodePart(part.name, _interpolated(part.arrays, mapping.time, step))
            even.append(part)
    if not even:
        raise ColumnError(
            f"{name}: no piece between gaps of the times has {FEWEST} rows; give more rows."
        )
    notes = []
    if gaps:
        notes.append(f"{name}: cut at {counted(gaps, 'gap')} of more than {MAX_GAP:g} sample times")
    if deviations:
        notes.append(
            f"{name}: intervals of rows differ by up to {1e3 * max(deviations):.3g} ms from the"
            f" sample time of {1e3 * step:.4g} ms; rows are interpolated to it"
        )
    return even, notes


def _interpolated(arrays: Arrays, time: str, step: float) -> Arrays:
    """The arrays at even times; those of other lengths as they are."""
    known = arrays[time].ravel()
    duration = float(known[-1] - known[0])
    count = int(duration / step + 1e-6) + 1
    even = known[0] + step * np.arange(count)
    resampled = {}
    for name, array in arrays.items():
        is_column = array.ndim and len(array) == len(known)
        resampled[name] = _rows_at(even, known, array) if is_column else array
    return resampled


def _rows_at(times: Array, known: Array, array: Array) -> Array:
    """The rows of an array at other times."""
    columns = array.reshape(len(known), -1)
    rows = [np.interp(times, known, column) for column in columns.T]
    return np.stack(rows, axis=1).reshape(len(times), *array.shape[1:])


def _cut_at_rests(
    name: str, pieces: Sequence[EpisodePart], mapping: EpisodeMapping
) -> tuple[list[EpisodePart], list[str]]:
    """The pieces between the middles of rests, and a note. Raises ColumnError without a rest."""
    assert mapping.rests is not None
    found = []
    for piece in pieces:
        angles = _angles(piece, mapping)
        step = mapping.sample_time
        if step is None:
            assert mapping.time is not None
            step = float(np.median(np.diff(piece.arrays[mapping.time].ravel())))
        middles = _rests(angles, max(2, round(mapping.rests / step)))
        found += _cut(piece, [0, *middles], len(angles)) if middles else [piece]
    if len(found) == len(pieces):
        raise ColumnError(
            f"{name}: no rest of {mapping.rests:g} s, in which every angle stays within"
            f" {100 * STILL:g} % of its range; state shorter rests in the mapping file, or starts."
        )
    return found, [f"{name}: cut at {counted(len(found) - len(pieces), 'rest')}"]


def _rests(angles: Array, rows: int) -> list[int]:
    """Middles of the rests of at least so many rows, without those at the ends."""
    is_still = _still_rows(angles, rows)
    bounded = np.concatenate([[0], is_still.astype(int), [0]])
    edges = np.flatnonzero(np.diff(bounded)).tolist()
    middles = []
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        if begin > 0 and end < len(angles):
            middles.append((begin + end) // 2)
    return middles


def _still_rows(angles: Array, rows: int) -> Mask:
    """Whether every angle hardly moves in so many rows about a row."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    low, high = np.quantile(angles, (0.01, 0.99), axis=0)
    greatest = maximum_filter1d(angles, rows, axis=0)
    least = minimum_filter1d(angles, rows, axis=0)
    still: Mask = np.all(greatest - least <= STILL * (high - low), axis=1)
    return still

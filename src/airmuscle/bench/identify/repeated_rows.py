"""Rows that occur in two recordings, as where files overlap: they are one measurement."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array
from ...recording import Recording

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
        for rows in _equal_stretches(recordings[here], recordings[there], offset, columns):
            found.append(RepeatedRows(here, rows, there, (recordings[here].origin, recordings[there].origin)))
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
    for start, stop in _stretches(same):
        rows = slice(first + start, first + stop)
        if stop - start >= needed and np.unique(here["force"][rows]).size >= MIN_LEVELS:
            yield rows


def _stretches(mask: npt.NDArray[np.bool_]) -> list[tuple[int, int]]:
    ends = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(start), int(stop)) for start, stop in ends.reshape(-1, 2)]

"""PiecewiseLinear: all inputs of a run, linear in time within each segment; and segments of a single input."""

import dataclasses
import itertools
import operator
from collections.abc import Sequence

import numpy as np

from ...core import FEW, Array, ParameterError, ShortRepr, all_finite

FEW_SEGMENTS = 16
"""Segments up to which they are gone through one by one, which is faster (measured)."""
Segment = tuple[float, float, float]
"""A segment of a single input: its end [s], the value at its start, the slope [1/s]."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class PiecewiseLinear(ShortRepr):
    """Inputs in time: ends (S,) of the segments, inputs at the start of each (S, m), and their slopes [1/s] (S, m)."""

    ends: Array
    values: Array
    slopes: Array

    def inputs_at(self, times: Array, start: float) -> Array:
        """The inputs (N, m) at times (N,); where two segments meet, those of the later one."""
        starts = self.starts(start)
        index = np.maximum(np.searchsorted(starts, times, side="right") - 1, 0)
        return np.asarray(self.values[index] + (times - starts[index])[:, None] * self.slopes[index])

    def at_rising(self, times: Array, start: float) -> tuple[Array, Array]:
        """The inputs (N, m) and their slopes (N, m) at rising times (N,), as `inputs_at` at any times."""
        if self.ends.size > FEW_SEGMENTS:
            index = np.maximum(np.searchsorted(self.starts(start), times, side="right") - 1, 0)
            return self.inputs_at(times, start), self.slopes[index]
        shape = (times.size, self.values.shape[1])
        values, slopes = np.empty(shape), np.empty(shape)
        begins = [start, *self.ends[:-1].tolist()]
        rows = [0, *times.searchsorted(self.ends[:-1]).tolist(), times.size]
        for i, (first, last) in enumerate(itertools.pairwise(rows)):
            slope = slopes[first:last] = self.slopes[i]
            values[first:last] = self.values[i]
            if slope.any():
                values[first:last] += (times[first:last] - begins[i])[:, None] * slope
        return values, slopes

    def starts(self, start: float) -> Array:
        """Start of each segment (S,)."""
        return np.concatenate([[start], self.ends[:-1]])

    def column(self, i: int) -> list[Segment]:
        """The segments of one input."""
        values, slopes = self.values[:, i].tolist(), self.slopes[:, i].tolist()
        return list(zip(self.ends.tolist(), values, slopes, strict=True))

    def check_shape(self, inputs: int, start: float) -> None:
        """Raise ParameterError unless ends rise from `start` [s] and every segment has all inputs, all finite.

        Kernels rely on it.
        """
        ends, values, slopes = self.ends, self.values, self.slopes
        shape = (ends.size, inputs)
        if ends.ndim != 1 or not ends.size or values.shape != shape or slopes.shape != shape:
            raise ParameterError(
                f"segments have ends {ends.shape}, values {values.shape} and slopes {slopes.shape}; for {inputs} "
                f"inputs they must be (S,), (S, {inputs}) and (S, {inputs}), with at least one segment."
            )
        if not (all_finite(ends) and all_finite(values) and all_finite(slopes)):
            raise ParameterError("segments hold a number that is not finite.")
        if ends[0] <= start or not _rising(ends):
            raise ParameterError(f"segments must end in rising order after {start:g} s; they end at {ends.tolist()} s.")

    def as_floats(self) -> "PiecewiseLinear":
        """The same inputs as arrays that a kernel can read: contiguous, writeable, of float64."""
        tables = (self.ends, self.values, self.slopes)
        if all(t.dtype == np.float64 and t.flags.carray for t in tables):
            return self
        return PiecewiseLinear(*(np.array(t, dtype=float, order="C") for t in tables))

    def read_only(self) -> "PiecewiseLinear":
        """The same inputs; nobody can write to these arrays any more."""
        for table in (self.ends, self.values, self.slopes):
            table.setflags(write=False)
        return self

    def split_at(self, starts: Array, start: float) -> "PiecewiseLinear":
        """The same inputs with segments that start at other instants (R,), in rising order, the first not before
        `start`; no segment may end within one of them."""
        ends = np.append(starts[1:], self.ends[-1])
        return PiecewiseLinear(ends, *self.at_rising(starts, start))


def _rising(times: Array) -> bool:
    """Whether every time is later than the one before."""
    if times.size > FEW:
        return bool((times[1:] > times[:-1]).all())
    listed = times.tolist()
    return all(map(operator.lt, listed, listed[1:]))


def merge_columns(columns: Sequence[Sequence[Segment]], start: float) -> tuple[list[float], list[float], list[float]]:
    """One list of segments for several inputs, split wherever one of them is: ends, values and slopes row by row."""
    if max(map(len, columns)) == 1:
        single = [column[0] for column in columns]
        return [single[0][0]], [value + 0.0 * slope for _, value, slope in single], [slope for _, _, slope in single]
    breaks = {start}
    for column in columns:
        breaks.update(end for end, _, _ in column[:-1])
    starts = sorted(breaks)
    values, slopes = [0.0] * (len(starts) * len(columns)), [0.0] * (len(starts) * len(columns))
    width = len(columns)
    for i, column in enumerate(columns):
        begin, k, last = start, 0, len(column) - 1
        for row, time in enumerate(starts):
            while k < last and column[k][0] <= time:
                begin = column[k][0]
                k += 1
            _, value, slope = column[k]
            values[row * width + i] = value + (time - begin) * slope
            slopes[row * width + i] = slope
    return [*starts[1:], columns[0][-1][0]], values, slopes

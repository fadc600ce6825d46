"""Intervals of a control loop, from one sample to the next, with drivers that are called from Python.

An interval takes some microseconds, and NumPy takes one for an array of two numbers. So what changes from interval to
interval is written number by number, and the kernel reads and writes it where it stands.
"""

from __future__ import annotations

import array
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...core.arrays import Array, flat_view
from ...core.status import Status
from ..loop.driver import Driver
from ..loop.piecewise_linear import PiecewiseLinear, Segment, merge_columns
from ..loop.with_drivers import apply_drivers
from .bound_integrator import BoundIntegrator
from .output_times import merge_few_output_times
from .sampled_loop import SampledLoop

Drivers = Mapping[str, tuple[Any, ...]]
"""The states of the drivers of each input."""
_ITEM = 8


class Intervals:
    """Segments and rows of the intervals so far, in arrays that grow; those of the last one can be discarded.

    segment_count, row_count    segments that were appended, rows that were reached
    """

    def __init__(self, prepared: SampledLoop, states: int, chains: dict[str, tuple[Driver, ...]]) -> None:
        self.prepared, self.states, self.inputs = prepared, states, prepared.inputs.values.shape[1]
        self.segment_count = self.row_count = 0
        self._first = self._kept_segments = self._kept_rows = 0
        self._chains, names = chains, prepared.input_names
        self._driven = {name: names.index(name) for name in chains}
        self._ends, self._values, self._slopes, self._times, self._rows = (array.array("d") for _ in range(5))
        known = prepared.inputs
        self._asked = flat_view(prepared.times)
        self._given = [flat_view(table) for table in (known.ends, known.values, known.slopes)]

    def append(self, k: int, commanded: Sequence[float], drivers: Drivers) -> Drivers:
        """Append the segments of interval `k` under commands; the drivers' states at its end."""
        begin = self.prepared.edges[k]
        columns = self._columns(k, commanded)
        drivers = apply_drivers(self._chains, drivers, columns, self._driven, begin)
        ends, values, slopes = merge_columns(columns, begin)
        offsets = self.prepared.row_offsets
        times = self._asked[offsets[k] : offsets[k + 1]].tolist()
        if len(ends) > 1:
            times = merge_few_output_times(times, ends, self.prepared.loop.sample_time)
        self._first = self.segment_count
        self.segment_count += len(ends)
        self._ends.extend(ends)
        self._values.extend(values)
        self._slopes.extend(slopes)
        if times:
            self._times.extend(times)
            self._rows.frombytes(bytes(_ITEM * self.states * len(times)))
        return drivers

    def _columns(self, k: int, commanded: Sequence[float]) -> list[list[Segment]]:
        """The segments of every input in interval `k`, before the drivers."""
        (first, last), width = self.prepared.segment_offsets[k : k + 2], self.inputs
        ends, values, slopes = self._given
        rows = range(first, last)
        if len(rows) == 1:
            end = ends[first]
            single = [(end, values[i], slopes[i]) for i in range(first * width, last * width)]
            for column, value in zip(self.prepared.commanded, commanded, strict=True):
                single[column] = end, value, 0.0
            return [[segment] for segment in single]
        columns = [[(ends[i], values[i * width + j], slopes[i * width + j]) for i in rows] for j in range(width)]
        for column, value in zip(self.prepared.commanded, commanded, strict=True):
            columns[column] = [(ends[i], value, 0.0) for i in rows]
        return columns

    def integrate(self, bound: BoundIntegrator, begin: float) -> tuple[Status, float]:
        """Integrate through the interval that was appended last, and fill its rows; how and where it ended."""
        first, row = self._first, self.row_count
        ends, values, slopes = self._ends.buffer_info()[0], self._values.buffer_info()[0], self._slopes.buffer_info()[0]
        times, rows = self._times.buffer_info()[0], self._rows.buffer_info()[0]
        width = _ITEM * self.inputs * first
        status, reached, at = bound.run_part(
            begin, (ends + _ITEM * first, values + width, slopes + width), self.segment_count - first,
            times + _ITEM * row, rows + _ITEM * self.states * row, len(self._times) - row,
        )  # fmt: skip
        self.row_count = row + reached
        return status, at

    def final_inputs(self, begin: float, end: float) -> list[float]:
        """The inputs (m,) at the end of the interval that was appended last."""
        last, width = self.segment_count - 1, self.inputs
        duration = end - (self._ends[last - 1] if last > self._first else begin)
        values, slopes = self._values, self._slopes
        return [values[i] + slopes[i] * duration for i in range(last * width, (last + 1) * width)]

    @property
    def signal(self) -> PiecewiseLinear:
        """The segments so far."""
        ends, values, slopes = (np.array(buffer) for buffer in (self._ends, self._values, self._slopes))
        count, width = self.segment_count, self.inputs
        return PiecewiseLinear(
            ends[:count], values[: count * width].reshape(-1, width), slopes[: count * width].reshape(-1, width)
        )

    @property
    def rows(self) -> tuple[Array, Array]:
        """The times (N,) and states (N, n) so far."""
        count, states = self.row_count, self.states
        rows = np.array(self._rows)[: count * states].reshape(-1, states)
        return np.array(self._times)[:count], rows

    def keep(self) -> None:
        """Keep the interval that was appended last."""
        self._kept_segments, self._kept_rows = self.segment_count, self.row_count

    def discard(self) -> None:
        """Forget an interval that was interrupted, so that the run can be continued from its beginning."""
        self.segment_count, self.row_count = self._kept_segments, self._kept_rows

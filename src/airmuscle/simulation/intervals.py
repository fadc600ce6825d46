"""Intervals of a control loop, from one sample to the next: segments of the inputs, and the rows that are asked for.

An interval takes some microseconds, and NumPy takes one for an array of two numbers. So what changes from interval to
interval is written number by number, and the kernel reads and writes it where it stands.
"""

from __future__ import annotations

import abc
import array
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..compile.cache.kernel import address_of
from ..control.driver import Driver
from ..control.piecewise_linear import PiecewiseLinear, Segment, merge_columns
from ..control.with_drivers import apply_drivers
from ..core.arrays import Array, flat_view
from ..core.status import Status
from .bound_integrator import BoundIntegrator
from .output_times import merge_few_output_times
from .sampled_loop import SampledLoop

Drivers = Mapping[str, tuple[Any, ...]]
"""The states of the drivers of each input."""
_ITEM = 8


class Intervals(abc.ABC):
    """Segments and rows of the intervals so far; those of the last one can be discarded.

    segment_count, row_count    segments that were appended, rows that were reached
    """

    _ends: Any
    _values: Any
    _slopes: Any
    _sloped = True
    """Whether an input may change within a segment."""

    def __init__(self, prepared: SampledLoop, states: int) -> None:
        self.prepared, self.states, self.inputs = prepared, states, prepared.inputs.values.shape[1]
        self.segment_count = self.row_count = 0
        self._first = self._kept_segments = self._kept_rows = 0

    @abc.abstractmethod
    def append(self, k: int, commanded: Sequence[float], drivers: Drivers) -> Drivers:
        """Append the segments of interval `k` under commands; the drivers' states at its end."""

    @abc.abstractmethod
    def integrate(self, bound: BoundIntegrator, begin: float) -> tuple[Status, float]:
        """Integrate through the interval that was appended last, and fill its rows; how and where it ended."""

    def final_inputs(self, begin: float, end: float) -> list[float]:
        """The inputs (m,) at the end of the interval that was appended last."""
        last, width = self.segment_count - 1, self.inputs
        if not self._sloped:
            held: list[float] = self._values[last * width : (last + 1) * width].tolist()
            return held
        duration = end - (self._ends[last - 1] if last > self._first else begin)
        values, slopes = self._values, self._slopes
        return [values[i] + slopes[i] * duration for i in range(last * width, (last + 1) * width)]

    @property
    @abc.abstractmethod
    def signal(self) -> PiecewiseLinear:
        """The segments so far."""

    @property
    @abc.abstractmethod
    def rows(self) -> tuple[Array, Array]:
        """The times (N,) and states (N, n) so far."""

    def keep(self) -> None:
        """Keep the interval that was appended last."""
        self._kept_segments, self._kept_rows = self.segment_count, self.row_count

    def discard(self) -> None:
        """Forget an interval that was interrupted, so that the run can be continued from its beginning."""
        self.segment_count, self.row_count = self._kept_segments, self._kept_rows


class HeldIntervals(Intervals):
    """Intervals of a loop without drivers: all segments are known beforehand, apart from the commanded values."""

    def __init__(self, prepared: SampledLoop, states: int) -> None:
        super().__init__(prepared, states)
        signal, times = prepared.inputs, prepared.times
        self._sloped = bool(signal.slopes.any())
        self._rows = np.empty((times.size, states))
        self._arrays = (signal.ends, signal.values, signal.slopes, times, self._rows)
        self._ends, self._values, self._slopes = map(flat_view, self._arrays[:3])
        self._addresses = tuple(map(address_of, self._arrays))

    def append(self, k: int, commanded: Sequence[float], drivers: Drivers) -> Drivers:
        offsets, width, values = self.prepared.segment_offsets, self.inputs, self._values
        self._interval, self._first, self.segment_count = k, offsets[k], offsets[k + 1]
        for row in range(self._first * width, self.segment_count * width, width):
            for column, value in zip(self.prepared.commanded, commanded, strict=True):
                values[row + column] = value
        return drivers

    def integrate(self, bound: BoundIntegrator, begin: float) -> tuple[Status, float]:
        offsets, first, row = self.prepared.row_offsets, self._first, self.row_count
        ends, values, slopes, times, rows = self._addresses
        width = _ITEM * self.inputs * first
        status, reached, at = bound.run_part(
            begin, (ends + _ITEM * first, values + width, slopes + width), self.segment_count - first,
            times + _ITEM * row, rows + _ITEM * self.states * row, offsets[self._interval + 1] - row,
        )  # fmt: skip
        self.row_count = row + reached
        return status, at

    @property
    def signal(self) -> PiecewiseLinear:
        ends, values, slopes, *_ = self._arrays
        return PiecewiseLinear(*(table[: self.segment_count] for table in (ends, values, slopes)))

    @property
    def rows(self) -> tuple[Array, Array]:
        return self.prepared.times[: self.row_count], self._rows[: self.row_count]


class DrivenIntervals(Intervals):
    """Intervals of a loop with drivers, which split them further: arrays that grow from interval to interval."""

    def __init__(self, prepared: SampledLoop, states: int, chains: dict[str, tuple[Driver, ...]]) -> None:
        super().__init__(prepared, states)
        self._chains, names = chains, prepared.input_names
        self._driven = {name: names.index(name) for name in chains}
        self._ends, self._values, self._slopes, self._times, self._rows = (array.array("d") for _ in range(5))
        known = prepared.inputs
        self._asked = flat_view(prepared.times)
        self._given = [flat_view(table) for table in (known.ends, known.values, known.slopes)]

    def append(self, k: int, commanded: Sequence[float], drivers: Drivers) -> Drivers:
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

    @property
    def signal(self) -> PiecewiseLinear:
        ends, values, slopes = (np.array(buffer) for buffer in (self._ends, self._values, self._slopes))
        count, width = self.segment_count, self.inputs
        return PiecewiseLinear(
            ends[:count], values[: count * width].reshape(-1, width), slopes[: count * width].reshape(-1, width)
        )

    @property
    def rows(self) -> tuple[Array, Array]:
        count, states = self.row_count, self.states
        rows = np.array(self._rows)[: count * states].reshape(-1, states)
        return np.array(self._times)[:count], rows

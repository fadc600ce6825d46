"""TimeGrid: the rows of a record on the clock of its run, and the intervals between the switches of its command."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ....core.arrays import Array
from ....engine.loop.inputs import InputSignal
from ....engine.loop.piecewise_linear import PiecewiseLinear

MIN_DURATION = 1e-9
"""Least duration of a run [s] (chosen)."""


class CommandInterval(NamedTuple):
    """The segments of a command from `begin` [s] on, the rows within them (K,), and the sensitivity column of the
    instant at which the interval begins; None for the first."""

    begin: float
    segments: PiecewiseLinear
    times: Array
    column: int | None


class TimeGrid(NamedTuple):
    """The rows of a record relative to the start of the run, shape (N,), with the inputs there (N, m)."""

    start_time: float
    instants: Mapping[float, float]
    """The instants of the command that are unknowns [s], by those of the command of the experiment."""
    times: Array
    before_start: npt.NDArray[np.bool_]
    inputs: Array
    intervals: tuple[CommandInterval, ...]


def make_time_grid(
    times: Array, start_time: float, command: InputSignal, inputs: tuple[str, ...], instants: Mapping[float, float],
    columns: Mapping[float, int],
) -> TimeGrid:  # fmt: skip
    """The grid of rows at `times` (N,) on the clock of the record, for a command with estimated instants.

    `instants` has the estimate of each instant of the experiment's command that is an unknown, `columns` its column.
    """
    elapsed = times - start_time
    rows = np.maximum(elapsed, 0.0)
    segments = command.segments(inputs, 0.0, max(float(elapsed[-1]), MIN_DURATION))
    at_rows = np.ascontiguousarray(segments.inputs_at(rows, 0.0))
    intervals = _split(segments, rows, {instants[instant]: column for instant, column in columns.items()})
    return TimeGrid(start_time, instants, rows, elapsed < 0, at_rows, intervals)


def _split(segments: PiecewiseLinear, rows: Array, switches: Mapping[float, int]) -> tuple[CommandInterval, ...]:
    """The segments and rows between the instants that are unknowns."""
    inner = segments.ends[:-1].tolist()
    cuts = [i + 1 for i, end in enumerate(inner) if end in switches]
    if not cuts:
        return (CommandInterval(0.0, segments, rows, None),)
    begins = [0.0, *(inner[i - 1] for i in cuts)]
    first_rows = [0, *np.searchsorted(rows, begins[1:]).tolist(), rows.size]
    edges = [0, *cuts, segments.ends.size]
    return tuple(
        CommandInterval(
            begin,
            PiecewiseLinear(segments.ends[a:b], segments.values[a:b], segments.slopes[a:b]),
            rows[first:last],
            switches.get(begin) if number else None,
        )
        for number, (begin, (a, b), (first, last)) in enumerate(
            zip(begins, itertools.pairwise(edges), itertools.pairwise(first_rows), strict=True)
        )
    )

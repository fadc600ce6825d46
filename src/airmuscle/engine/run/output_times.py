"""Output times of a run: a grid or given instants, together with the instants of its inputs."""

from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import Array, ParameterError, as_float, one_line

MAX_OUTPUT_STEP = 0.01
"""The default grid is at least this fine [s]."""
MAX_ROWS = 10_000_000
"""Rows of a recording that fit a usual memory."""
_FEW = 32
"""Instants up to which they are merged one by one, which is faster (measured)."""


def output_times(given: float | npt.ArrayLike | None, start: float, duration: float, instants: Array) -> Array:
    """The times [s] of the rows of a run, rising, with the instants of the inputs among them.

    given  spacing [s] or times [s]; by default 1/1000 of the run, but at most 10 ms
    """
    end = start + duration
    if given is None:
        given = min(duration / 1000, MAX_OUTPUT_STEP)
    if isinstance(given, float | int) or not np.ndim(given):
        spacing = as_float("simulate: output_times", given)
        return merge_output_times(_grid(spacing, start, duration), instants, duration)
    grid = _times(given)
    if grid.size and not (grid[0] >= start and grid[-1] <= end):
        raise ParameterError(f"simulate: output_times must lie within {start:g} to {end:g} s.")
    return merge_output_times(grid, instants, duration)


def _grid(spacing: float, start: float, duration: float) -> Array:
    if not 0 < spacing < np.inf:
        raise ParameterError(f"simulate: a spacing of output_times of {spacing!r} s is not positive and finite.")
    if duration / spacing > MAX_ROWS:
        raise ParameterError(
            f"simulate: a spacing of output_times of {spacing!r} s makes {duration / spacing:.3g} rows of a run of "
            f"{duration:g} s; {MAX_ROWS} are allowed. The result does not depend on it: choose a wider one."
        )
    grid: Array = np.arange(int(duration / spacing * (1 + 1e-12)) + 1, dtype=float)
    grid *= spacing
    grid += start
    return grid


def _times(given: Any) -> Array:
    """Times [s] in rising order, each once, from a list of them."""
    try:
        times = np.array(given, dtype=float)
    except (TypeError, ValueError):
        times = np.empty((0, 0))
    if times.ndim != 1:
        raise ParameterError(f"simulate: output_times is {one_line(given)}; give a spacing [s] or a list of times [s].")
    if np.isnan(times).any():
        raise ParameterError(f"simulate: output_times is {one_line(given)}; a time is not a number (NaN).")
    times = np.sort(times)
    return times[np.diff(times, prepend=-np.inf) > 0]


def merge_output_times(grid: Array, instants: Array, duration: float) -> Array:
    """The rows of a grid and the instants, both rising; a row of the grid close to an instant is replaced by it."""
    close = 1e-9 * duration
    if instants.size <= _FEW and grid.size:
        return _merge_few(grid, instants, close)
    behind = np.searchsorted(instants, grid)
    before, after = instants[np.maximum(behind - 1, 0)], instants[np.minimum(behind, instants.size - 1)]
    apart = np.minimum(np.abs(grid - before), np.abs(grid - after)) > close
    merged: Array = instants.copy()
    if apart.any():
        merged = np.sort(np.concatenate([grid[apart], instants]))  # np.unique would import numpy.ma
    new: npt.NDArray[np.bool_] = np.diff(merged, prepend=-np.inf) > 0
    return merged[new]


def _merge_few(grid: Array, instants: Array, close: float) -> Array:
    """The same for few instants: the grid between one and the next, less the rows close to them."""
    lower = grid.searchsorted(instants - close, side="left").tolist()
    upper = grid.searchsorted(instants + close, side="right").tolist()
    if upper == [row + 1 for row in lower] and len(set(lower)) == len(lower):  # each takes the place of one row
        merged = grid.copy()
        merged[lower] = instants
        return merged
    parts, row = [], 0
    for i, (low, high) in enumerate(zip(lower, upper, strict=True)):
        if low > row:
            parts.append(grid[row:low])
        if not i or instants[i] > instants[i - 1]:
            parts.append(instants[i : i + 1])
        row = max(row, high)
    parts.append(grid[row:])
    return np.concatenate(parts)

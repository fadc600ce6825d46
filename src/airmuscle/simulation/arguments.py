"""The terms of a run: what it is told is refused where it cannot be, and its rows are chosen."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ..analysis.equilibrium import find_equilibrium
from ..compile import System
from ..control.inputs import PiecewiseLinear
from ..core.arrays import Array
from ..core.declaration import as_float
from ..core.errors import ParameterError
from ..plant.plant import Plant
from .integrators import Integrator, Rodas4

MAX_OUTPUT_STEP = 0.01
"""Output is at least this fine [s] unless asked otherwise."""
MOST_ROWS = 10_000_000
"""Rows of a recording that fit a usual memory."""


def check_duration(duration: float, start_time: float) -> tuple[float, float]:
    """Length and beginning of a run [s]. Raises ParameterError where no time passes."""
    duration, start_time = as_float("simulate: duration", duration), as_float("simulate: start_time", start_time)
    if not (np.isfinite(duration) and duration > 0):
        raise ParameterError(f"simulate: duration is {duration!r} s; it must be positive and finite.")
    if not start_time + duration > start_time:
        raise ParameterError(f"simulate: start_time is {start_time!r} s; {duration!r} s after it no time has passed.")
    return duration, start_time


def output_times(output: float | npt.ArrayLike | None, start: float, duration: float, instants: Array) -> Array:
    """The instants [s] at which a run is recorded, in rising order, the command's instants among them."""
    end = start + duration
    if output is None:
        output = min(duration / 1000, MAX_OUTPUT_STEP)
    if not np.ndim(output):
        output = as_float("simulate: output", output)
        if not 0 < output < np.inf:
            raise ParameterError(f"simulate: an output spacing of {output!r} s is not positive and finite.")
        if duration / output > MOST_ROWS:
            raise ParameterError(
                f"simulate: an output spacing of {output!r} s makes {duration / output:.3g} rows of a run of "
                f"{duration:g} s; {MOST_ROWS} are allowed. The result does not depend on it: choose a wider one."
            )
        grid = start + output * np.arange(int(np.floor(duration / output * (1 + 1e-12))) + 1)
    else:
        grid = _instants(output)
        if grid.size and not (grid[0] >= start and grid[-1] <= end):
            raise ParameterError(f"simulate: output instants must lie within {start:g} to {end:g} s.")
    return merge_output_times(grid, instants, duration)


def merge_output_times(grid: npt.NDArray[Any], instants: Array, duration: float) -> Array:
    """The rows of a grid and the instants (both rising) of a run; of a row that is next to an instant, the instant."""
    behind = np.searchsorted(instants, grid)  # two neighbours of each: a table of all pairs would not fit the memory
    before, after = instants[np.maximum(behind - 1, 0)], instants[np.minimum(behind, instants.size - 1)]
    apart = np.minimum(np.abs(grid - before), np.abs(grid - after)) > 1e-9 * duration
    merged: Array = np.sort(np.concatenate([grid[apart], instants]))  # np.unique would start numpy.ma
    new: npt.NDArray[np.bool_] = np.diff(merged, prepend=-np.inf) > 0
    return merged[new]


def _instants(given: Any) -> Array:
    """Instants [s] in rising order, from a list of them."""
    try:
        found = np.array(given, dtype=float)
    except (TypeError, ValueError):
        found = np.empty((0, 0))
    if found.ndim != 1:
        raise ParameterError(f"simulate: output is {given!r}; give a spacing [s] or a list of instants [s].")
    return np.sort(found)


def default_integrator(method: Integrator | None) -> Integrator:
    """The method that is given, or the default. Raises ParameterError for what is none, as a name is."""
    if method is None:
        return Rodas4()
    if not isinstance(method, Integrator):
        raise ParameterError(f"the method is {method!r}; give Rodas4(), RungeKutta4(step) or DormandPrince8(step).")
    return method


def check_input_range(plant: System, segments: PiecewiseLinear, start: float) -> None:
    """Raise ParameterError where a Plant is commanded beyond what its inputs allow; other systems' are theirs."""
    if not isinstance(plant, Plant):
        return
    lengths = np.diff(segments.ends, prepend=start)[:, None]
    least, greatest = (np.array([getattr(i, end) for i in plant.commands]) for end in ("minimum", "maximum"))
    slack = 1e-9 * (greatest - least)
    for values in (segments.values, segments.values + segments.slopes * lengths):
        beyond = (values < least - slack) | (values > greatest + slack)
        if beyond.any():
            row, column = np.argwhere(beyond)[0]
            given = plant.commands[column]
            unit = "" if given.unit == "1" else f" {given.unit}"
            raise ParameterError(
                f"the input '{given.name}' is {values[row, column]:g}{unit} before {segments.ends[row]:g} s; allowed "
                f"range: {given.minimum:g} to {given.maximum:g}{unit} ({given.meaning})."
            )


def default_initial_state(plant: System) -> Mapping[str, float]:
    """Where a Plant rests at ambient pressure. Raises ParameterError for another system, which must be told."""
    if isinstance(plant, Plant):
        return find_equilibrium(plant, pressure=0.0)
    raise ParameterError(f"simulate: give the start of {type(plant).__name__}, a value for each state.")

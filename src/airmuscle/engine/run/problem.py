"""Problem: a system, its input, initial state, duration, output times and integrator, checked as a
whole.
"""

import dataclasses
import functools
import sys
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import (
    FEW,
    NUMBERS,
    Array,
    ParameterError,
    Reference,
    ShortRepr,
    System,
    as_float,
    cite,
    one_line,
)
from ...core.system import check_system, state_vector
from ..compile.program import CompiledSystem, compile_system
from ..loop import InputSignal, PiecewiseLinear, Schedule, check_input_signal
from ..loop.control_loop import ControlLoop, ControlLoopState, designed_loop
from .integrators import Integrator, default_integrator

MAX_KEPT_ROWS = 100_000
"""Rows of a run up to which its output times, or its loop, are kept with a plant for its next run
(chosen).
"""
LARGEST = sys.float_info.max
"""The largest finite number."""
MAX_OUTPUT_STEP = 0.01
"""The default grid is at least this fine [s]."""
MAX_ROWS = 10_000_000
"""Rows of a recording that fit a usual memory."""
FEW_INSTANTS = 32
"""Instants up to which they are merged one by one, which is faster (measured)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Problem(ShortRepr):
    """An initial value problem: a system under an input for `duration` [s]; its fields are the
    arguments of `simulate`.

    start_time     [s]
    control_state  state of the control loop, to continue a run

    Raises ParameterError for an input or state that the system does not have, an input beyond its
    range, a duration that is not positive, and wrong types.
    """

    system: System
    input: InputSignal | ControlLoop
    duration: float
    initial_state: Mapping[str, float] | None = None
    start_time: float = 0.0
    output_times: float | npt.ArrayLike | None = None
    integrator: Integrator | None = None
    control_state: ControlLoopState | None = None

    def __post_init__(self) -> None:
        check_system("simulate", self.system)
        object.__setattr__(self, "duration", as_float("simulate: duration", self.duration))
        object.__setattr__(self, "start_time", as_float("simulate: start_time", self.start_time))
        object.__setattr__(self, "integrator", default_integrator(self.integrator))
        if not 0 < self.duration < float("inf"):
            raise ParameterError(
                f"simulate: duration is {self.duration!r} s; it must be positive and finite."
            )
        if not self.start_time + self.duration > self.start_time:
            raise ParameterError(
                f"simulate: start_time is {self.start_time!r} s; a duration of {self.duration!r} s"
                " is lost in rounding."
            )
        if isinstance(self.input, ControlLoop):
            object.__setattr__(self, "input", designed_loop(self.input, self.system))
            known = self.compiled.description
            self.input.check_columns((*known.state_names, *known.output_names), known.input_names)
            if self.control_state is None and self.input.sample_time > self.duration:
                raise ParameterError(
                    f"the sample time of the controller is {self.input.sample_time:g} s, longer"
                    f" than the run of {self.duration:g} s. Shorten the sample time, or simulate"
                    " longer."
                )
            driven = self.input.driven_inputs.checked_segments(
                known.input_names, self.start_time, self.duration
            )
            check_input_range(self.compiled, driven, self.start_time)
        else:
            check_input_signal(self.input)
            check_input_range(self.compiled, self.segments, self.start_time)
        if self.initial_state is not None:
            _ = self.initial_vector

    def __getstate__(self) -> dict[str, Any]:
        """The fields alone: compiled code belongs to a process, and all else follows from the
        fields.
        """
        return {field.name: self.__dict__[field.name] for field in dataclasses.fields(self)}

    @property
    def end_time(self) -> float:
        """End of the run [s]."""
        return self.start_time + self.duration

    @property
    def references(self) -> tuple[Reference, ...]:
        """Sources of the models, of the integrator and of the controller, sorted by key."""
        known = self.compiled.description.cache.sources
        integrator = self.integrator
        if integrator not in known:
            known[integrator] = tuple(cite((self.system, integrator)))
        if type(self.input) is Schedule or not cite((self.input,)):
            return known[integrator]
        with_input = (self.system, self.input, integrator)
        return tuple(cite(with_input))

    @functools.cached_property
    def compiled(self) -> CompiledSystem:
        """The compiled system."""
        return compile_system(self.system)

    @functools.cached_property
    def segments(self) -> PiecewiseLinear:
        """The input signal of an open-loop run."""
        assert isinstance(self.input, InputSignal)
        inputs = self.compiled.description.input_names
        return self.input.checked_segments(inputs, self.start_time, self.duration)

    @functools.cached_property
    def times(self) -> Array:
        """Output times (N,) [s] of an open-loop run; where the input is that of the last run with
        the plant, and so is all that they depend on, those of the last run, which nobody can write
        to."""
        known = self.compiled.description.cache
        segments = self.segments
        requested = self.output_times
        asked = requested, self.start_time, self.duration
        last_segments, last_asked, last_times = known.checked_input
        if segments is not last_segments or not (requested is None or type(requested) in NUMBERS):
            return output_times(*asked, segments.ends)
        times: Array = last_times if asked == last_asked else output_times(*asked, segments.ends)
        if times is not last_times and times.size <= MAX_KEPT_ROWS:
            times.setflags(write=False)
            known.checked_input = segments, asked, times
        return times

    @functools.cached_property
    def initial_vector(self) -> Array:
        """The initial state (n,), given or the default."""
        if self.initial_state is None:
            return default_state(self.compiled)
        return initial_vector(self.compiled, self.initial_state)


def initial_vector(compiled: CompiledSystem, state: Mapping[str, float]) -> Array:
    """A given initial state (n,), checked; that of the run before is not checked again."""
    known = compiled.description
    system = compiled.system
    numbers = plain_numbers(state, known.state_limits)
    if numbers is None or numbers != known.cache.checked_state:
        vector = state_vector(system, state)
        system.check_state(state)
        known.cache.checked_state = vector.tolist()
        return vector
    return np.array(numbers)


def plain_numbers(values: Mapping[str, float], limits: Mapping[str, float]) -> list[float] | None:
    """The values in the order of their lower limits; None where `state_vector` must check them, or
    refuse them.
    """
    if not isinstance(values, Mapping) or len(values) != len(limits):
        return None
    numbers: list[float] = []
    for name, low in limits.items():
        value: Any = values.get(name)
        if type(value) not in NUMBERS or not low <= value or not abs(value) <= LARGEST:
            return None
        numbers.append(value)
    return numbers


def default_state(compiled: CompiledSystem) -> Array:
    """The default initial state (n,): a Plant's equilibrium at ambient pressure, computed once for
    a system.

    Raises ParameterError for a system that has none, EquilibriumError for a plant without a stable
    equilibrium.
    """
    known = compiled.description.cache
    system = compiled.system
    if known.default_state is None:
        state = system.default_state()
        if state is None:
            raise ParameterError(
                f"simulate: give the initial_state of {type(system).__name__}, a value for each"
                " state."
            )
        known.default_state = state_vector(system, state)
    return known.default_state


def check_signal(system: System, signal: InputSignal, start: float, duration: float) -> None:
    """Raise ParameterError where an input signal is beyond its range, from `start` [s] for
    `duration` [s].
    """
    compiled = compile_system(system)
    check_input_range(
        compiled, signal.segments(compiled.description.input_names, start, duration), start
    )


def check_input_range(compiled: CompiledSystem, segments: PiecewiseLinear, start: float) -> None:
    """Raise ParameterError where an input is beyond its range."""
    known = compiled.description
    if segments is known.cache.checked_input[0]:
        return
    values = segments.values
    slopes = segments.slopes
    tables = [values] if known.input_names else []
    if any(slopes.ravel().tolist()) if slopes.size <= FEW else slopes.any():
        tables.append(values + slopes * (segments.ends - segments.starts(start))[:, None])
    for table in tables:
        if table.size > FEW:
            smallest = table.min(axis=0).tolist()
            largest = table.max(axis=0).tolist()
        else:
            columns = list(zip(*table.tolist(), strict=True))
            smallest = list(map(min, columns))
            largest = list(map(max, columns))
        if all(
            low <= smallest[i] and largest[i] <= high
            for i, (low, high) in known.input_limits.values()
        ):
            continue
        low = known.input_lower_limits
        high = known.input_upper_limits
        row, column = np.argwhere(~((table >= low) & (table <= high)))[0]
        _raise_for_input(
            compiled, int(column), table[row, column], f"before {segments.ends[row]:g} s"
        )
    if not any(table.flags.writeable for table in (segments.ends, values, slopes)):
        known.cache.checked_input = segments, None, None


def check_inputs(compiled: CompiledSystem, values: Array, when: str) -> None:
    """Raise ParameterError where one of the values (m,) of the inputs is beyond its range, or not a
    number.
    """
    known = compiled.description
    outside = np.flatnonzero(
        ~((values >= known.input_lower_limits) & (values <= known.input_upper_limits))
    )
    if outside.size:
        _raise_for_input(compiled, int(outside[0]), values[outside[0]], when)


def _raise_for_input(compiled: CompiledSystem, column: int, value: float, when: str) -> None:
    variable = compiled.system.input_variables[column]
    unit = "" if variable.unit in ("", "1") else f" {variable.unit}"
    allowed = f"{variable.minimum:g} to {variable.maximum:g}{unit}"
    raise ParameterError(
        f"the input '{variable.name}' is {value:g}{unit} {when};"
        f" allowed range: {allowed} ({variable.meaning})."
    )


def output_times(
    requested: float | npt.ArrayLike | None, start: float, duration: float, instants: Array
) -> Array:
    """The times [s] of the rows of a run, rising, with the instants of the inputs among them.

    given  spacing [s] or times [s]; by default 1/1000 of the run, but at most 10 ms
    """
    end = start + duration
    if requested is None:
        requested = min(duration / 1000, MAX_OUTPUT_STEP)
    if isinstance(requested, float | int) or not np.ndim(requested):
        spacing = as_float("simulate: output_times", requested)
        return merge_output_times(_grid(spacing, start, duration), instants, duration)
    grid = _times(requested)
    if grid.size and not (grid[0] >= start and grid[-1] <= end):
        raise ParameterError(f"simulate: output_times must lie within {start:g} to {end:g} s.")
    return merge_output_times(grid, instants, duration)


def _grid(spacing: float, start: float, duration: float) -> Array:
    if not 0 < spacing < np.inf:
        raise ParameterError(
            f"simulate: a spacing of output_times of {spacing!r} s is not positive and finite."
        )
    if duration / spacing > MAX_ROWS:
        raise ParameterError(
            f"simulate: a spacing of output_times of {spacing!r} s makes {duration / spacing:.3g}"
            f" rows of a run of {duration:g} s; {MAX_ROWS} are allowed. The result does not depend"
            " on it: choose a wider one."
        )
    grid: Array = np.arange(int(duration / spacing * (1 + 1e-12)) + 1, dtype=float)
    grid *= spacing
    grid += start
    return grid


def _times(instants: Any) -> Array:
    """Times [s] in rising order, each once, from a list of them."""
    try:
        times = np.array(instants, dtype=float)
    except (TypeError, ValueError):
        times = np.empty((0, 0))
    if times.ndim != 1:
        raise ParameterError(
            f"simulate: output_times is {one_line(instants)}; give a spacing [s] or a list of times"
            " [s]."
        )
    if np.isnan(times).any():
        raise ParameterError(
            f"simulate: output_times is {one_line(instants)}; a time is not a number (NaN)."
        )
    times = np.sort(times)
    return times[np.diff(times, prepend=-np.inf) > 0]


def merge_output_times(grid: Array, instants: Array, duration: float) -> Array:
    """The rows of a grid and the instants, both rising; a row of the grid close to an instant is
    replaced by it.
    """
    close = 1e-9 * duration
    if instants.size <= FEW_INSTANTS and grid.size:
        return _merge_few(grid, instants, close)
    behind = np.searchsorted(instants, grid)
    before = instants[np.maximum(behind - 1, 0)]
    after = instants[np.minimum(behind, instants.size - 1)]
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
    if upper == [row + 1 for row in lower] and len(set(lower)) == len(
        lower
    ):  # each takes the place of one row
        merged = grid.copy()
        merged[lower] = instants
        return merged
    parts = []
    row = 0
    for i, (low, high) in enumerate(zip(lower, upper, strict=True)):
        if low > row:
            parts.append(grid[row:low])
        if not i or instants[i] > instants[i - 1]:
            parts.append(instants[i : i + 1])
        row = max(row, high)
    parts.append(grid[row:])
    return np.concatenate(parts)

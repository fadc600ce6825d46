"""SampledSignal: inputs as connected straight lines, from points, recordings, functions of time or
a trajectory.
"""

import dataclasses
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar, NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import AirmuscleWarning, Array, ParameterError, as_float, one_line
from ...recording.recording import Recording
from .inputs import InputSignal, PiecewiseLinear, as_pairs, check_input_names, check_mapping

INITIAL_LINES = 64
"""Straight lines that a sampled function is first approximated by (chosen)."""
MAX_POINTS = 100_000
"""Points of a sampled function."""
ACCELERATION = "prescribed_acceleration"
"""The input of `PrescribedMotion`."""


@dataclasses.dataclass(frozen=True)
class SampledSignal(InputSignal):
    """Piecewise linear inputs, each a sequence of (time [s], value); constant before the first and
    after the last.
    """

    from_file: ClassVar[bool] = True

    points: Mapping[str, Sequence[tuple[float, float]]]

    def __post_init__(self) -> None:
        check_mapping("sampled signal", self.points)
        for name, points in self.points.items():
            if not as_pairs("sampled signal", "times", name, points):
                raise ParameterError(
                    f"the sampled signal of '{name}' has no points; write pairs of time [s] and"
                    " value."
                )

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.points)

    @classmethod
    def recorded(cls, recording: Recording, columns: Mapping[str, str]) -> "SampledSignal":
        """Columns of a recording as inputs: for each input the column that it follows, in SI.

        `SampledSignal.recorded(read_csv("bench.csv"), {"fill": "fill"})`
        """
        if not isinstance(recording, Recording):
            raise ParameterError(
                f"SampledSignal.recorded: {one_line(recording)} is no Recording; give what read_csv"
                " or read returns."
            )
        check_mapping("recorded signal", columns, "'column'")
        times = recording["time"].tolist()
        return cls(
            {
                name: tuple(zip(times, recording[c].tolist(), strict=True))
                for name, c in columns.items()
            }
        )

    @classmethod
    def sampled(
        cls,
        functions: Mapping[str, Callable[[float], float]],
        *,
        duration: float,
        start: float = 0.0,
        error: float = 1e-4,
    ) -> "SampledSignal":
        """Functions of time [s], approximated to within `error` by straight lines that are bisected
        until they are.

        Each line is compared with its function at a quarter, a half and three quarters of it, and
        none is longer than 1/64 of the duration (chosen); what a function does between these points
        is not seen. Raises ParameterError for a function that 100 000 points do not approximate,
        jumps (give a Schedule), or returns no finite number.
        """
        check_mapping("sampled signal", functions, "lambda t: 0.5")
        duration = as_float("SampledSignal.sampled: duration", duration)
        start = as_float("SampledSignal.sampled: start", start)
        error = as_float("SampledSignal.sampled: error", error)
        return cls(
            {
                name: approximate(name, f, start, start + duration, error)
                for name, f in functions.items()
            }
        )

    def segments(self, inputs: Sequence[str], start: float, duration: float) -> PiecewiseLinear:
        check_input_names(list(self.points), inputs)
        end = start + duration
        corners = {
            float(time)
            for points in self.points.values()
            for time, _ in points
            if start < time < end
        }
        ends = np.array([*sorted(corners), end])
        edges = np.concatenate([[start], ends])
        values = np.zeros((edges.size, len(inputs)))
        for i, name in enumerate(inputs):
            if name in self.points:
                times, levels = np.array(self.points[name], dtype=float).T
                values[:, i] = np.interp(edges, times, levels)
        return PiecewiseLinear(ends, values[:-1], np.diff(values, axis=0) / np.diff(edges)[:, None])

    def checked_segments(
        self, inputs: Sequence[str], start: float, duration: float
    ) -> PiecewiseLinear:
        """As of any signal; an AirmuscleWarning for an input that varies after the end of the run
        only.
        """
        for name, points in self.points.items():
            first = points[0][0]
            end = start + duration
            if first > end and any(value != points[0][1] for _, value in points):
                warnings.warn(
                    f"the points of the input '{name}' begin at {first:.6g} s, after the end of the"
                    f" run at {end:.6g} s: its first value is held. If its times have another zero,"
                    " subtract it, or set start_time.",
                    AirmuscleWarning,
                    stacklevel=7,
                )
        return super().checked_segments(inputs, start, duration)


def approximate(
    name: str, function: Callable[[float], float], start: float, end: float, error: float
) -> tuple[tuple[float, float], ...]:
    """Points of a function whose connecting lines stay within `error` of it."""
    if not (0 < error < np.inf and -np.inf < start < end < np.inf):
        raise ParameterError(
            f"the sampled signal of '{name}': from {start!r} to {end!r} s within {error!r}; the"
            " error and the duration must be greater than 0."
        )
    times = np.linspace(start, end, INITIAL_LINES + 1)
    values = _evaluate(name, function, times)
    while True:
        lengths = np.diff(times)
        parts = np.array([[0.25], [0.5], [0.75]])
        between = times[:-1] + parts * lengths
        exact = _evaluate(name, function, between.ravel())
        exact = exact.reshape(between.shape)
        on_lines = np.interp(between, times, values)
        errors = np.abs(exact - on_lines).max(axis=0)
        at = np.flatnonzero(errors > error)
        if at.size == 0:
            return tuple(zip(times.tolist(), values.tolist(), strict=True))
        if times.size + at.size > MAX_POINTS or lengths[at].min() < 1e-9 * (end - start):
            raise ParameterError(
                f"the sampled signal of '{name}' is not approximated to {error:g} by {times.size}"
                f" points: the error is {errors.max():g} at {times[np.argmax(errors)]:g} s. Allow a"
                " larger error; give a function that jumps as a Schedule."
            )
        times = np.insert(times, at + 1, between[1, at])
        values = np.insert(values, at + 1, exact[1, at])


def _evaluate(name: str, function: Callable[[float], float], times: Array) -> Array:
    """A function of time at times (N,). Raises ParameterError where it gives no finite number."""
    if not callable(function):
        raise ParameterError(
            f"the sampled signal of '{name}' is {function!r}; give a function of time [s]."
        )
    values = np.empty(times.size)
    for i, time in enumerate(times.tolist()):
        values[i] = as_float(f"the sampled signal of '{name}' at {time:g} s", function(time))
        if not np.isfinite(values[i]):
            raise ParameterError(
                f"the sampled signal of '{name}' is {values[i]} at {time:g} s; it must be finite."
            )
    return values


class Trajectory(NamedTuple):
    """The input signal that drives a motion, and its initial position [m] and speed [m/s].

    `simulate(plant, motion.input, duration=..., initial_state=plant.state_at(pressure=...,
    **motion.initial_state))`; with other inputs, `SampledSignal({**motion.input.points, "fill":
    ...})`.
    """

    input: SampledSignal
    initial_state: dict[str, float]


def spline_trajectory(
    times: npt.ArrayLike, positions: npt.ArrayLike, *, from_rest: bool = True
) -> Trajectory:
    """The motion along the cubic spline through positions (N,) [m] at times (N,) [s], for
    `PrescribedMotion`.

    The second derivative of a cubic spline is linear between its points, and so is an input: the
    motion is followed exactly. With `from_rest` it begins and ends at rest; otherwise the first two
    and the last two intervals are one cubic each, which needs four points. Begin the run at
    times[0]. Raises ParameterError for fewer than two points, points that are not finite, or times
    that do not rise.
    """
    try:
        t = np.asarray(times, dtype=float)
        y = np.asarray(positions, dtype=float)
    except (TypeError, ValueError):
        raise ParameterError(
            f"spline_trajectory: {times!r} and {positions!r} are not times [s] and positions [m]."
        ) from None
    needed = 2 if from_rest else 4
    if t.ndim != 1 or t.shape != y.shape or t.size < needed:
        raise ParameterError(
            f"spline_trajectory: give at least {needed} times and as many positions; they are"
            f" {t.shape} and {y.shape}."
        )
    if not (np.isfinite(t).all() and np.isfinite(y).all()):
        raise ParameterError("spline_trajectory: times and positions must be finite.")
    if not (np.diff(t) > 0).all():
        i = int(np.argmax(np.diff(t) <= 0))
        raise ParameterError(
            f"spline_trajectory: times must rise; {t[i]:g} s is followed by {t[i + 1]:g} s."
        )
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(t, y, bc_type="clamped" if from_rest else "not-a-knot")
    points = tuple((float(a), float(b)) for a, b in zip(t, spline(t, 2), strict=True))
    initial_state = {"position": float(y[0]), "speed": float(spline(t[0], 1))}
    return Trajectory(SampledSignal({ACCELERATION: points}), initial_state)

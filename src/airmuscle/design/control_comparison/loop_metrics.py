"""Metrics of one run of a control loop on any plant: errors, effort, strokes and air."""

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np

from ...core import Array
from ...engine.loop import COMMAND, SETPOINT, ControlLoop, PiecewiseLinear
from ...physics import Plant
from ...recording import Recording
from ..study.metrics import time_mean
from .run_costs import Mask

LATE_SHARE = 0.1
"""Share of a run, at its end, over which the steady-state error is the mean (chosen)."""
AIR_MASS = "air_mass"


@dataclasses.dataclass(frozen=True, eq=False)
class LoopMetrics:
    """Metrics of a run from the judged time on; errors by controlled column, in SI units.

    rmse       root mean square of the error r - y
    max_error  largest magnitude
    steady     mean magnitude over the last tenth of the run
    effort     root mean square of the commands about their means, as a share of their ranges; the
               mean over the commands
    strokes    travel of the inputs behind their drivers in full strokes [1/s], their sum
    busiest    that of the busiest input [1/s]
    air        air that flows into the muscles [kg/s]: sum of the increments of their air masses
               from sample to sample
    """

    rmse: Mapping[str, float]
    max_error: Mapping[str, float]
    steady: Mapping[str, float]
    effort: float
    strokes: float
    busiest: float
    air: float


def judge_run(
    plant: Plant, loop: ControlLoop, record: Recording, columns: Sequence[str], begin: float
) -> LoopMetrics:
    """The metrics of a complete run with rows at the sampling instants, from `begin` [s] after its
    start on; means are over time, by the trapezoidal rule.
    """
    time = np.asarray(record["time"], dtype=float)
    judged = time >= time[0] + begin - 1e-9
    t = time[judged]
    late = t >= t[-1] - LATE_SHARE * (time[-1] - time[0])
    errors = dict[str, Array]()
    for name in columns:
        error = record[f"{SETPOINT}{name}"] - record[name]
        errors[name] = np.asarray(error)[judged]
    strokes = input_strokes(plant, loop, record, float(t[0]))
    return LoopMetrics(
        rmse={name: _rms(t, error) for name, error in errors.items()},
        max_error={name: float(np.abs(error).max()) for name, error in errors.items()},
        steady={name: time_mean(t[late], np.abs(error[late])) for name, error in errors.items()},
        effort=_effort(plant, loop, record, judged),
        strokes=float(strokes.sum()),
        busiest=float(strokes.max(initial=0.0)),
        air=_air(record, judged),
    )


def _rms(time: Array, values: Array) -> float:
    """The root mean square over time."""
    return math.sqrt(time_mean(time, values**2))


def _effort(plant: Plant, loop: ControlLoop, record: Recording, judged: Mask) -> float:
    """The root mean square of the commands about their means, as a share of their ranges."""
    t = record["time"][judged]
    efforts = []
    for name, (low, high) in loop.command_ranges(plant).items():
        command = record[f"{COMMAND}{name}"][judged]
        about_mean = command - time_mean(t, command)
        efforts.append(_rms(t, about_mean) / (high - low))
    return float(np.mean(efforts))


def _air(record: Recording, judged: Mask) -> float:
    """The air [kg/s] that flows into the muscles; NaN for a plant without air masses."""
    duration = np.ptp(record["time"][judged])
    increments = [
        np.maximum(np.diff(record[name][judged]), 0.0).sum()
        for name in record
        if name.endswith(AIR_MASS)
    ]
    return float(np.sum(increments) / duration) if increments else math.nan


def input_strokes(plant: Plant, loop: ControlLoop, record: Recording, begin: float) -> Array:
    """Travel of each commanded input (m,) [full strokes/s] behind its driver, from `begin` [s]."""
    start = float(record["time"][0])
    end = float(record["time"][-1])
    signal = loop.as_open_loop(record)
    segments = signal.segments(plant.inputs, start, end - start)
    travel = travel_of(segments, start, begin)
    names = loop.controller.inputs
    strokes = [
        travel[place] / (variable.maximum - variable.minimum)
        for place, variable in enumerate(plant.input_variables)
        if variable.name in names
    ]
    return np.array(strokes) / (end - begin)


def travel_of(segments: PiecewiseLinear, start: float, begin: float) -> Array:
    """Length of the way of each input (m,) from `begin` [s] on: slopes and jumps of its segments,
    which start at `start` [s].
    """
    starts = segments.starts(start)
    durations = segments.ends - starts
    lasts = segments.values + durations[:, None] * segments.slopes
    moving = np.clip(segments.ends - begin, 0.0, durations)
    along = moving @ np.abs(segments.slopes)
    jumps = np.abs(segments.values[1:] - lasts[:-1])
    late = starts[1:] > begin
    return np.asarray(along + jumps[late].sum(axis=0))

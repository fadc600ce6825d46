"""Metrics of a run of the control benchmark: errors, settling, air, valve strokes and valve life."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array
from ...core.reference import Reference
from ...physics.plant.plant import Plant
from ...physics.pneumatics import FillDischarge, WithTubes, absolute_pressure
from ...physics.pneumatics.gas import REFERENCE_DENSITY
from ...recording import Recording
from .joints import BenchmarkJoint
from .signals import TaskSignals, stiffness_of
from .tasks import ControlTask

BONE2019 = Reference(
    key="bone-2019",
    authors="Bone, G. M., et al.",
    title="Discrete-valued model predictive control of a pneumatic actuator with on/off valves",
    where="Actuators 8(3):56",
    year=2019,
    note="metrics ITAE, RMSE, OS, SSE and switches per second",
)
Mask = npt.NDArray[np.bool_]
SETTLING_BAND = 0.5
"""Half width of the band in which a motion has settled [degree] (chosen)."""
STEADY_TIME = 0.3
"""Time at the end of a run over which the steady-state error is the mean [s] (chosen)."""
RATED_STROKES = 5e8
"""Strokes of a valve in its life (chosen; state that of the valve used)."""


@dataclasses.dataclass(frozen=True)
class TrackingMetrics:
    """Metrics of one run of a task; NaN where a metric does not exist for the task.

    rmse, max_error    root mean square and largest magnitude of the error r - y [degree], from the task's begin on
    itae                integral of (t - t_begin) |e| [degree s^2]
    settling            time from the event until the error remains within 0.5 degrees [s]; infinite if it does not
    overshoot           largest excess over the final set point [%] of the motion's change
    steady              mean magnitude of the error over the last 0.3 s [degree]; NaN for a sine
    air                 air drawn from the supply, as litres of reference atmosphere per second [l/s (ANR)]
    strokes             opening travel of all valves [full strokes/s]; for on/off valves openings and closings
    valve_life          of the busiest valve at this rate and 5e8 full strokes, one closing for each opening [h]
    stiffness_error     rms of the stiffness of the truth over that wanted, less 1 [%], over the last 0.3 s
    """

    rmse: float
    max_error: float
    itae: float
    settling: float
    overshoot: float
    steady: float
    air: float
    strokes: float
    valve_life: float
    stiffness_error: float


def track(
    joint: BenchmarkJoint, plant: Plant, task: ControlTask, signals: TaskSignals, record: Recording
) -> TrackingMetrics:
    """The metrics of a run of a task on a true joint; means are over time, by the trapezoidal rule."""
    time = np.asarray(record["time"], dtype=float)
    angle = np.degrees(np.asarray(record["angle"], dtype=float))
    wanted = np.degrees(np.interp(time, signals.time, signals.angle))
    judged, error = time >= task.begin - 1e-9, wanted - angle
    late = time >= task.duration - STEADY_TIME - 1e-9
    magnitude, t = np.abs(error[judged]), time[judged]
    strokes = _strokes(plant, record, judged)
    return TrackingMetrics(
        rmse=math.sqrt(_mean(t, error[judged] ** 2)),
        max_error=float(magnitude.max()),
        itae=float(np.trapezoid((t - t[0]) * magnitude, t)),
        settling=_settling(task, time, error),
        overshoot=_overshoot(task, wanted, angle, judged),
        steady=_mean(time[late], np.abs(error[late])) if task.event is not None else math.nan,
        air=_mean(t, _drawn_flow(plant, record)[judged]) / REFERENCE_DENSITY * 1e3,
        strokes=float(strokes.sum()),
        valve_life=2.0 * RATED_STROKES / float(strokes.max()) / 3600.0 if strokes.max() > 0 else math.inf,
        stiffness_error=_stiffness_error(joint, plant, signals, record, late),
    )


def _settling(task: ControlTask, time: Array, error: Array) -> float:
    if task.event is None:
        return math.nan
    outside = np.flatnonzero((np.abs(error) > SETTLING_BAND) & (time > task.event))
    if not outside.size:
        return 0.0
    last = outside[-1]
    return math.inf if last == time.size - 1 else float(time[last + 1] - task.event)


def _overshoot(task: ControlTask, wanted: Array, angle: Array, judged: Mask) -> float:
    change = wanted[-1] - wanted[0]
    if task.event is None or task.torque or task.stiffening or change == 0.0:
        return math.nan
    return max(0.0, 100.0 * float(((angle - wanted[-1]) / change)[judged].max()))


def _mean(time: Array, values: Array) -> float:
    """The mean over time of values (N,) at times (N,)."""
    return float(np.trapezoid(values, time) / (time[-1] - time[0]))


def _drawn_flow(plant: Plant, record: Recording) -> Array:
    """The mass flow (N,) [kg/s] from the supplies: also of air that a stuck valve loses.

    Of a circuit without a fill valve it is the flow into the muscle.
    """
    flow = np.zeros(len(record["time"]))
    for muscle, circuit in zip(plant.muscles, plant.circuits, strict=True):
        inner = circuit.circuit if isinstance(circuit, WithTubes) else circuit
        if not isinstance(inner, FillDischarge):
            flow += np.maximum(record[f"{muscle.name}.mass_flow"], 0.0)
            continue
        air = inner.supply.air({}, plant.ambient)
        tube = f"{muscle.name}.tube.pressure"
        pressure = record[tube] if tube in record.columns else record[f"{muscle.name}.pressure"]
        opening = np.asarray(record[f"{muscle.name}.fill"])
        absolute = absolute_pressure(np.asarray(pressure), plant.ambient)
        flow += np.maximum(inner.fill.mass_flow(air.pressure, absolute, opening, air.temperature), 0.0)
    return flow


def _strokes(plant: Plant, record: Recording, judged: Mask) -> Array:
    """Travel of each valve [full strokes/s] between the samples."""
    names = [name for name in plant.inputs if name != "external_torque"]
    span = np.ptp(np.asarray(record["time"])[judged])
    commands = [np.asarray(record[f"command.{name}"])[judged] for name in names]
    return np.array([float(np.abs(np.diff(each)).sum()) for each in commands]) / float(span)


def _stiffness_error(joint: BenchmarkJoint, plant: Plant, signals: TaskSignals, record: Recording, late: Mask) -> float:
    first, second = (np.asarray(record[name])[late] for name in joint.pressures)
    reached = stiffness_of(plant, first, second, np.asarray(record["angle"])[late])
    time = np.asarray(record["time"])[late]
    wanted = np.interp(time, signals.time, signals.stiffness)
    return 100.0 * math.sqrt(_mean(time, (reached / wanted - 1.0) ** 2))

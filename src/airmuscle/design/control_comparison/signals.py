"""Signals of a task, and the metrics of its run."""

import dataclasses
import functools
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...control.laws import AntagonisticInverse, WithStuckValve, static_force
from ...core import Array, ParameterError, check_known, published
from ...engine.loop import ControlLaw, Controller, ControlLoop, Driver, SampledSignal
from ...physics.plant.plant import Plant
from ...physics.pneumatics import REFERENCE_DENSITY
from ...recording import Recording
from ..study.metrics import time_mean
from . import ControlTask, JointMotion, JointRig
from .contenders import SensedController
from .run_costs import TORQUE_INPUT, drawn_flow, valve_travel

BISECTIONS = 40
ANGLE_STEP = 1e-4
"""Step of the angle [rad] for the speed of the muscles, by central differences (chosen)."""


class TaskSignals(NamedTuple):
    """Signals of a task at the sampling instants (N,), all in SI units.

    feed_forward is half the pressure difference [Pa] by which the model would follow the motion
    without friction, feed_forward_rate its rate [Pa/s]; stiffness is that of the model at these
    pressures [N m/rad].
    """

    time: Array
    angle: Array
    angular_speed: Array
    angular_acceleration: Array
    mean_pressure: Array
    feed_forward: Array
    feed_forward_rate: Array
    stiffness: Array

    def setpoint(self, names: Sequence[str]) -> SampledSignal:
        """The named signals as set points. Raises ParameterError for a name that a task does not
        have.
        """
        known = self._asdict()
        time = known.pop("time").tolist()
        check_known("a task has no set point", names, known)
        return SampledSignal(
            {name: tuple(zip(time, known[name].tolist(), strict=True)) for name in names}
        )


def task_signals(joint: JointRig, task: ControlTask) -> TaskSignals:
    """The signals of a task at the sampling instants of a joint; kept, because every run of the
    task needs them.
    """
    try:
        hash(task)
    except TypeError:  # a motion of a user may have no hash
        return _signals(joint, task)
    return _kept_signals(joint, task)


def _signals(joint: JointRig, task: ControlTask) -> TaskSignals:
    h = joint.sample_time
    count = round(task.duration / h) + 2
    time: Array = h * np.arange(count, dtype=float)
    angle, speed, acceleration = task.motion.at(time)
    points = np.array(task.stiffening or ((0.0, 0.0),))
    mean = joint.mean_pressure + np.interp(time, *points.T)
    half, ahead, behind = (
        inverse_dynamics(joint, joint.model, task.motion, instants, mean)
        for instants in (time, time + 0.5 * h, time - 0.5 * h)
    )
    # at rest the sign of the friction, and with it the difference, is undetermined
    is_at_rest = np.isclose(speed, 0.0)
    rate = np.where(is_at_rest, 0.0, (ahead - behind) / h)
    model = joint.model
    inverse = AntagonisticInverse(model.muscles, model.mechanism)
    stiffness = np.asarray(inverse.stiffness(mean + half, mean - half, angle), dtype=float)
    return TaskSignals(
        time,
        angle,
        speed,
        acceleration,
        mean,
        half,
        rate,
        stiffness,
    )


_kept_signals = functools.lru_cache(maxsize=128)(_signals)


def inverse_dynamics(
    joint: JointRig, plant: Plant, motion: JointMotion, time: Array, mean: Array
) -> Array:
    """Half the pressure difference (N,) [Pa] by which a plant without friction follows a motion at
    times (N,) [s].

    The torque of both muscles, with their dampers, gives the acceleration of the motion; it is
    solved for the pressure difference by bisection within the range of the joint. A motion beyond
    the range receives the limit.
    """
    angle, speed, acceleration = motion.at(time)
    (coordinate,) = plant.mechanism.coordinates
    wanted = plant.mechanism.driving_force(
        {coordinate.name: angle}, {coordinate.speed: speed}, acceleration
    )
    low = np.full(time.shape, -joint.pressure_span)
    high = np.full(time.shape, joint.pressure_span)
    for _ in range(BISECTIONS):
        half = 0.5 * (low + high)
        below = _torque(plant, angle, speed, mean + half, mean - half) < wanted
        low = np.where(below, half, low)
        high = np.where(below, high, half)
    return np.asarray(0.5 * (low + high))


def angular_acceleration(
    joint: JointRig, plant: Plant, angle: float, speed: float, half: float
) -> float:
    """Acceleration [rad/s2] of a plant without friction at an angle [rad], a speed [rad/s] and half
    a pressure difference [Pa] about the mean pressure."""
    torque = _torque(plant, angle, speed, joint.mean_pressure + half, joint.mean_pressure - half)
    coordinate = plant.mechanism.coordinates[0]
    inputs = {variable.name: 0.0 for variable in plant.mechanism.inputs}
    q = {coordinate.name: angle}
    v = {coordinate.speed: speed}
    forces = {coordinate.name: torque}
    return float(plant.mechanism.acceleration(q, v, forces, inputs)[coordinate.name])


def _torque(plant: Plant, angle: Any, speed: Any, first: Any, second: Any) -> Any:
    """Torque of both muscles [N m] with their dampers and without friction, at their gauge
    pressures [Pa].
    """
    mechanism = plant.mechanism
    lengths = plant.resting_lengths
    name = plant.mechanism.coordinates[0].name
    here, ahead, behind = (
        mechanism.contractions({name: angle + i * ANGLE_STEP}, lengths) for i in (0.0, 0.5, -0.5)
    )
    tensions = [
        static_force(muscle, p, c)
        - muscle.damper.force(p, c, length * (b - a) / ANGLE_STEP * speed)
        for muscle, length, p, c, b, a in zip(
            plant.muscles, lengths, (first, second), here, ahead, behind, strict=True
        )
    ]
    return mechanism.generalised_forces({name: angle}, tensions, lengths)[name]


def task_loop(
    joint: JointRig,
    law: Controller,
    task: ControlTask,
    plant: Plant,
    drivers: Mapping[str, Driver],
    signals: TaskSignals | None = None,
) -> ControlLoop:
    """The control loop of a task at a plant with drivers of its valves; signals other than those of
    the task.
    """
    if TORQUE_INPUT not in plant.inputs:
        raise ParameterError(
            f"task '{task.name}': the plant has no input '{TORQUE_INPUT}'; wrap its mechanism in "
            "JointWithExternalTorque."
        )
    if task.stuck is not None:
        acting = law.actuation if isinstance(law, SensedController) else law
        assert isinstance(acting, ControlLaw)
        faulty = WithStuckValve(acting, task.stuck.input, task.stuck.time, task.stuck.opening)
        law = (
            dataclasses.replace(law, actuation=faulty)
            if isinstance(law, SensedController)
            else faulty
        )
    setpoint = (signals or task_signals(joint, task)).setpoint(law.setpoints)
    torque = SampledSignal({TORQUE_INPUT: task.torque or ((0.0, 0.0),)})
    return ControlLoop(law, joint.sample_time, setpoint, torque, drivers)


BONE2019 = published("bone-2019")
SETTLING_BAND = 0.5
"""Half width of the band in which a motion has settled [degree] (chosen)."""
STEADY_TIME = 0.3
"""Time at the end of a run over which the steady-state error is the mean [s] (chosen)."""
RATED_STROKES = 5e8
"""Strokes of a valve in its life (chosen; state that of the valve used)."""


def _metric(name: str, unit: str, shown: str) -> Any:
    """A metric with its name, its SI unit and the unit in which it is shown, that of the field."""
    return dataclasses.field(metadata={"column": (name, unit, shown)})


@dataclasses.dataclass(frozen=True, eq=False)
class TrackingMetrics:
    """Metrics of one run of a task; NaN where a metric does not exist for the task, as which it
    equals another one.

    rmse, max_error    root mean square and largest magnitude of the error r - y [degree], from the
                       task's begin on
    itae                integral of (t - t_begin) |e| [degree s^2]
    settling            time from the event until the error remains within 0.5 degrees [s]; infinite
                        if it does not
    overshoot           largest excess over the final set point [%] of the motion's change
    steady              mean magnitude of the error over the last 0.3 s [degree]; NaN for a sine
    air                 air drawn from the supply, as litres of reference atmosphere per second [l/s
                        (ANR)]
    strokes             opening travel of all valves [full strokes/s]; for on/off valves openings
                        and closings
    valve_life          of the busiest valve at this rate and 5e8 full strokes, one closing for each
                        opening [h]
    stiffness_error     rms of the stiffness of the truth over that wanted, less 1 [%], over the
                        last 0.3 s
    """

    rmse: float = _metric("rms error", "rad", "deg")
    max_error: float = _metric("maximum error", "rad", "deg")
    itae: float = _metric("ITAE", "rad s^2", "deg s^2")
    settling: float = _metric("settling time", "s", "s")
    overshoot: float = _metric("overshoot", "1", "%")
    steady: float = _metric("steady-state error", "rad", "deg")
    air: float = _metric("air", "m3/s (ANR)", "l/s (ANR)")
    strokes: float = _metric("valve strokes", "1/s", "1/s")
    valve_life: float = _metric("valve life", "s", "h")
    stiffness_error: float = _metric("stiffness error", "1", "%")

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, TrackingMetrics):
            return NotImplemented
        return self._comparable() == other._comparable()

    def __hash__(self) -> int:
        return hash(self._comparable())

    def _comparable(self) -> tuple[float | None, ...]:
        """The metrics, None where one does not exist."""
        values = dataclasses.astuple(self)
        return tuple(None if math.isnan(value) else value for value in values)


METRICS = {field.name: field.metadata["column"] for field in dataclasses.fields(TrackingMetrics)}
"""Names, SI units and shown units of the metrics."""


def track(
    joint: JointRig, plant: Plant, task: ControlTask, signals: TaskSignals, record: Recording
) -> TrackingMetrics:
    """The metrics of a run of a task on a true joint; means are over time, by the trapezoidal
    rule.
    """
    time = np.asarray(record["time"], dtype=float)
    angle = np.degrees(np.asarray(record["angle"], dtype=float))
    wanted = np.degrees(np.interp(time, signals.time, signals.angle))
    judged = time >= task.begin - 1e-9
    error = wanted - angle
    late = time >= task.duration - STEADY_TIME - 1e-9
    magnitude = np.abs(error[judged])
    t = time[judged]
    strokes = valve_travel(plant, record, judged)
    state = (np.asarray(record[name])[late] for name in (*joint.pressures, "angle"))
    reached = np.asarray(
        AntagonisticInverse(plant.muscles, plant.mechanism).stiffness(*state), dtype=float
    )
    stiff = np.interp(time[late], signals.time, signals.stiffness)
    settling = overshoot = math.nan
    if task.event is not None:
        outside = np.flatnonzero((np.abs(error) > SETTLING_BAND) & (time > task.event))
        settling = (
            float(np.append(time, math.inf)[outside[-1] + 1] - task.event) if outside.size else 0.0
        )
        change = wanted[-1] - wanted[0]
        if not (task.torque or task.stiffening or change == 0.0):
            overshoot = max(0.0, 100.0 * float(((angle - wanted[-1]) / change)[judged].max()))
    return TrackingMetrics(
        rmse=math.sqrt(time_mean(t, error[judged] ** 2)),
        max_error=float(magnitude.max()),
        itae=float(np.trapezoid((t - t[0]) * magnitude, t)),
        settling=settling,
        overshoot=overshoot,
        steady=time_mean(time[late], np.abs(error[late])) if task.event is not None else math.nan,
        air=time_mean(t, drawn_flow(plant, record)[judged]) / REFERENCE_DENSITY * 1e3,
        strokes=float(strokes.sum()),
        valve_life=(
            2.0 * RATED_STROKES / float(strokes.max()) / 3600.0 if strokes.max() > 0 else math.inf
        ),
        stiffness_error=100.0 * math.sqrt(time_mean(time[late], (reached / stiff - 1.0) ** 2)),
    )

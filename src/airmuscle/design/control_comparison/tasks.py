"""Tasks of a comparison of controllers of a joint, with their motions."""

import abc
import dataclasses
import math

import numpy as np

from ...core import Array, ParameterError, check_field_types, check_known


@dataclasses.dataclass(frozen=True)
class JointMotion(abc.ABC):
    """A wanted motion of a joint angle (interface)."""

    def __post_init__(self) -> None:
        check_field_types(self)

    @abc.abstractmethod
    def at(self, time: Array) -> Array:
        """Angle [rad], angular speed [rad/s] and acceleration [rad/s2] as rows (3, N) at times (N,)
        [s].
        """


@dataclasses.dataclass(frozen=True)
class StepMotion(JointMotion):
    """An angle of 0 until `begin` [s], then `amplitude` [rad]; speed and acceleration are stated as
    0.
    """

    amplitude: float
    begin: float

    def at(self, time: Array) -> Array:
        # a sampling instant that is rounded below the time of the step belongs to the step
        angle = np.where(time > self.begin - 1e-9, self.amplitude, 0.0)
        return np.stack([angle, np.zeros_like(time), np.zeros_like(time)])


@dataclasses.dataclass(frozen=True)
class RampMotion(JointMotion):
    """A rise from 0 to `amplitude` [rad] with constant speed from `begin` [s] on within `rise_time`
    [s].
    """

    amplitude: float
    begin: float
    rise_time: float

    def at(self, time: Array) -> Array:
        share = (time - self.begin) / self.rise_time
        moving = (share > 0.0) & (share < 1.0)
        speed = np.where(moving, self.amplitude / self.rise_time, 0.0)
        return np.stack([self.amplitude * np.clip(share, 0.0, 1.0), speed, np.zeros_like(time)])


@dataclasses.dataclass(frozen=True)
class SineMotion(JointMotion):
    """A sin(2 pi f t) r(t), where r rises from 0 to 1 within the first period as the fifth-degree
    polynomial of minimum jerk, so that the motion begins at rest."""

    amplitude: float
    frequency: float

    def at(self, time: Array) -> Array:
        w = 2.0 * math.pi * self.frequency
        powers = self.frequency ** np.arange(3.0)
        # the rise and its derivatives by the time
        periods = time * self.frequency
        r, r1, r2 = _fifth_degree(periods) * powers[:, None]
        phase = w * time
        s = np.sin(phase)
        c = np.cos(phase)
        angle = r * s
        speed = r1 * s + w * r * c
        coupled = 2.0 * w * r1 * c
        acceleration = r2 * s + coupled - w * w * r * s
        columns = [angle, speed, acceleration]
        return self.amplitude * np.stack(columns)


@dataclasses.dataclass(frozen=True)
class MinimumJerkMotion(JointMotion):
    """A rise from 0 to `amplitude` [rad] from `begin` [s] on within `rise_time` [s] with minimum
    jerk.

    theta = A (10 s^3 - 15 s^4 + 6 s^5), s = (t - t_0)/T. Reference: Flash and Hogan (1985).
    """

    amplitude: float
    begin: float
    rise_time: float

    def at(self, time: Array) -> Array:
        scale = self.amplitude / self.rise_time ** np.arange(3.0)
        return scale[:, None] * _fifth_degree((time - self.begin) / self.rise_time)


@dataclasses.dataclass(frozen=True)
class SumOfMotions(JointMotion):
    """The sum of several motions."""

    parts: tuple[JointMotion, ...]

    def at(self, time: Array) -> Array:
        return np.asarray(np.sum([part.at(time) for part in self.parts], axis=0))


def _fifth_degree(share: Array) -> Array:
    """The polynomial 10 s^3 - 15 s^4 + 6 s^5 and its derivatives by s (3, N), constant outside 0 to
    1.
    """
    s = np.clip(share, 0.0, 1.0)
    value = s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
    first = 30.0 * s**2 * (1.0 - s) ** 2
    second = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)
    return np.stack([value, first, second])


DEGREE = math.pi / 180.0
SINES = {0.1: 20.0, 0.5: 20.0, 1.0: 20.0, 2.0: 20.0, 3.0: 20.0, 5.0: 5.0}
"""Amplitudes [degree] of the sines by frequency [Hz] (chosen); at 5 Hz 20 degrees exceed the torque
of the pair.
"""
SINE_PERIODS = {frequency: (2, 1) if frequency < 0.2 else (5, 3) for frequency in SINES}
"""Periods of each sine, and those of them before it is judged (chosen)."""


@dataclasses.dataclass(frozen=True)
class StuckValve:
    """A fault: the valve of an input remains at an opening from a time [s] on."""

    input: str
    time: float
    opening: float

    def __post_init__(self) -> None:
        check_field_types(self)


@dataclasses.dataclass(frozen=True)
class ControlTask:
    """A task of a joint in a comparison of controllers.

    motion     wanted angle of the joint
    duration   of the run [s]
    begin      from which on the errors are judged [s]
    event      time of a step, a disturbance or the end of a motion [s], from which settling is
               counted; None: no settling
    torque     points (time [s], torque [N m]) of the external torque, linear between them
    stiffening points (time [s], pressure [Pa]) that are added to the mean pressure of the pair,
    linear between them
    stuck      a valve that sticks
    """

    name: str
    motion: JointMotion
    duration: float
    begin: float = 0.0
    event: float | None = None
    torque: tuple[tuple[float, float], ...] = ()
    stiffening: tuple[tuple[float, float], ...] = ()
    stuck: StuckValve | None = None

    def __post_init__(self) -> None:
        check_field_types(self)
        if not 0 < self.duration < math.inf:
            raise ParameterError(
                f"task '{self.name}': duration is {self.duration!r} s; it must be positive, finite."
            )
        for name, t in (("begin", self.begin), ("event", self.event)):
            if t is not None and not 0 <= t < self.duration:
                raise ParameterError(
                    f"task '{self.name}': {name} is {t:g} s; allowed range: 0 to"
                    f" {self.duration:g} s."
                )


_HOLD = MinimumJerkMotion(10.0 * DEGREE, 0.0, 0.6)
_HALF_SINE = ((0.0, 0.0), *((1.5 + 0.1 * i / 8, 4.0 * math.sin(math.pi * i / 8)) for i in range(9)))
STANDARD_TASKS: tuple[ControlTask, ...] = (
    ControlTask("step", StepMotion(15.0 * DEGREE, 0.2), 2.2, begin=0.2, event=0.2),
    ControlTask("ramp", RampMotion(20.0 * DEGREE, 0.2, 1.0), 2.2, begin=0.2, event=1.2),
    *(
        ControlTask(
            f"sine {f:g} Hz", SineMotion(SINES[f] * DEGREE, f), periods / f, begin=earlier / f
        )
        for f, (periods, earlier) in SINE_PERIODS.items()
    ),
    ControlTask(
        "minimum jerk", MinimumJerkMotion(25.0 * DEGREE, 0.2, 0.5), 2.0, begin=0.2, event=0.7
    ),
    ControlTask(
        "load change",
        _HOLD,
        3.0,
        begin=1.5,
        event=1.5,
        torque=((0.0, 0.0), (1.5, 0.0), (1.502, -2.0)),
    ),
    ControlTask("hold", _HOLD, 4.0, begin=2.0),
    ControlTask("torque disturbance", _HOLD, 3.0, begin=1.5, event=1.5, torque=_HALF_SINE),
    ControlTask(
        "stiffness change",
        _HOLD,
        3.0,
        begin=1.5,
        event=1.5,
        stiffening=((0.0, 0.0), (1.5, 0.0), (1.7, 0.75e5)),
    ),
    ControlTask(
        "valve stuck",
        SineMotion(10.0 * DEGREE, 0.5),
        6.0,
        begin=2.0,
        stuck=StuckValve("left.discharge", 2.0, 0.1),
    ),
)
"""Standard tasks of a joint; all amplitudes, times and disturbances are chosen."""


def tuning_tasks(*fast: SineMotion) -> tuple[ControlTask, ControlTask]:
    """What all controllers of a joint are tuned for (chosen), none of the tasks that are judged.

    Smooth motions with sines of 0.8, 1.7 and 3.7 Hz, and the further ones, with a step of the
    torque; and a step of the angle that must have settled. Their durations are equal.
    """
    motions = _tuning_motions(SineMotion(2.0 * DEGREE, 3.7), *fast)
    return (
        ControlTask("tuning: motions", motions, 3.0, torque=((0.0, 0.0), (1.8, 0.0), (1.81, 1.0))),
        ControlTask("tuning: step", StepMotion(18.0 * DEGREE, 0.1), 3.0),
    )


def commissioning_tasks() -> tuple[ControlTask, ControlTask]:
    """What controllers of proportional valves are commissioned for on a truth (chosen), none of the
    tasks judged.

    The motions of tuning with larger fast sines, which the gains of a feed-forward need; and the
    step, with a torque in both directions. Against a torque during the motions, or one whose mean
    is not 0, those gains would be misused.
    """
    motions = _tuning_motions(SineMotion(5.0 * DEGREE, 3.7), SineMotion(3.0 * DEGREE, 5.9))
    torque = ((1.2, 0.0), (1.21, 1.0), (1.8, 1.0), (1.81, -1.0), (2.4, -1.0), (2.41, 0.0))
    return (
        ControlTask("commissioning: motions", motions, 3.0),
        ControlTask(
            "commissioning: step", StepMotion(18.0 * DEGREE, 0.1), 3.0, torque=((0.0, 0.0), *torque)
        ),
    )


def _tuning_motions(*fast: SineMotion) -> SumOfMotions:
    rises = MinimumJerkMotion(10.0 * DEGREE, 0.1, 0.6), MinimumJerkMotion(-14.0 * DEGREE, 1.0, 0.5)
    return SumOfMotions(
        (*rises, SineMotion(8.0 * DEGREE, 0.8), SineMotion(8.0 * DEGREE, 1.7), *fast)
    )


TUNING_BEGIN = 0.7
"""Time from which on errors count in tuning [s] (chosen): 0.6 s after the step."""


def find_tasks(names: tuple[str, ...]) -> tuple[ControlTask, ...]:
    """Standard tasks by their names, all without names. Raises ParameterError for an unknown
    one.
    """
    known = {task.name: task for task in STANDARD_TASKS}
    check_known("there is no task", names, known)
    return tuple(known[name] for name in dict.fromkeys(names)) or STANDARD_TASKS

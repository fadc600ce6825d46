"""Iterative learning in a comparison of controllers: a task repeated on the truth, with a learned
feed-forward signal.
"""

import dataclasses
from dataclasses import replace

import numpy as np

from ...control.laws.iterative_learning import IterativeLearning
from ...core import Array, ParameterError, ShortRepr, check_whole, leaves
from ...engine.loop import WithSensors
from ...engine.run import simulate
from . import ContenderResult, ControlTask, TruePlant
from .commissioning import on_truth
from .rig import JointRig
from .signals import TaskSignals, task_loop, task_signals

SIGNAL = "feed_forward"
RATE = "feed_forward_rate"
REPETITIONS = 30
"""Trials with the last signal and other noise (chosen)."""
STEP = 0.05e5
"""Step of the feed-forward signal [Pa] from which the impulse response of the model is computed
(chosen).
"""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class LearningCurve(ShortRepr):
    """The trials of a task: rms errors (J,) [degree] from the task's begin on, and the last signal
    (N,) [Pa].

    The first trial is that before any learning. `spread` is the range of the rms errors [degree] of
    the last signal, repeated with other noise: differences of trials below it are no effect of the
    learning.
    """

    task: ControlTask
    contender: str
    errors: Array
    signal: Array
    spread: float


def learn(
    joint: JointRig,
    contender: ContenderResult,
    task: ControlTask,
    *,
    trials: int = 31,
    cutoff: float = 12.0,
    change_weight: float = 0.03,
    seed: int = 1,
    truth: int = 0,
) -> LearningCurve:
    """Repeat a task on a truth and improve the feed-forward of a contender, tuned for the models
    alone.

    The law is `IterativeLearning`. The impulse response is that of the nominal model with the
    contender's feedback; the error is that of the encoder, whose dead time is known afterwards.
    Each trial begins at the same state with other noise. `cutoff` [Hz] of the filter and
    `change_weight` are chosen; `truth` is the place of the truth. Raises ParameterError for a
    contender without the set points `feed_forward` and `feed_forward_rate`, or fewer than two
    trials.
    """
    law = contender.law
    if not {SIGNAL, RATE} <= set(law.setpoints) or not isinstance(law, WithSensors):
        raise ParameterError(
            f"learn: contender '{contender.name}' has no set points '{SIGNAL}' and '{RATE}', which"
            " are learned, or is no ControlLaw."
        )
    check_whole("learn", "trials", trials, 2)
    signals = task_signals(joint, task)
    count = round(task.duration / joint.sample_time)
    lead = next((leaf.value for leaf in leaves(law) if leaf.path.endswith("lead_time")), 0.0)
    signal = (signals.feed_forward + lead * signals.feed_forward_rate)[:count]  # before learning
    response = _step_response(joint, law, task, signals, count)
    learning = IterativeLearning.from_step_response(
        response,
        STEP,
        joint.sample_time,
        change_weight=change_weight,
        cutoff=cutoff,
        minimum=-joint.pressure_span,
        maximum=joint.pressure_span,
    )
    true = joint.truths[truth]
    wanted = signals.angle[1 : count + 1]
    start, sensed = joint.start(true.plant), on_truth(law, true.extra_delay)
    judged = signals.time[1 : count + 1] >= task.begin

    def tried(number: int, signal: Array) -> tuple[Array, float]:
        """The angle (N,) [rad] of a trial with its own noise, and its rms error [degree]."""
        noisy = replace(sensed, seed=float(seed + number))
        angle = _trial(joint, true, noisy, task, signals, signal, start)
        return angle, float(np.degrees(np.sqrt(np.mean((wanted - angle)[judged] ** 2))))

    errors = []
    last = signal
    for number in range(trials):
        last = signal
        angle, error = tried(number, signal)
        errors.append(error)
        signal = learning.improve(signal, wanted - joint.read_angle(angle))
    repeated = [errors[-1], *(tried(trials + i, last)[1] for i in range(REPETITIONS))]
    return LearningCurve(task, contender.name, np.array(errors), last, float(np.ptp(repeated)))


def _step_response(
    joint: JointRig, law: WithSensors, task: ControlTask, signals: TaskSignals, count: int
) -> Array:
    """The change (N,) [rad] of the angle of the model at rest by a step of the signal."""
    rest = signals._replace(angle=np.zeros_like(signals.angle))
    known = TruePlant("model", joint.model, joint.drivers)
    start = joint.start(joint.model)
    silent = replace(law, sensors=tuple(replace(s, noise=0.0, resolution=0.0) for s in law.sensors))
    quiet = replace(task, torque=(), stiffening=(), stuck=None)
    with_step, without = (
        _trial(joint, known, silent, quiet, rest, np.full(count, value), start)
        for value in (STEP, 0.0)
    )
    return with_step - without


def _trial(
    joint: JointRig,
    truth: TruePlant,
    law: WithSensors,
    task: ControlTask,
    signals: TaskSignals,
    signal: Array,
    start: dict[str, float],
) -> Array:
    """The angle (N,) [rad] one sample after each element of a feed-forward signal (N,) [Pa]."""
    padded = np.append(signal, np.full(signals.time.size - signal.size, signal[-1]))
    learned = signals._replace(feed_forward=padded, feed_forward_rate=np.zeros_like(padded))
    loop = task_loop(joint, law, task, truth.plant, truth.drivers, learned)
    duration = signal.size * joint.sample_time
    record = simulate(
        truth.plant, loop, duration=duration, initial_state=start, output_times=joint.sample_time
    )
    return np.interp(signals.time[1 : signal.size + 1], record["time"], record["angle"])

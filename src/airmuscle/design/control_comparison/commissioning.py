"""Gains in a comparison of controllers: searches for the family of models, and commissioning by
runs on a truth.
"""

import contextlib
import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

import numpy as np

from ...core import Array, PhysicsError, SimulationError, leaves
from ...engine.loop import Controller, WithSensors
from ...engine.run import RungeKutta4, simulate
from ...recording import Recording
from ..tuning import LoopCase, RootMeanSquareError, Tuning, tune
from ..tuning.case import GainRange, with_gains
from ..tuning.optimisation import MIN_SETS
from .contenders import Contender, SensedController, complete
from .rig import JointRig
from .run_costs import valve_travel
from .signals import task_loop, task_signals
from .tasks import DEGREE, TUNING_BEGIN, ControlTask
from .true_plant import TruePlant

SETS_PER_GAIN: int = 300
COMMISSIONING_RUNS: int = 60
"""Most sets of gains for each gain of a search, and most runs of a commissioning (chosen)."""
TUNING_INTEGRATOR = RungeKutta4(5e-4)
"""Integrator of the searches (chosen); the median tracking index differs by less than 1e-6 from
Rodas4(1e-6).
"""
SEARCH_SPREAD = 0.05
"""Relative difference of the best objectives of two searches beyond which the worse one is
restarted (chosen).
"""
RESTARTS = 2
"""Most restarts of the searches of a contender (chosen)."""
Progress = Callable[[str, int, int], None]
SensedLaw = TypeVar("SensedLaw", bound=Controller)
PROBE = 0.04
DAMPING = 1e-4
FIRST_REGION = 0.5
LEAST_REGION = 0.1
LEAST_GAIN = 0.02
"""Step of a difference quotient, relative damping of the least squares, first radius of the trusted
region and the least one with derivatives measured anew, in parts of the ranges, and relative gain
of a small step (chosen)."""


def search_gains(
    joint: JointRig,
    contender: Contender,
    seeds: Sequence[int],
    sets_per_gain: int,
    progress: Progress,
) -> list[tuple[Tuning | None, int]]:
    """The search of each seed, with the number of its restarts.

    Where the best objectives of two seeds differ by more than SEARCH_SPREAD, the worst search is
    restarted with another sample of the ranges and all its sets of gains, and keeps its better
    result: until all agree, at most RESTARTS times. A restart knows nothing of the gains that
    another seed has found.
    """
    tunings = [find_gains(joint, contender, seed, sets_per_gain, progress) for seed in seeds]
    restarts = [0 for _ in seeds]
    while sum(restarts) < RESTARTS and all(tunings):
        objectives = [tuning.objective for tuning in tunings if tuning]
        worst = int(np.argmax(objectives))
        if objectives[worst] <= (1.0 + SEARCH_SPREAD) * min(objectives):
            break
        restarts[worst] += 1
        again = find_gains(
            joint, contender, seeds[worst] + 1_000_000 * restarts[worst], sets_per_gain, progress
        )
        tunings[worst] = min(
            tunings[worst], again, key=lambda tuning: tuning.objective if tuning else math.inf
        )
    return list(zip(tunings, restarts, strict=True))


def tuned_law(
    joint: JointRig, contender: Contender, seed: int, tuning: Tuning | None
) -> Controller:
    """The completed law of a contender with the gains of a search, which may be that of another
    contender.
    """
    law = complete(joint, contender, seed).law
    gains = tuning.gains if tuning else {}
    tuned: Controller = with_gains(law, alike(law, gains) if contender.tuned_as else gains)
    return tuned


def find_gains(
    joint: JointRig, contender: Contender, seed: int, sets_per_gain: int, progress: Progress
) -> Tuning | None:
    """The search for the gains that are best for the tuning tasks in the family of models; None:
    nothing is tuned.
    """
    completed = complete(joint, contender, seed)
    if not completed.bounds or not sets_per_gain:
        return None
    cases = []
    for task in joint.tuning_tasks:
        loop = task_loop(joint, completed.law, task, joint.model, joint.drivers)
        for name, plant in joint.family.items():
            cases.append(LoopCase(f"{task.name}, {name}", plant, loop, joint.start(plant)))
    return tune(
        cases,
        completed.bounds,
        duration=joint.tuning_tasks[0].duration,
        index=RootMeanSquareError({"angle": DEGREE}, TUNING_BEGIN),
        objective=joint.objective,
        simulations=max(sets_per_gain * len(completed.bounds), MIN_SETS) * len(cases),
        seed=seed,
        integrator=None if joint.switching else TUNING_INTEGRATOR,
        progress=lambda done, total: progress(f"tuning {contender.name}", done, total),
    )


@dataclasses.dataclass(frozen=True)
class Commissioning:
    """The gains that suit a truth best, by path [SI]; rms errors with strokes [rad] before and
    after; the runs.
    """

    gains: Mapping[str, float]
    before: float
    after: float
    runs: int


class _Spent(Exception):
    """All runs are used."""


def commission(
    joint: JointRig,
    truth: TruePlant,
    law: Controller,
    bounds: Mapping[str, tuple[float, float]],
    tasks: Sequence[ControlTask],
    *,
    runs: int,
) -> Commissioning:
    """The gains within their bounds with which a truth follows some tasks best, with at most so
    many runs.

    law     tuned controller of the valves behind the sensors, whose gains are the first point
    bounds  minimum and maximum [SI] of each gain by its path

    Each set of gains is tried in all tasks. Each run is judged by the error of set point and
    reading of the encoder, whose dead time is known afterwards, and by the strokes commanded of
    proportional valves: Gauss-Newton steps in a trusted region that shrinks where a step does not
    help. Their derivatives are difference quotients, corrected by what each step has shown
    (Broyden's update), and measured again where a step does not help or hardly helps. Nothing but
    the sensors of the truth is used.
    """
    ranges = [GainRange(path, *pair) for path, pair in bounds.items()]
    known = {leaf.path: leaf.value for leaf in leaves(law)}
    start = np.array(
        [
            float(
                gain_range.to_unit(np.clip(known[gain_range.path], gain_range.low, gain_range.high))
            )
            for gain_range in ranges
        ]
    )
    spent, complete = 0, list[tuple[float, Array]]()

    def gains(point: Array) -> dict[str, float]:
        return {
            gain_range.path: float(gain_range.from_unit(value))
            for gain_range, value in zip(ranges, point, strict=True)
        }

    def errors(point: Array) -> Array | None:
        """The errors of the encoder (N,) [rad] in all tasks; None if a run fails. Raises _Spent
        without runs left.
        """
        nonlocal spent
        if spent + len(tasks) > runs:
            raise _Spent
        spent += len(tasks)
        changed = with_gains(law, gains(point))
        outcomes = [tracking_errors(joint, truth, changed, task) for task in tasks]
        done = [outcome for outcome in outcomes if outcome is not None]
        if len(done) < len(outcomes):
            return None
        complete.append((_rms(np.concatenate(done)), point))
        return np.concatenate(done)

    with contextlib.suppress(_Spent):
        _descend(errors, start, errors(start))
    before, _ = complete[0] if complete else (np.inf, start)
    after, best = min(complete, key=lambda pair: pair[0], default=(np.inf, start))
    return Commissioning(gains(best), before, after, spent)


def _descend(measure: Callable[[Array], Array | None], point: Array, errors: Array | None) -> None:
    """Gauss-Newton steps until all runs are used, with derivatives that are measured or corrected
    by the last steps.
    """
    from scipy.optimize import lsq_linear

    region = FIRST_REGION
    slopes = None
    measured = False
    while errors is not None and region > 1e-3 and np.any(errors):
        if slopes is None:
            measured = True
            columns = list[Array]()
            for i in range(point.size):
                probe = point.copy()
                probe[i] += PROBE if point[i] + PROBE <= 1.0 else -PROBE
                perturbed = measure(probe)
                change = (
                    np.zeros_like(errors) if perturbed is None else perturbed - errors
                )  # none where the run fails
                columns.append(change / (probe[i] - point[i]))
            slopes = np.array(columns).T
        damping = DAMPING * np.linalg.norm(slopes) * np.eye(point.size)
        low, high = (np.clip(point + side * region, 0.0, 1.0) - point for side in (-1.0, 1.0))
        step = lsq_linear(
            np.vstack([slopes, damping]),
            np.append(-errors, np.zeros(point.size)),
            (low - 1e-12, high + 1e-12),
        ).x
        tried = np.clip(point + step, 0.0, 1.0)
        step = tried - point
        errors_after = measure(tried)
        better = -1.0 if errors_after is None else 1.0 - _rms(errors_after) / _rms(errors)
        if errors_after is not None and np.any(step):
            slopes = slopes + np.outer(errors_after - errors - slopes @ step, step) / (step @ step)
        if errors_after is not None and better > 0.0:
            point = tried
            errors = errors_after
            region = 1.5 * region
            measured = False
            slopes = slopes if better >= LEAST_GAIN else None
        elif measured:
            region *= 0.4
        else:
            region = max(0.4 * region, LEAST_REGION)
            slopes = None


def _rms(errors: Array) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def alike(law: Controller, gains: Mapping[str, float]) -> dict[str, float]:
    """Gains of another law under the paths of this one that have most of their last names in
    common.
    """
    known = [leaf.path for leaf in leaves(law)]
    renamed = dict[str, float]()
    for name, value in gains.items():
        ends = (name.split(".", i)[-1] for i in range(name.count(".") + 1))
        renamed[next(path for end in ends for path in known if f".{path}".endswith(f".{end}"))] = (
            value
        )
    return renamed


def run_loop(joint: JointRig, truth: TruePlant, law: Controller, task: ControlTask) -> Recording:
    """A task on a truth, whose sensors have their unknown dead time, with rows at the sampling
    instants.
    """
    loop = task_loop(joint, on_truth(law, truth.extra_delay), task, truth.plant, truth.drivers)
    return simulate(
        truth.plant,
        loop,
        duration=task.duration,
        initial_state=joint.start(truth.plant),
        output_times=joint.sample_time,
    )


def on_truth(law: SensedLaw, delay: int) -> SensedLaw:
    """The controller with so many samples of dead time more in its sensors."""
    if isinstance(law, SensedController):
        return dataclasses.replace(law, sensors=on_truth(law.sensors, delay))
    assert isinstance(law, WithSensors)
    late = tuple(dataclasses.replace(sensor, delay=sensor.delay + delay) for sensor in law.sensors)
    return dataclasses.replace(law, sensors=late)


def tracking_errors(
    joint: JointRig, truth: TruePlant, law: Controller, task: ControlTask
) -> Array | None:
    """The difference [rad] of set point and reading of the encoder in a run on a truth, and one
    more row (N + 1,): the strokes of proportional valves with their weight in the tuning, as an
    error of all rows. None if the run fails.
    """
    try:
        record = run_loop(joint, truth, law, task)
    except (PhysicsError, SimulationError):
        return None
    signals = task_signals(joint, task)
    time = signals.time[signals.time <= task.duration + 1e-9]
    angle = np.interp(time, record["time"], record["angle"])
    errors = (signals.angle[: time.size] - joint.read_angle(angle))[time >= TUNING_BEGIN]
    travel = valve_travel(truth.plant, record, np.asarray(record["time"]) >= TUNING_BEGIN).sum()
    weight = (
        0.0 if joint.switching else joint.objective.travel_weight
    )  # counts of switchings have no derivative
    return np.append(errors, math.sqrt(errors.size) * weight * DEGREE * travel)

"""Control benchmark: contenders are tuned for a family of models and judged on the truth, task by task."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ...control.laws.stuck_valve import WithStuckValve
from ...core.errors import AirmuscleError, ParameterError
from ...core.short_repr import ShortRepr
from ...engine.loop.control_law import ControlLaw
from ...engine.loop.control_loop import ControlLoop
from ...engine.loop.controller import Controller
from ...engine.run.run import simulate
from ...recording import Recording
from ..tuning import LoopCase, RootMeanSquareError, Tuning, tune
from ..tuning.case import with_gains
from .called_contender import SensedController
from .commissioning import identify_gains
from .contenders import CompleteLaw, Contender, complete
from .joints import BenchmarkJoint
from .task_signals import disturbance, task_signals
from .tasks import DEGREE, STANDARD_TASKS, TUNING_BEGIN, TUNING_TASKS, ControlTask
from .tracking_metrics import TrackingMetrics, track

DEFAULT_BUDGET = 4800
"""Loops that are simulated to tune each contender (chosen)."""
Progress = Callable[[str, int, int], None]


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class TunedContender(ShortRepr):
    """A contender with the law that commands the valves through the sensors; `tuning` is None if it was not tuned.

    identified  the gains that were identified on the truth, by path
    """

    contender: Contender
    law: Controller
    tuning: Tuning | None
    identified: Mapping[str, float] = dataclasses.field(default_factory=dict)

    @property
    def name(self) -> str:
        return self.contender.name


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class BenchmarkRun(ShortRepr):
    """One task done by one contender: its metrics and recording, or the reason why the run ended early."""

    task: ControlTask
    contender: str
    metrics: TrackingMetrics | None
    recording: Recording | None
    reason: str = ""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class BenchmarkResult(ShortRepr):
    """The runs of all contenders on all tasks of a joint, by names (contender, task)."""

    joint: BenchmarkJoint
    tasks: tuple[ControlTask, ...]
    contenders: tuple[TunedContender, ...]
    runs: Mapping[tuple[str, str], BenchmarkRun]
    budget: int
    seed: int

    def metric(self, contender: str, task: str, name: str) -> float:
        """A metric of a run; NaN if the run ended early."""
        metrics = self.runs[contender, task].metrics
        return math.nan if metrics is None else float(getattr(metrics, name))

    def scores(self) -> dict[str, float]:
        """Geometric mean over the tasks of the ratio of the rms error to the smallest of all contenders, ascending.

        1 is a contender that is best in every task; infinite one that did not complete a task.
        """
        return ranking(
            {c.name: [self.metric(c.name, task.name, "rmse") for task in self.tasks] for c in self.contenders}
        )


def ranking(errors: Mapping[str, Sequence[float]]) -> dict[str, float]:
    """The scores of `BenchmarkResult.scores`, ascending, from the rms errors of each contender, task by task."""
    table = np.array(list(errors.values()), dtype=float)
    table = np.where(np.isfinite(table), table, math.inf)
    best = table.min(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = np.where(np.isfinite(best), table / best, 1.0)
        scores = np.exp(np.mean(np.log(ratios), axis=1)).tolist()
    return dict(sorted(zip(errors, scores, strict=True), key=lambda item: item[1]))


def benchmark_controllers(
    joint: BenchmarkJoint,
    contenders: Sequence[Contender],
    tasks: Sequence[ControlTask] = STANDARD_TASKS,
    *,
    budget: int = DEFAULT_BUDGET,
    seed: int = 1,
    progress: Progress | None = None,
) -> BenchmarkResult:
    """Tune every contender with the same optimiser and budget, and run every task on the truth.

    joint       model, truth, sensors
    contenders  their gains are tuned for the joint's family of models, not for the truth
    tasks       STANDARD_TASKS unless given
    budget      loops that are simulated to tune each contender; 0: none is tuned
    seed        of the optimiser and of the noise
    progress    called with the name of the present step, the number done and their number

    A run that fails has a reason and no metrics. Raises ParameterError for a contender that does not suit the joint.
    """
    _check_names("contender", [each.name for each in contenders])
    _check_names("task", [each.name for each in tasks])
    show = progress or (lambda text, done, total: None)
    completed = [complete(joint, each, seed) for each in contenders]
    tuned = []
    for each, law in zip(contenders, completed, strict=True):
        tuned.append(tune_contender(joint, each, law, budget=budget, seed=seed, progress=show))
    runs: dict[tuple[str, str], BenchmarkRun] = {}
    total = len(tuned) * len(tasks)
    for task in tasks:
        for contender in tuned:
            show(f"{contender.name}: {task.name}", len(runs), total)
            runs[contender.name, task.name] = run_task(joint, contender, task)
    return BenchmarkResult(joint, tuple(tasks), tuple(tuned), runs, budget, seed)


def tune_contender(
    joint: BenchmarkJoint, contender: Contender, law: CompleteLaw, *, budget: int, seed: int, progress: Progress
) -> TunedContender:
    """A contender with the gains that are best for the tuning tasks in the joint's family of models."""
    if not law.bounds or not budget:
        return TunedContender(contender, law.law, None)
    cases = []
    for task in TUNING_TASKS:
        loop = loop_of(joint, law.law, task, truth=False)
        for name, plant in joint.family.items():
            cases.append(LoopCase(f"{task.name}, {name}", plant, loop, joint.start(plant)))
    tuning = tune(
        cases, law.bounds, duration=TUNING_TASKS[0].duration,
        index=RootMeanSquareError({"angle": DEGREE}, TUNING_BEGIN),
        objective=joint.objective, budget=budget, seed=seed,
        progress=lambda done, total: progress(f"tuning {contender.name}", done, total),
    )  # fmt: skip
    tuned = with_gains(law.law, tuning.gains)
    if not contender.identified:
        return TunedContender(contender, tuned, tuning)
    progress(f"identifying gains of {contender.name}", 0, 1)
    gains, _ = identify_gains(joint, tuned, contender.identified, TUNING_TASKS[0])
    return TunedContender(contender, with_gains(tuned, gains), tuning, gains)


def loop_of(joint: BenchmarkJoint, law: Controller, task: ControlTask, *, truth: bool) -> ControlLoop:
    """The control loop of a task, with the drivers of the truth or those of the model."""
    signals = task_signals(joint, task)
    plant, drivers = (joint.truth, joint.truth_drivers) if truth else (joint.model, joint.model_drivers)
    if task.stuck is not None and isinstance(law, SensedController):
        law = dataclasses.replace(law, stuck=task.stuck)
    elif task.stuck is not None:
        assert isinstance(law, ControlLaw)
        law = WithStuckValve(law, task.stuck.input, task.stuck.time, task.stuck.opening)
    setpoint = signals.setpoint(law.setpoints)
    return ControlLoop(law, joint.sample_time, setpoint, disturbance(task, plant.inputs), drivers)


def run_task(joint: BenchmarkJoint, contender: TunedContender, task: ControlTask) -> BenchmarkRun:
    """A task on the truth, with rows at the sampling instants."""
    loop = loop_of(joint, contender.law, task, truth=True)
    try:
        record = simulate(
            joint.truth, loop, duration=task.duration, initial_state=joint.start(joint.truth),
            output_times=joint.sample_time,
        )  # fmt: skip
    except AirmuscleError as error:
        return BenchmarkRun(task, contender.name, None, None, str(error))
    return BenchmarkRun(task, contender.name, track(joint, task, task_signals(joint, task), record), record)


def _check_names(kind: str, names: Sequence[str]) -> None:
    if not names:
        raise ParameterError(f"benchmark_controllers: there is no {kind}; give at least one.")
    if twice := [name for name in names if names.count(name) > 1]:
        raise ParameterError(f"benchmark_controllers: two {kind}s are named '{twice[0]}'; give each its own name.")

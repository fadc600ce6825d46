"""Control benchmark: contenders are tuned for a family of models and judged on truths, task by task."""

import dataclasses
import enum
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core import Array, PhysicsError, ShortRepr, SimulationError, counted
from ...engine.distribution import DistributedCalls
from ...engine.loop import Controller
from ...engine.processes import Workers, process_pool
from ...recording import Recording
from ..tuning import Tuning
from ..tuning.case import check_names, with_gains
from . import BenchmarkJoint, BenchmarkTruth, Commissioning, Contender, commission, complete, search_gains, tuned_law
from .commissioning import COMMISSIONING_RUNS, SETS_PER_GAIN, Progress, run_loop
from .signals import TrackingMetrics, task_signals, track
from .tasks import STANDARD_TASKS, ControlTask

REST_TASK, REST_LIFE = "hold", 10_000.0
"""Task at whose end the joint rests, and life [h] of the busiest valve that an engineer requires there (chosen)."""


class Group(enum.StrEnum):
    """What a contender knows: the models alone, or also a number of runs on the truth on which it is judged."""

    MODELS = "models only"
    COMMISSIONED = "commissioned"


class Spread(NamedTuple):
    """Median, smallest and largest value of a number over searches and truths."""

    median: float
    low: float
    high: float


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class BenchmarkRun(ShortRepr):
    """One task done on a truth: its metrics and recording, or the reason why the run ended early."""

    metrics: TrackingMetrics | None
    recording: Recording | None
    reason: str = ""


class RunKey(NamedTuple):
    """What a run is of."""

    group: Group
    truth: str
    task: str


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ContenderResult(ShortRepr):
    """A contender with the gains of one search, and its runs.

    law            tuned controller of the valves behind the sensors
    tuning         the search, of a restarted one the better part; None if nothing was tuned
    restarts       of the search, because that of another seed ended with a better objective
    commissionings by truth; empty for a contender that is not commissioned
    runs           of both groups on all truths; only those of the first truth keep their recordings
    """

    contender: Contender
    seed: int
    law: Controller
    tuning: Tuning | None
    commissionings: Mapping[str, Commissioning]
    runs: Mapping[RunKey, BenchmarkRun]
    restarts: int = 0

    @property
    def name(self) -> str:
        return self.contender.name


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class BenchmarkResult(ShortRepr):
    """The results of contenders on the tasks of a joint: one for each contender and search."""

    joint: BenchmarkJoint
    tasks: tuple[ControlTask, ...]
    results: tuple[ContenderResult, ...]

    @property
    def seeds(self) -> tuple[int, ...]:
        """The seeds of the searches."""
        return tuple(dict.fromkeys(each.seed for each in self.results))

    @property
    def truths(self) -> tuple[str, ...]:
        """The names of the truths."""
        return tuple(truth.name for truth in self.joint.truths)

    @property
    def extent(self) -> str:
        """The numbers of searches and truths as a text."""
        return f"{counted(len(self.seeds), 'search')} on {counted(len(self.truths), 'truth')}"

    @property
    def groups(self) -> tuple[Group, ...]:
        """The groups that have contenders."""
        return tuple(group for group in Group if self.contenders(group))

    def contenders(self, group: Group) -> tuple[str, ...]:
        """The names of the contenders of a group."""
        names = (each.name for each in self.results if group is Group.MODELS or each.commissionings)
        return tuple(dict.fromkeys(names))

    def values(self, contender: str, task: str, metric: str, group: Group = Group.MODELS) -> Array:
        """A metric of a contender in a task, (searches, truths); infinite where a run ended early."""
        of_seeds = {each.seed: each.runs for each in self.results if each.name == contender}
        runs = [[of_seeds[seed][RunKey(group, truth, task)].metrics for truth in self.truths] for seed in self.seeds]
        return np.array([[math.inf if m is None else float(getattr(m, metric)) for m in row] for row in runs])

    def metric(self, contender: str, task: str, metric: str, group: Group = Group.MODELS) -> Spread:
        """A metric of a contender in a task, over searches and truths."""
        return spread(self.values(contender, task, metric, group))

    def ratios(self, group: Group) -> dict[str, Array]:
        """The score of each contender of a group, (searches, truths).

        It is the geometric mean over the tasks of the ratio of the rms error to the smallest of the group in the same
        search, truth and task, times how much the life of the busiest valve at rest falls short of REST_LIFE. 1 is best
        in every task; infinite is a contender that did not complete a task.
        """
        names = self.contenders(group)
        errors = np.array([[self.values(n, task.name, "rmse", group) for task in self.tasks] for n in names])
        with np.errstate(divide="ignore", invalid="ignore"):
            logarithms = np.log(errors / errors.min(axis=0))
        scores = dict(zip(names, np.exp(np.where(np.isfinite(errors), logarithms, math.inf).mean(axis=1)), strict=True))
        if REST_TASK not in [task.name for task in self.tasks]:
            return scores
        lives = {name: self.values(name, REST_TASK, "valve_life", group) for name in names}
        return {name: score * np.maximum(1.0, REST_LIFE / lives[name]) for name, score in scores.items()}

    def scores(self, group: Group = Group.MODELS) -> dict[str, Spread]:
        """The scores of a group over searches and truths, ascending by their medians."""
        scores = {name: spread(values) for name, values in self.ratios(group).items()}
        return dict(sorted(scores.items(), key=lambda item: item[1].median))


def spread(values: Array) -> Spread:
    """Median, smallest and largest of some numbers; NaN where one of them is NaN."""
    return Spread(float(np.median(values)), float(values.min()), float(values.max()))


def benchmark_controllers(
    joint: BenchmarkJoint, contenders: Sequence[Contender], tasks: Sequence[ControlTask] = STANDARD_TASKS, *,
    seeds: Sequence[int] = (1,), sets_per_gain: int = SETS_PER_GAIN, commissioning_runs: int = COMMISSIONING_RUNS,
    progress: Progress | None = None, workers: Workers = 1,
) -> BenchmarkResult:  # fmt: skip
    """Tune every contender for the models of a joint, commission it on each truth, and run every task on the truths.

    joint               model, family, truths, sensors
    tasks               STANDARD_TASKS unless given
    seeds               of the searches and of the noise: one search each, which `search_gains` may restart
    sets_per_gain       sets of gains that a search evaluates at most for each gain; it ends before where it has
                        converged. 0: none is tuned
    commissioning_runs  runs of each contender on a truth for the group `commissioned`; 0: there is none
    progress            called with the name of the present step, the number done and their number
    workers             number of processes, for several of which a script needs `if __name__ == "__main__":`, or an
                        executor: a contender with all its searches is a task. The result does not depend on it

    A run that fails has a reason and no metrics. Raises ParameterError for a contender that does not suit the joint.
    """
    check_names("benchmark_controllers", "contender", [each.name for each in contenders])
    check_names("benchmark_controllers", "task", [each.name for each in tasks])
    show = progress or (lambda text, done, total: None)
    found: dict[str, tuple[ContenderResult, ...]] = {}
    with process_pool(workers) as executor:
        options = {
            "joint": joint, "tasks": tuple(tasks), "seeds": tuple(seeds), "sets_per_gain": sets_per_gain,
            "commissioning_runs": commissioning_runs, "progress": show if executor is None else None,
        }  # fmt: skip
        distribution = DistributedCalls(executor, _benchmark_task, options)
        other = {each.name: known.name for each in contenders for known in contenders if each.tuned_as is known}
        for later in (False, True):  # those that take the gains of the others
            due = [each for each in contenders if (each.name in other) == later]
            for i, results in distribution.completed([(each, found.get(other.get(each.name, ""), ())) for each in due]):
                found[due[i].name] = tuple(dataclasses.replace(result, contender=due[i]) for result in results)
                show(due[i].name, len(found), len(contenders))
    ordered = (found[contender.name][i] for i in range(len(seeds)) for contender in contenders)
    return BenchmarkResult(joint, tuple(tasks), tuple(ordered))


def _benchmark_task(
    options: Mapping[str, Any], task: tuple[Contender, tuple[ContenderResult, ...]]
) -> tuple[ContenderResult, ...]:
    return benchmark_contender(contender=task[0], tuned_as=task[1], **options)


def benchmark_contender(
    joint: BenchmarkJoint, contender: Contender, tasks: Sequence[ControlTask] = STANDARD_TASKS, *,
    seeds: Sequence[int] = (1,), sets_per_gain: int = SETS_PER_GAIN, commissioning_runs: int = COMMISSIONING_RUNS,
    progress: Progress | None = None, tuned_as: Sequence[ContenderResult] = (),
) -> tuple[ContenderResult, ...]:  # fmt: skip
    """A contender with one search for each seed: tuned, commissioned on each truth, and its runs.

    tuned_as  the results, with the same seeds, of the contender whose gains it takes; otherwise that one is tuned here
    """
    progress = progress or (lambda text, done, total: None)
    tunings = [(each.tuning, each.restarts) for each in tuned_as] or search_gains(
        joint, contender.tuned_as or contender, seeds, sets_per_gain, progress
    )
    results = []
    for seed, (tuning, restarts) in zip(seeds, tunings, strict=True):
        law, bounds = tuned_law(joint, contender, seed, tuning), complete(joint, contender).commissioned
        found: dict[str, Commissioning] = {}
        runs: dict[RunKey, BenchmarkRun] = {}
        for i, truth in enumerate(joint.truths):
            progress(f"{contender.name}: {truth.name}", i, len(joint.truths))
            laws = {Group.MODELS: law}
            if bounds and commissioning_runs:
                made = commission(joint, truth, law, bounds, joint.commissioning_tasks, runs=commissioning_runs)
                found[truth.name], laws[Group.COMMISSIONED] = made, with_gains(law, made.gains)
            for group, each in laws.items():
                for task in tasks:
                    run = run_task(joint, truth, each, task)
                    kept = run if truth is joint.truths[0] else dataclasses.replace(run, recording=None)
                    runs[RunKey(group, truth.name, task.name)] = kept
        results.append(ContenderResult(contender, seed, law, tuning, found, runs, restarts))
    return tuple(results)


def run_task(joint: BenchmarkJoint, truth: BenchmarkTruth, law: Controller, task: ControlTask) -> BenchmarkRun:
    """A task on a truth, with rows at the sampling instants."""
    try:
        record = run_loop(joint, truth, law, task)
    except (PhysicsError, SimulationError) as error:
        return BenchmarkRun(None, None, str(error))
    return BenchmarkRun(track(joint, truth.plant, task, task_signals(joint, task), record), record)

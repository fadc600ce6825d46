"""Contender of a comparison: tuned for a family of models, and its runs of all tasks on
the truths.
"""

import dataclasses
import enum
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ...core import PhysicsError, ShortRepr, SimulationError
from ...engine.loop import Controller
from ...recording import Recording
from ..tuning import Tuning
from ..tuning.case import with_gains
from . import (
    Commissioning,
    Contender,
    JointRig,
    TruePlant,
    commission,
    complete,
    search_gains,
    tuned_law,
)
from .commissioning import COMMISSIONING_RUNS, SETS_PER_GAIN, Progress, run_loop
from .signals import TrackingMetrics, task_signals, track
from .tasks import STANDARD_TASKS, ControlTask


class Group(enum.StrEnum):
    """What a contender knows: the models alone, or also a number of runs on the truth on which it
    is judged.
    """

    MODELS = "models only"
    COMMISSIONED = "commissioned"


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class TaskRun(ShortRepr):
    """One task done on a truth: its metrics and recording, or the reason why the run ended
    early.
    """

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
    runs: Mapping[RunKey, TaskRun]
    restarts: int = 0

    @property
    def name(self) -> str:
        return self.contender.name


def judge_contender(
    joint: JointRig,
    contender: Contender,
    tasks: Sequence[ControlTask] = STANDARD_TASKS,
    *,
    seeds: Sequence[int] = (1,),
    sets_per_gain: int = SETS_PER_GAIN,
    commissioning_runs: int = COMMISSIONING_RUNS,
    progress: Progress | None = None,
    tuned_as: Sequence[ContenderResult] = (),
) -> tuple[ContenderResult, ...]:
    """A contender with one search for each seed: tuned, commissioned on each truth, and its runs.

    tuned_as  the results, with the same seeds, of the contender whose gains it takes; otherwise
              that one is tuned here
    """
    progress = progress or (lambda text, done, total: None)
    tunings = [(result.tuning, result.restarts) for result in tuned_as] or search_gains(
        joint, contender.tuned_as or contender, seeds, sets_per_gain, progress
    )
    results = []
    for seed, (tuning, restarts) in zip(seeds, tunings, strict=True):
        law = tuned_law(joint, contender, seed, tuning)
        bounds = complete(joint, contender).commissioned
        commissionings: dict[str, Commissioning] = {}
        runs: dict[RunKey, TaskRun] = {}
        for i, truth in enumerate(joint.truths):
            progress(f"{contender.name}: {truth.name}", i, len(joint.truths))
            laws = {Group.MODELS: law}
            if bounds and commissioning_runs:
                made = commission(
                    joint, truth, law, bounds, joint.commissioning_tasks, runs=commissioning_runs
                )
                commissionings[truth.name], laws[Group.COMMISSIONED] = (
                    made,
                    with_gains(law, made.gains),
                )
            for group, group_law in laws.items():
                for task in tasks:
                    run = run_task(joint, truth, group_law, task)
                    retained = (
                        run
                        if truth is joint.truths[0]
                        else dataclasses.replace(run, recording=None)
                    )
                    runs[RunKey(group, truth.name, task.name)] = retained
        results.append(
            ContenderResult(contender, seed, law, tuning, commissionings, runs, restarts)
        )
    return tuple(results)


def run_task(joint: JointRig, truth: TruePlant, law: Controller, task: ControlTask) -> TaskRun:
    """A task on a truth, with rows at the sampling instants."""
    try:
        record = run_loop(joint, truth, law, task)
    except (PhysicsError, SimulationError) as error:
        return TaskRun(None, None, str(error))
    return TaskRun(track(joint, truth.plant, task, task_signals(joint, task), record), record)

"""Comparison of controllers of a joint: contenders are tuned for a family of models and judged on
truths; the result with its chapter.
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from ...bench.reported import Reported
from ...core import Array, cite, counted
from ...engine.distribution import DistributedCalls
from ...engine.processes import Workers, process_pool
from ...report.chapter import Chapter, NamedValue, Plot, Table, TableColumn
from ..tuning.case import check_names
from . import (
    Contender,
    ContenderResult,
    Group,
    JointRig,
    LearningCurve,
    RunKey,
    judge_contender,
)
from .commissioning import COMMISSIONING_RUNS, SETS_PER_GAIN, Progress
from .plots import error_figure, learning_figure, run_figure
from .scores import Spread, mean_ratios, order_columns, spread
from .signals import BONE2019, METRICS
from .tables import (
    failure_table,
    gains_table,
    learning_table,
    metric_column,
    metrics_table,
    search_table,
    settings_of,
    truth_table,
)
from .tasks import STANDARD_TASKS, ControlTask

REST_TASK = "hold"
REST_LIFE = 10_000.0
"""Task at whose end the joint rests, and life [h] of the busiest valve that an engineer requires
there (chosen).
"""
MAX_PANELS = 4
DRAWN = (
    "step",
    "sine 2 Hz",
    "minimum jerk",
    "load change",
    "torque disturbance",
    "sine 1 Hz",
    "valve stuck",
    "hold",
)
"""Tasks that are drawn over time, the first four that the comparison contains."""
MAX_BRIEF = 16
SHORT_CONTROLLERS = 4
"""Tasks and controllers of the table of errors in the brief view (chosen)."""
LEARNING = "Iterative learning: rms error of repeated trials on a truth."
PROCEDURE = (
    "Every controller is tuned by the same optimiser, with at most the same number of sets of gains"
    " for each gain, for perturbed models. In the group 'commissioned' it has then as many runs on"
    " the truth as every other one."
)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ControlComparison(Reported):
    """The results of contenders on the tasks of a joint: one for each contender and search."""

    joint: JointRig
    tasks: tuple[ControlTask, ...]
    results: tuple[ContenderResult, ...]

    @property
    def seeds(self) -> tuple[int, ...]:
        """The seeds of the searches."""
        return tuple(dict.fromkeys(result.seed for result in self.results))

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
        names = (
            result.name for result in self.results if group is Group.MODELS or result.commissionings
        )
        return tuple(dict.fromkeys(names))

    def values(self, contender: str, task: str, metric: str, group: Group = Group.MODELS) -> Array:
        """A metric of a contender in a task, (searches, truths); infinite where a run ended
        early.
        """
        of_seeds = {result.seed: result.runs for result in self.results if result.name == contender}
        runs = [
            [of_seeds[seed][RunKey(group, truth, task)].metrics for truth in self.truths]
            for seed in self.seeds
        ]
        return np.array(
            [[math.inf if m is None else float(getattr(m, metric)) for m in row] for row in runs]
        )

    def metric(self, contender: str, task: str, metric: str, group: Group = Group.MODELS) -> Spread:
        """A metric of a contender in a task, over searches and truths."""
        return spread(self.values(contender, task, metric, group))

    def ratios(self, group: Group) -> dict[str, Array]:
        """The score of each contender of a group, (searches, truths).

        It is the geometric mean over the tasks of the ratio of the rms error to the smallest of the
        group in the same search, truth and task, times how much the life of the busiest valve at
        rest falls short of REST_LIFE. 1 is best in every task; infinite is a contender that did not
        complete a task.
        """
        names = self.contenders(group)
        errors = np.array(
            [[self.values(n, task, "rmse", group) for task in self._task_names] for n in names]
        )
        scores = mean_ratios(names, errors)
        if REST_TASK not in self._task_names:
            return scores
        lives = {name: self.values(name, REST_TASK, "valve_life", group) for name in names}
        return {
            name: score * np.maximum(1.0, REST_LIFE / lives[name]) for name, score in scores.items()
        }

    def scores(self, group: Group = Group.MODELS) -> dict[str, Spread]:
        """The scores of a group over searches and truths, ascending by their medians."""
        scores = {name: spread(values) for name, values in self.ratios(group).items()}
        return dict(sorted(scores.items(), key=lambda item: item[1].median))

    @property
    def unfinished(self) -> dict[str, int]:
        """The contenders with searches that ended with their budget, and the number of those: their
        scores are at most as good as those of a longer search.
        """
        counts = dict[str, int]()
        for result in self.results:
            tuning = result.tuning
            if tuning is not None and not tuning.converged:
                counts[result.name] = counts.get(result.name, 0) + 1
        return counts

    def chapter(self, curves: Sequence[LearningCurve] = ()) -> Chapter:
        """The description of the comparison: ranking and errors of each group, searches, gains,
        truths; and learning.
        """
        joint = self.joint
        tables = list[Table | None]()
        for group in self.groups:
            order = (
                self.order_table(group)
                if len(self.contenders(group)) > 1 < len(self.truths)
                else None
            )
            tables += [self.ranking_table(group), order, self.error_table("rmse", group)]
        tables += [search_table(joint, self.results), gains_table(self.results), truth_table(joint)]
        tables += [
            metrics_table(self.results),
            learning_table(curves) if curves else None,
            failure_table(self.results),
        ]
        drawn = [name for name in DRAWN if name in self._task_names] + self._task_names
        plots = [self.error_plot(group) for group in self.groups]
        plots.append(self.run_plot(list(dict.fromkeys(drawn))[:MAX_PANELS], self.groups[-1]))
        if curves:
            plots.append(Plot("learning", LEARNING, partial(learning_figure, curves)))
        errors = [curve.errors for curve in curves]
        learned = [
            f"learning: {e[0]:.3g} degrees in trial 1, {e[-1]:.3g} in trial {e.size}"
            for e in errors
        ]
        sources = cite(
            (
                joint.model,
                *(truth.plant for truth in joint.truths),
                *(result.law for result in self.results),
            )
        )
        tuned = [
            reference
            for result in self.results
            if result.tuning
            for reference in result.tuning.references
        ]
        return Chapter(
            "comparison",
            f"Control of an antagonistic joint with {joint.name}",
            self._summary(),
            values=(NamedValue("seeds", ", ".join(map(str, self.seeds)), brief=False),),
            tables=tuple(table for table in tables if table is not None),
            plots=tuple(plots),
            notes=(*self._search_notes(), *learned),
            references=tuple(
                {reference.key: reference for reference in (*sources, BONE2019, *tuned)}.values()
            ),
            chosen=settings_of(joint),
        )

    def ranking_table(self, group: Group) -> Table:
        """The contenders of a group by score, with what they cost."""
        scores = self.scores(group)
        tasks = self._task_names
        air = [[self.metric(name, task, "air", group).median for task in tasks] for name in scores]
        errors = [[self.values(name, task, "rmse", group) for task in tasks] for name in scores]
        strokes, life = (
            [
                (
                    self.metric(name, REST_TASK, metric, group).median
                    if REST_TASK in tasks
                    else math.nan
                )
                for name in scores
            ]
            for metric in ("strokes", "valve_life")
        )
        return Table(
            f"ranking_{group.name.lower()}",
            f"Ranking, {group}",
            {
                "controller": list(scores),
                "score": [score.median for score in scores.values()],
                "lowest": [score.low for score in scores.values()],
                "highest": [score.high for score in scores.values()],
                "air, mean": metric_column("air", [sum(values) / len(values) for values in air]),
                "strokes at rest": metric_column("strokes", strokes),
                "valve life at rest": metric_column("valve_life", life, short="life at rest"),
                "searches converged": [self._converged(name) for name in scores],
                "runs completed": TableColumn(
                    [float(np.isfinite(e).mean()) for e in errors], "1", "%", brief=False
                ),
            },
            "Score: geometric mean over the tasks of the rms error, divided by the smallest of the"
            f" group on the same truth, times {REST_LIFE:g} h over the life of the busiest valve in"
            f" the task '{REST_TASK}' where it is shorter; 1 is the best in every task. Over"
            f" {self.extent}.",
            brief=len(scores),
        )

    def order_table(self, group: Group) -> Table:
        """On how many truths one contender is better than another one in every search."""
        names = list(self.scores(group))
        columns = order_columns(names, self.ratios(group))
        return Table(
            f"order_{group.name.lower()}",
            f"Order, {group}",
            columns,
            f"Number of truths, of {len(self.truths)}, on which every search of a controller has a"
            " smaller score than every search of another one.",
        )

    def error_table(self, metric: str, group: Group) -> Table:
        """The median of one metric of all contenders of a group, one row for each task."""
        columns: dict[str, Any] = {"task": self._task_names}
        for i, name in enumerate(self.contenders(group)):
            values = [self.metric(name, task, metric, group).median for task in self._task_names]
            columns[name] = metric_column(metric, values, brief=i < SHORT_CONTROLLERS)
        name = METRICS[metric][0]
        title = f"RMS{name[3:]}" if name.startswith("rms") else name.capitalize()
        return Table(
            f"{metric}_{group.name.lower()}",
            f"{title}, {group}",
            columns,
            "Median over searches and truths, from the beginning of the judged time of each task."
            f" Over {self.extent}.",
            brief=MAX_BRIEF,
        )

    def error_plot(self, group: Group = Group.MODELS) -> Plot:
        """The rms error of every controller of a group in every task: median and range over
        searches and truths.
        """
        names = self._task_names
        errors = {
            contender: np.array([self.metric(contender, name, "rmse", group) for name in names])
            for contender in self.contenders(group)
        }
        caption = (
            f"Error in each task with {self.joint.name}, {group}: median and range over"
            f" {self.extent}; {self.joint.valve}."
        )
        return Plot(f"errors_{group.name.lower()}", caption, partial(error_figure, names, errors))

    def run_plot(self, names: Sequence[str], group: Group = Group.MODELS) -> Plot:
        """Angle and error over time of some tasks on the first truth, one column for each."""
        truth = self.truths[0]
        # of the searches of a contender the first
        shown = {result.name: result for result in reversed(self.results)}
        results = [shown[name] for name in self.contenders(group)]
        tasks = {task.name: task for task in self.tasks}
        chosen = [tasks[name] for name in names]
        figure = partial(run_figure, results, chosen, group, truth)
        caption = f"Angle and error over time, {group}, {truth}, first search."
        return Plot("runs", caption, figure)

    def _converged(self, name: str) -> str:
        """How many searches of a contender have converged, or the contender whose gains it has."""
        results = [result for result in self.results if result.name == name]
        source = results[0].contender.tuned_as
        tunings = [result.tuning for result in results if result.tuning is not None]
        if not tunings:
            return "not tuned"
        converged = sum(tuning.converged for tuning in tunings)
        text = f"{converged} of {len(tunings)}"
        return f"{text}, of {source.name}" if source is not None else text

    def _search_notes(self) -> list[str]:
        """Which scores are those of searches that have not ended."""
        searches = len(self.seeds)
        names = [f"{name} ({count} of {searches})" for name, count in self.unfinished.items()]
        if not names:
            return []
        return [
            "searches that ended with their sets of gains before they converged:"
            f" {', '.join(names)}; the scores of these controllers say as much about the search as"
            " about the controller,"
            " and a longer search may lower them"
        ]

    @property
    def _task_names(self) -> list[str]:
        return [task.name for task in self.tasks]

    def _summary(self) -> tuple[str, str]:
        joint = self.joint
        number = len({result.name for result in self.results})
        best = (
            f"Smallest score, {group}: {next(iter(self.scores(group)))}." for group in self.groups
        )
        counts = (
            counted(number, "controller"),
            counted(len(self.tasks), "task"),
            counted(len(joint.truths), "truth"),
        )
        valves = f"Valves: {joint.valve}. Sampled every {joint.sample_time * 1e3:g} ms."
        return (
            f"{', '.join(counts)}. {' '.join(best)} {valves}",
            f"{PROCEDURE} {joint.remark}".strip(),
        )


def compare_controllers(
    joint: JointRig,
    contenders: Sequence[Contender],
    tasks: Sequence[ControlTask] = STANDARD_TASKS,
    *,
    seeds: Sequence[int] = (1,),
    sets_per_gain: int = SETS_PER_GAIN,
    commissioning_runs: int = COMMISSIONING_RUNS,
    progress: Progress | None = None,
    workers: Workers = 1,
) -> ControlComparison:
    """Tune every contender for the models of a joint, commission it on each truth, and run every
    task on the truths.

    joint               model, family, truths, sensors
    tasks               STANDARD_TASKS unless given
    seeds               of the searches and of the noise: one search each, which `search_gains` may
                        restart
    sets_per_gain       sets of gains that a search evaluates at most for each gain; it ends before
                        where it has converged. 0: none is tuned
    commissioning_runs  runs of each contender on a truth for the group `commissioned`; 0: there is
                        none
    progress            called with the name of the present step, the number done and their number
    workers             number of processes, for several of which a script needs `if __name__ ==
                        "__main__":`, or an executor: a contender with all its searches is a task.
                        The result does not depend on it

    A run that fails has a reason and no metrics. Raises ParameterError for a contender that does
    not suit the joint.
    """
    check_names("compare_controllers", "contender", [contender.name for contender in contenders])
    check_names("compare_controllers", "task", [task.name for task in tasks])
    show = progress or (lambda text, done, total: None)
    completed: dict[str, tuple[ContenderResult, ...]] = {}
    with process_pool(workers) as executor:
        options = {
            "joint": joint,
            "tasks": tuple(tasks),
            "seeds": tuple(seeds),
            "sets_per_gain": sets_per_gain,
            "commissioning_runs": commissioning_runs,
        }
        shown = {**options, "progress": show if executor is None else None}
        distribution = DistributedCalls(executor, _judged, shown, content=options)
        source_names = {
            contender.name: known.name
            for contender in contenders
            for known in contenders
            if contender.tuned_as is known
        }
        for later in (False, True):  # those that take the gains of the others
            due = [
                contender for contender in contenders if (contender.name in source_names) == later
            ]
            for i, results in distribution.completed(
                [
                    (contender, completed.get(source_names.get(contender.name, ""), ()))
                    for contender in due
                ]
            ):
                completed[due[i].name] = tuple(
                    dataclasses.replace(result, contender=due[i]) for result in results
                )
                show(due[i].name, len(completed), len(contenders))
    ordered = (completed[contender.name][i] for i in range(len(seeds)) for contender in contenders)
    return ControlComparison(joint, tuple(tasks), tuple(ordered))


def _judged(
    options: Mapping[str, Any], task: tuple[Contender, tuple[ContenderResult, ...]]
) -> tuple[ContenderResult, ...]:
    return judge_contender(contender=task[0], tuned_as=task[1], **options)

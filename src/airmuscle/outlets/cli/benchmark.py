"""`airmuscle benchmark`: control benchmark of an antagonistic joint."""

from __future__ import annotations

import contextlib
import enum
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated

import typer

from ...core.errors import InputError, SimulationError, suggestion
from ...design.control_benchmark import (
    BenchmarkJoint,
    BenchmarkResult,
    Contender,
    LearningCurve,
    benchmark_controllers,
    learn,
    on_off_joint,
    proportional_joint,
    scenario_contender,
    standard_contenders,
)
from ...design.control_benchmark.benchmark import COMMISSIONING_RUNS
from ...design.control_benchmark.chapter import benchmark_chapter
from ...design.control_benchmark.tasks import find_tasks
from ...design.control_benchmark.truths import TRUTH_SEEDS
from ...files.library.files import is_path
from .delivery import deliver
from .execution import Execution
from .interruption import check_interrupted
from .options import Folder, Json
from .request_options import with_requests

DEFAULT_BUDGET = 60
"""Sets of gains for each gain (chosen)."""
LEARNED = "feed-forward + PID"
"""The controller whose feed-forward is learned from trial to trial."""


class Valves(enum.StrEnum):
    """The joints of the benchmark, by their valves."""

    PROPORTIONAL = "proportional"
    ON_OFF = "on-off"


Seed = Annotated[
    int, typer.Option(min=0, max=1_000_000, metavar="N", help="Seed of the optimiser and of the noise.")
]  # fmt: skip


Names = Annotated[
    list[str] | None,
    typer.Option(metavar="NAME", help="A controller, or a scenario file with one; repeat it for more. Default: all."),
]  # fmt: skip
Tasks = Annotated[
    list[str] | None, typer.Option(metavar="NAME", help="A task; repeat it for several. Default: all.")
]  # fmt: skip
Truths = Annotated[
    int, typer.Option(min=1, max=len(TRUTH_SEEDS), metavar="N", help="Plants on which controllers are judged.")
]  # fmt: skip
Searches = Annotated[
    int, typer.Option(min=1, max=100, metavar="N", help="Searches of gains with different seeds.")
]  # fmt: skip
Budget = Annotated[
    int, typer.Option(min=0, max=100_000, metavar="N", help="Most sets of gains for each gain; 0: no search.")
]  # fmt: skip
Runs = Annotated[
    int, typer.Option(min=0, max=1000, metavar="N", help="Runs to commission a controller on a plant; 0: none.")
]  # fmt: skip
Trials = Annotated[
    int, typer.Option(min=0, max=1000, metavar="N", help="Trials of iterative learning at 2 Hz; 0: none.")
]  # fmt: skip


@with_requests
def benchmark(
    execution: Execution,
    valves: Annotated[Valves, typer.Option(help="Valves of the joint.")] = Valves.PROPORTIONAL,
    controller: Names = None, task: Tasks = None, truths: Truths = len(TRUTH_SEEDS), searches: Searches = 1,
    budget: Budget = DEFAULT_BUDGET, runs: Runs = COMMISSIONING_RUNS, seed: Seed = 1, trials: Trials = 0,
    out: Folder = Path("benchmark"), json: Json = False,
) -> None:  # fmt: skip
    """Benchmark controllers of a joint on common tasks.

    \b
    Every controller is tuned by the same optimiser for perturbed models, and judged on plants of other kinds, drawn at
    random: characteristic, friction, valves, tubes and heat differ, and the sensors have resolution, noise and dead
    time. Group "commissioned": the same number of runs on each plant before. Writes DIR/report.html with the rankings,
    DIR/figures/ and DIR/data/ with all metrics.

    \b
    Examples:
      airmuscle benchmark --out benchmark
      airmuscle benchmark --controller PID --controller "feed-forward + PID" --task "sine 1 Hz" --trials 10
      airmuscle benchmark --valves on-off --truths 2 --budget 40
      airmuscle benchmark --controller PID --controller examples/joint_cascade.toml --runs 0
      airmuscle benchmark --join /shared/benchmark    (on each machine)
    """
    joint = (proportional_joint if valves is Valves.PROPORTIONAL else on_off_joint)(TRUTH_SEEDS[:truths])
    contenders, tasks = _contenders(joint, controller or []), find_tasks(tuple(task or ()))
    if trials and (trials < 2 or LEARNED not in [each.name for each in contenders]):
        raise InputError(f"--trials needs at least 2 trials and the controller '{LEARNED}'.")
    writes = execution.writes(out)
    with execution.executor(alone=True) as workers, _progress() as show:
        result = benchmark_controllers(
            joint, contenders, tasks, seeds=range(seed, seed + searches), sets_per_gain=budget,
            commissioning_runs=runs, progress=show, workers=workers,
        )  # fmt: skip
    curves = _learned(result, trials, seed) if trials else []
    chapter = benchmark_chapter(result, curves)
    deliver("benchmark", [chapter], json=json, out=out, title="Control benchmark", writes=writes)
    found = [run for each in result.results for run in each.runs.values()]
    if not any(run.metrics for run in found):
        raise SimulationError(f"all runs failed; reason of the first: {found[0].reason}")


def _contenders(joint: BenchmarkJoint, names: list[str]) -> tuple[Contender, ...]:
    known = {each.name: each for each in standard_contenders(joint)}
    for name in names:
        if name not in known and is_path(name):
            known[name] = scenario_contender(joint, name)
        if name not in known:
            raise InputError(f"there is no controller '{name}'; there are {', '.join(known)}.{suggestion(name, known)}")
    return tuple(known[name] for name in dict.fromkeys(names)) or tuple(known.values())


def _learned(result: BenchmarkResult, trials: int, seed: int) -> list[LearningCurve]:
    """The trials of iterative learning with the tuned controller."""
    tuned = next(each for each in result.results if each.name == LEARNED)
    return [learn(result.joint, tuned, find_tasks(("sine 2 Hz",))[0], trials=trials, seed=seed)]


@contextlib.contextmanager
def _progress() -> Iterator[Callable[[str, int, int], None]]:
    """Yield a callback (step, done, total) that draws one bar on stderr."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as display:
        bar = display.add_task("control benchmark", total=None)

        def show(step: str, done: int, total: int) -> None:
            check_interrupted()
            display.update(bar, description=step, completed=done, total=total)

        yield show

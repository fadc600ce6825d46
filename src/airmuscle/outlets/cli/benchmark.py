"""`airmuscle benchmark`: controllers of an antagonistic joint on common tasks."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from ...core import InputError, SimulationError, check_known, check_writable
from ...design import TRUTH_SEEDS
from ...design.control_benchmark import (
    Contender,
    find_tasks,
    learn,
    scenario_contender,
    standard_contenders,
)
from ...design.control_benchmark.commissioning import COMMISSIONING_RUNS
from ...design.control_benchmark.joints import BenchmarkJoint, on_off_joint, proportional_joint
from ...design.control_benchmark.result import benchmark_controllers
from ...files.library.files import is_path
from ..requests.declaration import many, option, request
from .delivery import Execution, deliver
from .options import Folder, Json
from .requested import with_requests
from .terminal import counted_progress

DEFAULT_BUDGET = 60
"""Sets of gains for each gain (chosen)."""
JOINTS: Mapping[str, Callable[..., BenchmarkJoint]] = {
    "proportional": proportional_joint,
    "on-off": on_off_joint,
}
"""The joints of the benchmark, by their valves."""
LEARNED = "feed-forward + PID"
"""The controller whose feed-forward is learned from trial to trial."""


@request
class BenchmarkRequest:
    """What a control benchmark is asked for."""

    valves: Callable[..., BenchmarkJoint] = option(
        "Valves of the joint.", choices=JOINTS, default="proportional", metavar="|".join(JOINTS)
    )
    controller: tuple[str, ...] = many(
        "A controller, or a scenario file with one; repeat it for more. Default: all."
    )
    task: tuple[str, ...] = many("A task; repeat it for several. Default: all.")
    truths: int = option(
        "Plants on which controllers are judged.",
        default=len(TRUTH_SEEDS),
        bounds=(1, len(TRUTH_SEEDS)),
    )
    searches: int = option("Searches of gains with different seeds.", default=1, bounds=(1, 100))
    budget: int = option(
        "Most sets of gains for each gain; 0: no search.",
        default=DEFAULT_BUDGET,
        bounds=(0, 100_000),
    )
    runs: int = option(
        "Runs to commission a controller on a plant; 0: none.",
        default=COMMISSIONING_RUNS,
        bounds=(0, 1000),
    )
    seed: int = option("Seed of the optimiser and of the noise.", default=1, bounds=(0, 1_000_000))
    trials: int = option(
        "Trials of iterative learning at 2 Hz; 0: none.", default=0, bounds=(0, 1000)
    )


def _contenders(joint: BenchmarkJoint, requested: Sequence[str]) -> list[Contender]:
    """The requested controllers, by their names or by scenario files; by default all."""
    known = {contender.name: contender for contender in standard_contenders(joint)}
    names = dict.fromkeys(requested)
    for name in names:
        if name not in known and is_path(name):
            known[name] = scenario_contender(joint, name)
        check_known("there is no controller", name, known, error=InputError)
    return [known[name] for name in names or known]


@with_requests
def benchmark(
    request: BenchmarkRequest,
    execution: Execution,
    out: Folder = Path("benchmark"),
    json: Json = False,
) -> None:
    """Benchmark controllers of a joint on common tasks.

    \b
    Every controller is tuned by the same optimiser for perturbed models, and judged on plants of
    other kinds, drawn at random: characteristic, friction, valves, tubes and heat differ, and the
    sensors have resolution, noise and dead time. Group "commissioned": the same number of runs on
    each plant before. Writes DIR/report.html with the rankings, DIR/figures/ and DIR/data/ with all
    metrics.

    \b
    Examples:
      airmuscle benchmark --out benchmark
      airmuscle benchmark --controller PID --controller "feed-forward + PID" --task "sine 1 Hz"
          --trials 10
      airmuscle benchmark --valves on-off --truths 2 --budget 40
      airmuscle benchmark --controller PID --controller examples/joint_cascade.toml --runs 0
      airmuscle benchmark --cluster tcp://head-node:8786
    """
    joint = request.valves(TRUTH_SEEDS[: request.truths])
    trials = request.trials
    contenders = _contenders(joint, request.controller)
    tasks = find_tasks(request.task)
    if trials and (trials < 2 or LEARNED not in [contender.name for contender in contenders]):
        raise InputError(f"--trials needs at least 2 trials and the controller '{LEARNED}'.")
    check_writable(out)
    seeds = range(request.seed, request.seed + request.searches)
    with (
        execution.executor(out, alone=True) as workers,
        counted_progress("control benchmark") as show,
    ):
        result = benchmark_controllers(
            joint,
            contenders,
            tasks,
            seeds=seeds,
            sets_per_gain=request.budget,
            commissioning_runs=request.runs,
            progress=show,
            workers=workers,
        )
    curves = []
    if trials:
        tuned = next(entry for entry in result.results if entry.name == LEARNED)
        curves = [
            learn(
                result.joint, tuned, find_tasks(("sine 2 Hz",))[0], trials=trials, seed=request.seed
            )
        ]
    chapter = result.chapter(curves)
    deliver("benchmark", [chapter], json=json, out=out, title="Control benchmark")
    runs = [run for entry in result.results for run in entry.runs.values()]
    if not any(run.metrics for run in runs):
        raise SimulationError(f"all runs failed; reason of the first: {runs[0].reason}")

"""`airmuscle tune`: gains of the controller of a scenario, over a family of perturbed plants; `airmuscle benchmark`:
controllers of an antagonistic joint on common tasks."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from ...core import InputError, SimulationError, check_known, check_writable, leaves
from ...design import TRUTH_SEEDS, Perturbations, RobustObjective, Tuning
from ...design.control_benchmark import benchmark_chapter, find_tasks, learn, scenario_contender, standard_contenders
from ...design.control_benchmark.benchmark import benchmark_controllers
from ...design.control_benchmark.commissioning import COMMISSIONING_RUNS
from ...design.control_benchmark.joints import BenchmarkJoint, on_off_joint, proportional_joint
from ...design.tuning import IntegralAbsoluteError, IntegralTimeAbsoluteError, RootMeanSquareError, TrackingIndex
from ...design.tuning import tune as find_gains
from ...design.tuning.chapter import history_table, tuning_chapter
from ...design.tuning.rules import RuleSettings, rule_settings, rule_starts, step_experiment
from ...design.tuning.scenario_loop import ScenarioLoop, load_scenario_loop
from ...engine.processes import Workers
from ...files.library.files import is_path
from ...files.scenario.controller import signal_units
from ...report.write import save_table
from ..requests.declaration import RequestError, many, option, request
from .delivery import Execution, deliver
from .interruption import check_interrupted
from .options import Folder, Json, argument, with_requests
from .terminal import computation_progress, counted_progress, echo

HISTORY_FILE = "history.csv"
INDICES: dict[str, type[TrackingIndex]] = {
    "rmse": RootMeanSquareError,
    "iae": IntegralAbsoluteError,
    "itae": IntegralTimeAbsoluteError,
}
"""Tracking indices by their names."""
ScenarioFile = Annotated[Path, argument("SCENARIO.toml", "A scenario file with [input.controller].")]
SAVE = "Scenario with the tuned gains; default: SCENARIO-tuned.toml next to the scenario."
Save = Annotated[Path | None, typer.Option(metavar="FILE.toml", help=SAVE)]


def read_factors(text: str, where: str) -> tuple[float, ...]:
    """Factors with commas between them. Raises RequestError."""
    try:
        return tuple(float(part) for part in text.split(",") if part.strip())
    except ValueError:
        raise RequestError(
            f"{where} is '{text}'; it must be factors with commas between them, such as 0.5,2."
        ) from None


@request
class TuneRequest:
    """What a tuning is asked for."""

    bounds: tuple[str, ...] = many(
        "Range of a gain, such as 'gain=5 1/m:500 1/m'; repeatable. Default: every gain and time that is not 0, from a "
        "tenth of its present value to ten times it.", metavar="GAIN=MIN:MAX",
    )  # fmt: skip
    index: type[TrackingIndex] = option(
        f"Tracking index of a run: {', '.join(INDICES)}.", choices=INDICES, default="rmse"
    )
    quantile: float = option("Quantile of the index over the cases; 1: the worst case.", default=0.9)
    quantile_weight: float = option("Weight of the quantile; that of the mean is 1.", default=1.0)
    air_weight: float = option("Weight of the mean air drawn [kg/s].", default=0.0)
    travel_weight: float = option("Weight of the mean travel of the commands [strokes/s].", default=0.0)
    loads: Any = option(
        "Factors of the load; '' for none.", default="0.5,2", metavar="FACTORS", read=read_factors, empty=True
    )
    supplies: Any = option(
        "Factors of the supply pressure; '' for none.", default="0.8", metavar="FACTORS", read=read_factors, empty=True
    )
    leak: float = option(
        "Leak at each muscle, relative to the largest conductance; 0 for none.", default=0.01, metavar="RATIO"
    )
    delay: int = option("Dead time of the measurements in samples; 0 for none.", default=1, bounds=(0, 1000))
    draws: int = option("Draws of fitted parameters, from their covariance.", default=4, bounds=(0, 10_000))
    rules: bool = option("Start from SIMC and AMIGO settings by a simulated step (PID only).", default=False)
    budget: int = option("Maximum number of simulated loops.", default=4000, bounds=(8, 10_000_000))
    seed: int = option("Seed of the optimiser and of the draws.", default=0, bounds=(0, float("inf")))


@with_requests
def tune(
    scenario: ScenarioFile, request: TuneRequest, execution: Execution, save: Save = None,
    out: Folder = Path("tuning"), json: Json = False,
) -> None:  # fmt: skip
    """Tune the controller of a scenario for a family of plants.

    \b
    Differential evolution minimises the mean plus a high quantile of a tracking index over the nominal plant and plants
    with another load, supply pressure, leak, delay and drawn parameters. Writes SCENARIO-tuned.toml next to the
    scenario, the same file with the new gains, and DIR/report.html, DIR/history.csv and DIR/figures/. Ctrl-C ends the
    search; the best gains so far are written.

    \b
    Examples:
      airmuscle tune examples/pressure_loop.toml --rules --out tuning
      airmuscle tune lift.toml --bounds "gain=5 1/m:500 1/m" --bounds "integral_time=50 ms:5 s" --budget 20000
      airmuscle tune lift.toml --join /shared/tuning    (on each machine)
    """
    loaded = load_scenario_loop(scenario)
    target = save or scenario.with_name(f"{scenario.stem}-tuned.toml")
    writes = execution.writes(out)
    if writes:
        check_writable(target.parent)
    loaded.check_target(target)
    ranges = loaded.bounds(request.bounds)
    with execution.executor(alone=True) as workers:
        tuning, notes, rules = _search(loaded, ranges, request, workers)
    writes = writes or execution.takes_over(out)
    if writes:
        loaded.save(tuning.gains, target)
    scenario_, controller = loaded.scenario, loaded.loop.controller
    units = signal_units(scenario_.plant, scenario_.initial_state)
    units = {**units, **{leaf.path: loaded.unit(leaf) for leaf in leaves(controller)}}
    chapter = tuning_chapter(tuning, scenario_.title, units, notes, rules, scenario_.problem.integrator)
    files = {HISTORY_FILE: lambda path: save_table(history_table(tuning), path)}
    if tuning.interrupted:
        echo("interrupted: the best gains so far are written", err=True)
    others = {"scenario": target}
    deliver("tune", [chapter], json=json, out=out, title="Tuning", files=files, others=others, writes=writes)
    if tuning.interrupted:
        check_interrupted()
        raise KeyboardInterrupt


def _search(
    loaded: ScenarioLoop, ranges: Mapping[str, tuple[float, float]], request: TuneRequest, workers: Workers
) -> tuple[Tuning, tuple[str, ...], tuple[RuleSettings, ...]]:
    """The tuning, notes on the family of plants, and the settings of the rules."""
    problem = loaded.scenario.problem
    objective = RobustObjective(request.quantile, request.quantile_weight, request.air_weight, request.travel_weight)
    perturbations = Perturbations(request.loads, request.supplies, request.leak, request.delay, request.draws)
    family = loaded.family(perturbations, request.seed)
    rules: tuple[RuleSettings, ...] = ()
    if request.rules:
        experiment = step_experiment(family.cases[0], problem.duration, integrator=problem.integrator)
        rules = rule_settings(experiment.model)
    with computation_progress("tuning") as show:
        tuning = find_gains(
            family.cases, ranges, duration=problem.duration, index=request.index(), objective=objective,
            budget=request.budget, seed=request.seed, start=rule_starts(rules, ranges), start_time=problem.start_time,
            integrator=problem.integrator, progress=lambda done, total: show(done / total), workers=workers,
        )  # fmt: skip
    return tuning, family.notes, rules


DEFAULT_BUDGET = 60
"""Sets of gains for each gain (chosen)."""
JOINTS: Mapping[str, Callable[..., BenchmarkJoint]] = {"proportional": proportional_joint, "on-off": on_off_joint}
"""The joints of the benchmark, by their valves."""
LEARNED = "feed-forward + PID"
"""The controller whose feed-forward is learned from trial to trial."""


@request
class BenchmarkRequest:
    """What a control benchmark is asked for."""

    valves: Callable[..., BenchmarkJoint] = option(
        "Valves of the joint.", choices=JOINTS, default="proportional", metavar="|".join(JOINTS)
    )
    controller: tuple[str, ...] = many("A controller, or a scenario file with one; repeat it for more. Default: all.")
    task: tuple[str, ...] = many("A task; repeat it for several. Default: all.")
    truths: int = option(
        "Plants on which controllers are judged.", default=len(TRUTH_SEEDS), bounds=(1, len(TRUTH_SEEDS))
    )
    searches: int = option("Searches of gains with different seeds.", default=1, bounds=(1, 100))
    budget: int = option("Most sets of gains for each gain; 0: no search.", default=DEFAULT_BUDGET, bounds=(0, 100_000))
    runs: int = option(
        "Runs to commission a controller on a plant; 0: none.", default=COMMISSIONING_RUNS, bounds=(0, 1000)
    )
    seed: int = option("Seed of the optimiser and of the noise.", default=1, bounds=(0, 1_000_000))
    trials: int = option("Trials of iterative learning at 2 Hz; 0: none.", default=0, bounds=(0, 1000))


@with_requests
def benchmark(
    request: BenchmarkRequest, execution: Execution, out: Folder = Path("benchmark"), json: Json = False
) -> None:
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
    joint, trials = request.valves(TRUTH_SEEDS[: request.truths]), request.trials
    known, names = {each.name: each for each in standard_contenders(joint)}, dict.fromkeys(request.controller)
    for name in names:
        if name not in known and is_path(name):
            known[name] = scenario_contender(joint, name)
        check_known("there is no controller", name, known, error=InputError)
    contenders, tasks = [known[name] for name in names or known], find_tasks(request.task)
    if trials and (trials < 2 or LEARNED not in [each.name for each in contenders]):
        raise InputError(f"--trials needs at least 2 trials and the controller '{LEARNED}'.")
    writes, seeds = execution.writes(out), range(request.seed, request.seed + request.searches)
    with execution.executor(alone=True) as workers, counted_progress("control benchmark") as show:
        result = benchmark_controllers(
            joint, contenders, tasks, seeds=seeds, sets_per_gain=request.budget, commissioning_runs=request.runs,
            progress=show, workers=workers,
        )  # fmt: skip
    curves = []
    if trials:
        tuned = next(each for each in result.results if each.name == LEARNED)
        curves = [learn(result.joint, tuned, find_tasks(("sine 2 Hz",))[0], trials=trials, seed=request.seed)]
    chapter = benchmark_chapter(result, curves)
    writes = writes or execution.takes_over(out)
    deliver("benchmark", [chapter], json=json, out=out, title="Control benchmark", writes=writes)
    found = [run for each in result.results for run in each.runs.values()]
    if not any(run.metrics for run in found):
        raise SimulationError(f"all runs failed; reason of the first: {found[0].reason}")

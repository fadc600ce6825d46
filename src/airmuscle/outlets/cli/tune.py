"""`airmuscle tune`: gains of the controller of a scenario, over a family of perturbed plants."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from ...core import check_writable
from ...design import Perturbations, RobustObjective, Tuning
from ...design.tuning import (
    IntegralAbsoluteError,
    IntegralTimeAbsoluteError,
    RootMeanSquareError,
    TrackingIndex,
)
from ...design.tuning import tune as find_gains
from ...design.tuning.rules import RuleSettings, rule_settings, rule_starts, step_experiment
from ...design.tuning.scenario_loop import ScenarioLoop, load_scenario_loop
from ...engine.processes import Workers
from ...report.write import save_table
from ..requests.declaration import RequestError, many, option, request
from .delivery import Execution, deliver
from .interruption import check_interrupted
from .options import Folder, Json
from .parser import Argument, CommandOption
from .requested import with_requests
from .terminal import echo, progress_bars

INDICES: dict[str, type[TrackingIndex]] = {
    "rmse": RootMeanSquareError,
    "iae": IntegralAbsoluteError,
    "itae": IntegralTimeAbsoluteError,
}
"""Tracking indices by their names."""
ScenarioFile = Annotated[
    Path, Argument("SCENARIO.toml", "A scenario file with [input.controller].")
]
SAVE = "Scenario with the tuned gains; default: SCENARIO-tuned.toml next to the scenario."
Save = Annotated[Path | None, CommandOption("--save", SAVE, "FILE.toml")]


def read_factors(text: str, where: str) -> tuple[float, ...]:
    """Factors with commas between them. Raises RequestError."""
    try:
        return tuple(float(part) for part in text.split(",") if part.strip())
    except ValueError:
        raise RequestError(
            f"{where} is '{text}'; it must be factors with commas between them, such as 0.5,2."
        ) from None


def _field(cls: Any, name: str, meaning: str, **declared: Any) -> Any:
    """An option with the default and the bounds that a dataclass declares for its field."""
    field = cls.__dataclass_fields__[name]
    bounds = field.metadata.get("within", (0.0, float("inf")))
    return option(meaning, default=field.default, bounds=bounds, **declared)


@request
class TuneRequest:
    """What a tuning is asked for."""

    bounds: tuple[str, ...] = many(
        "Range of a gain, such as 'gain=5 1/m:500 1/m'; repeatable. Default: every gain and time"
        " that is not 0, from a tenth of its present value to ten times it.",
        metavar="GAIN=MIN:MAX",
    )
    index: type[TrackingIndex] = option(
        f"Tracking index of a run: {', '.join(INDICES)}.", choices=INDICES, default="rmse"
    )
    quantile: float = _field(
        RobustObjective, "quantile", "Quantile of the index over the cases; 1: the worst case."
    )
    quantile_weight: float = _field(
        RobustObjective, "quantile_weight", "Weight of the quantile; that of the mean is 1."
    )
    air_weight: float = _field(
        RobustObjective, "air_weight", "Weight of the mean air drawn [kg/s]."
    )
    travel_weight: float = _field(
        RobustObjective, "travel_weight", "Weight of the mean travel of the commands [strokes/s]."
    )
    loads: Any = option(
        "Factors of the load; '' for none.",
        default="0.5,2",
        metavar="FACTORS",
        read=read_factors,
        empty=True,
    )
    supplies: Any = option(
        "Factors of the supply pressure; '' for none.",
        default="0.8",
        metavar="FACTORS",
        read=read_factors,
        empty=True,
    )
    leak: float = _field(
        Perturbations,
        "leak",
        "Leak at each muscle, relative to the largest conductance; 0 for none.",
        metavar="RATIO",
    )
    delay: int = _field(
        Perturbations, "delay", "Dead time of the measurements in samples; 0 for none."
    )
    draws: int = _field(
        Perturbations, "draws", "Draws of fitted parameters, from their covariance."
    )
    rules: bool = option(
        "Start from SIMC and AMIGO settings by a simulated step (PID only).", default=False
    )
    simulations: int = option(
        "Maximum number of simulated loops.", default=4000, bounds=(8, 10_000_000)
    )
    seed: int = option(
        "Seed of the optimiser and of the draws.", default=0, bounds=(0, float("inf"))
    )


@with_requests
def tune(
    scenario: ScenarioFile,
    request: TuneRequest,
    execution: Execution,
    save: Save = None,
    out: Folder = Path("tuning"),
    json: Json = False,
) -> None:
    """Tune the controller of a scenario for a family of plants.

    \b
    Differential evolution minimises the mean plus a high quantile of a tracking index over the
    nominal plant and plants with another load, supply pressure, leak, delay and drawn parameters.
    Writes SCENARIO-tuned.toml next to the scenario, the same file with the new gains, and
    DIR/report.html, DIR/history.csv and DIR/figures/. Ctrl-C ends the search; the best gains so far
    are written.

    \b
    Examples:
      airmuscle tune examples/pressure_loop.toml --rules --out tuning
      airmuscle tune lift.toml --bounds "gain=5 1/m:500 1/m" --bounds "integral_time=50 ms:5 s"
          --simulations 20000
      airmuscle tune lift.toml --cluster scheduler.json
    """
    loaded = load_scenario_loop(scenario)
    target = save or scenario.with_name(f"{scenario.stem}-tuned.toml")
    check_writable(out)
    check_writable(target.parent)
    loaded.check_target(target)
    ranges = loaded.bounds(request.bounds)
    with execution.executor(out, alone=True) as workers:
        tuning, notes, rules = _search(loaded, ranges, request, workers)
    loaded.save(tuning.gains, target)
    chapter = tuning.chapter(
        loaded.scenario.title, notes, rules, loaded.scenario.problem.integrator
    )
    files = {"history.csv": lambda path: save_table(tuning.history.table(), path)}
    if tuning.interrupted:
        echo("interrupted: the best gains so far are written", err=True)
    written = {"scenario": target}
    deliver(
        "tune",
        [chapter],
        json=json,
        out=out,
        title="Tuning",
        files=files,
        others=written,
        complete=not tuning.interrupted,
    )
    if tuning.interrupted:
        check_interrupted()
        raise KeyboardInterrupt


def _search(
    loaded: ScenarioLoop,
    ranges: Mapping[str, tuple[float, float]],
    request: TuneRequest,
    workers: Workers,
) -> tuple[Tuning, tuple[str, ...], tuple[RuleSettings, ...]]:
    """The tuning, notes on the family of plants, and the settings of the rules."""
    problem = loaded.scenario.problem
    objective = RobustObjective(
        request.quantile, request.quantile_weight, request.air_weight, request.travel_weight
    )
    perturbations = Perturbations(
        request.loads, request.supplies, request.leak, request.delay, request.draws
    )
    family = loaded.family(perturbations, request.seed)
    rules: tuple[RuleSettings, ...] = ()
    if request.rules:
        experiment = step_experiment(
            family.cases[0], problem.duration, integrator=problem.integrator
        )
        rules = rule_settings(experiment.model)
    with progress_bars("tuning") as show:
        tuning = find_gains(
            family.cases,
            ranges,
            duration=problem.duration,
            index=request.index(),
            objective=objective,
            simulations=request.simulations,
            seed=request.seed,
            start=rule_starts(rules, ranges),
            start_time=problem.start_time,
            integrator=problem.integrator,
            progress=lambda done, total: show("", done / total),
            workers=workers,
        )
    return tuning, family.notes, rules

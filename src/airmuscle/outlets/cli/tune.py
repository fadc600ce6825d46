"""`airmuscle tune`: gains of the controller of a scenario, over a family of perturbed plants."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from ...core.atomic_output import atomic_folder, check_writable
from ...core.tree import leaves
from ...design.tuning import (
    Perturbations,
    RobustObjective,
    RuleSettings,
    TrackingIndex,
    Tuning,
    rule_settings,
    rule_starts,
    step_experiment,
)
from ...design.tuning import tune as find_gains
from ...design.tuning.chapter import case_table, gain_table, history_table, rule_table, tuning_chapter
from ...design.tuning.scenario_loop import ScenarioLoop, load_scenario_loop
from ...files.scenario.controller import signal_units
from ...report.chapter import Table
from ...report.formatting import format_number, table_rows
from ...report.write import save_table, write_into
from .interruption import check_interrupted
from .options import Folder, Json
from .progress import computation_progress
from .terminal import echo, print_json, print_table
from .tune_options import (
    AirWeight,
    Bounds,
    Budget,
    Delay,
    Draws,
    Index,
    Leak,
    Loads,
    Quantile,
    QuantileWeight,
    Rules,
    Save,
    ScenarioFile,
    Seed,
    Supplies,
    TravelWeight,
    read_factors,
    read_index,
)

HISTORY_FILE = "history.csv"


class TuneRequest(NamedTuple):
    """Settings of a search."""

    tracking: TrackingIndex
    objective: RobustObjective
    perturbations: Perturbations
    budget: int
    seed: int
    rules: bool


class TuneResult(NamedTuple):
    """A scenario, the result for it, notes and settings of rules."""

    loaded: ScenarioLoop
    tuning: Tuning
    notes: tuple[str, ...]
    rules: tuple[RuleSettings, ...]


def tune(
    scenario: ScenarioFile,
    bounds: Bounds = None,
    index: Index = "rmse",
    quantile: Quantile = 0.9,
    quantile_weight: QuantileWeight = 1.0,
    air_weight: AirWeight = 0.0,
    travel_weight: TravelWeight = 0.0,
    loads: Loads = "0.5,2",
    supplies: Supplies = "0.8",
    leak: Leak = 0.01,
    delay: Delay = 1,
    draws: Draws = 4,
    rules: Rules = False,
    budget: Budget = 4000,
    seed: Seed = 0,
    save: Save = None,
    out: Folder = Path("tuning"),
    json: Json = False,
) -> None:
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
    """
    loaded = load_scenario_loop(scenario)
    target = save or scenario.with_name(f"{scenario.stem}-tuned.toml")
    for folder in (out, target.parent):
        check_writable(folder)
    loaded.check_target(target)
    factors = read_factors(loads, "--loads"), read_factors(supplies, "--supplies")
    objective = RobustObjective(quantile, quantile_weight, air_weight, travel_weight)
    request = TuneRequest(
        read_index(index), objective, Perturbations(*factors, leak, delay, draws), budget, seed, rules
    )  # fmt: skip
    result = _search(loaded, loaded.bounds(bounds or ()), request)
    loaded.save(result.tuning.gains, target)
    page = _write(result, out)
    if json:
        print_json(_to_dict(result.tuning, target))
    else:
        _print(result, f"scenario: {target}", f"report: {page}")
    if result.tuning.interrupted:
        check_interrupted()
        raise KeyboardInterrupt


def _search(loaded: ScenarioLoop, ranges: Mapping[str, tuple[float, float]], request: TuneRequest) -> TuneResult:
    problem = loaded.scenario.problem
    family = loaded.family(request.perturbations, request.seed)
    rules: tuple[RuleSettings, ...] = ()
    if request.rules:
        experiment = step_experiment(family.cases[0], problem.duration, integrator=problem.integrator)
        rules = rule_settings(experiment.model)
    with computation_progress("tuning") as show:
        tuning = find_gains(
            family.cases, ranges, duration=problem.duration, index=request.tracking, objective=request.objective,
            budget=request.budget, seed=request.seed, start=rule_starts(rules, ranges), start_time=problem.start_time,
            integrator=problem.integrator, progress=lambda done, total: show(done / total),
        )  # fmt: skip
    return TuneResult(loaded, tuning, family.notes, rules)


def _units(loaded: ScenarioLoop) -> dict[str, str]:
    """Units of the columns of the plant by name, and of the parameters of the controller by path."""
    scenario, loop = loaded.scenario, loaded.loop
    of_gains = {leaf.path: loaded.unit(leaf) for leaf in leaves(loop.controller)}
    return {**signal_units(scenario.plant, scenario.initial_state), **of_gains}


def _write(result: TuneResult, out: Path) -> Path:
    loaded = result.loaded
    chapter = tuning_chapter(
        result.tuning, loaded.scenario.title, _units(loaded), result.notes, result.rules,
        loaded.scenario.problem.integrator,
    )  # fmt: skip
    with atomic_folder(out) as folder:
        save_table(history_table(result.tuning), folder / HISTORY_FILE)
        write_into(folder, [chapter], title="Tuning")
    return out / "report.html"


def _print(result: TuneResult, *files: str) -> None:
    tuning = result.tuning
    present = tuning.present_objective
    before = "" if present is None else f", with the present gains {present:.4g}"
    echo(f"{result.loaded.scenario.title}: objective {tuning.objective:.4g}{before}")
    echo(f"{tuning.simulated_loops} loops: {len(tuning.history)} sets of gains in {len(tuning.cases)} cases")
    _print_table(gain_table(tuning, _units(result.loaded)))
    _print_table(case_table(tuning, _units(result.loaded)))
    if result.rules:
        _print_table(rule_table(result.rules))
    for note in result.notes:
        echo(f"note: {note}")
    for path in tuning.on_bound:
        echo(f"note: '{path}' is on a bound of its range; a wider range may give a smaller objective")
    if tuning.interrupted:
        echo("interrupted: the best gains so far are written", err=True)
    for line in files:
        echo(line)


def _print_table(table: Table) -> None:
    rows = [
        tuple(value if isinstance(value, str) else format_number(value) for value in row) for row in table_rows(table)
    ]
    numeric = [name for name, values in table.columns.items() if not isinstance(next(iter(values)), str)]
    print_table(list(table.columns), rows, right=numeric)


def _to_dict(tuning: Tuning, target: Path) -> dict[str, Any]:
    """A tuning as plain data, all numbers SI."""
    metrics, best = tuning.history.metrics, tuning.best
    return {
        "gains": tuning.gains,
        "objective": tuning.objective,
        "present_objective": tuning.present_objective,
        "loops": tuning.simulated_loops,
        "seed": tuning.seed,
        "interrupted": tuning.interrupted,
        "on_bound": list(tuning.on_bound),
        "cases": {
            case.name: {"index": metrics.index[best, i], "air": metrics.air[best, i]}
            for i, case in enumerate(tuning.cases)
        },
        "scenario": str(target),
    }

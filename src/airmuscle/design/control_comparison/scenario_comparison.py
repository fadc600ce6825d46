"""Comparison of the controllers of scenario files on the plant of one, and on drawn truths."""

import dataclasses
import zlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from ...core import Hint, ParameterError, flatten, leaves, structure
from ...engine.loop import MAX_DELAY
from ...engine.processes import Workers
from ...files.library import located_errors
from ...physics import Plant
from ..tuning.perturbations import parameter_draws
from ..tuning.scenario_loop import ScenarioLoop, load_scenario_loop
from .compared_loops import (
    NOMINAL,
    ComparedLoop,
    ComparedPlant,
    RunSettings,
    controlled_columns,
    plant_columns,
    run_loops,
)
from .loop_comparison import LoopComparison
from .spreads import ParameterSpread, drawn_truth, read_spread

FITTED = "the stated uncertainty of fitted parameters"


def compare_loops(
    loops: Sequence[ComparedLoop],
    plants: Sequence[ComparedPlant],
    settings: RunSettings,
    *,
    spreads: Sequence[str] = (),
    notes: Sequence[str] = (),
    workers: Workers = 1,
    progress: Callable[[int, int], object] = lambda done, total: None,
) -> LoopComparison:
    """Control loops on a nominal plant, the first one, and on truths of its structure.

    loops            with the same set points; one alone is judged on all plants
    spreads, notes   texts for the report: from what the truths were drawn, and remarks
    workers          number of processes, for several of which a script needs `if __name__ ==
                     "__main__":`, or an executor: a run is a task. The result does not depend on it

    A run that fails has a reason and no metrics. Raises ParameterError for names that occur twice,
    loops without a common controlled column, and set points that differ.
    """
    runs = run_loops(loops, plants, settings, workers=workers, progress=progress)
    columns = controlled_columns(loops, plants[0].plant)
    return LoopComparison(
        tuple(loops), tuple(plants), columns, settings, runs, tuple(spreads), tuple(notes)
    )


def compare_scenarios(
    paths: Sequence[str | Path],
    *,
    rig: str | Path | None = None,
    spreads: Sequence[str] = (),
    truth_seeds: Sequence[int] = (),
    delay: int = 0,
    begin: float = 0.0,
    workers: Workers = 1,
    progress: Callable[[int, int], object] = lambda done, total: None,
) -> LoopComparison:
    """The controllers of scenario files on the plant that they have in common, and on its truths.

    rig          scenario whose plant, initial state, duration and other inputs hold for all; by
                 default that of the first file, with which those of the others must agree
    spreads      ranges of parameters of the plant, `mechanism.mass=20 %` or
                 `mechanism.mass=4 kg:7 kg`
    truth_seeds  one truth for each: the parameters of the spreads, and those whose uncertainty the
                 muscle or scenario file states, are drawn. The controllers know the nominal plant
    delay        greatest dead time of all measurements that nobody knows, in samples; each truth
                 has a drawn one
    begin        time from the start from which on errors are judged [s]

    Raises what `load_scenario_loop` raises, and ParameterError for plants that differ without a
    rig, seeds without a spread, and what `compare_loops` refuses.
    """
    if not 0 <= delay <= MAX_DELAY:
        raise ParameterError(f"compare: delay is {delay}; allowed range: 0 to {MAX_DELAY} samples.")
    loaded = [load_scenario_loop(path) for path in paths]
    if not loaded:
        raise ParameterError("compare: no scenario is given; give two or more.")
    base = load_scenario_loop(rig) if rig is not None else loaded[0]
    notes = list[str]()
    loops = []
    columns = plant_columns(base.scenario.plant)
    for scenario, name in zip(loaded, _names(paths), strict=True):
        if rig is None:
            _check_same_rig(base, scenario)
        elif difference := _difference(base, scenario):
            notes.append(f"{name} was written for another rig: {difference}")
        others = base.loop.other_inputs if rig is not None else scenario.loop.other_inputs
        loop = dataclasses.replace(scenario.loop, other_inputs=others)
        with located_errors(scenario.location):
            loop.check_columns(columns, base.scenario.plant.inputs)
        loops.append(ComparedLoop(name, loop))
    read = [read_spread(text, base.scenario.plant) for text in spreads]
    plants = _plants(base, read, truth_seeds, delay)
    problem = base.scenario.problem
    settings = RunSettings(
        problem.duration,
        problem.start_time,
        begin,
        problem.integrator,
        min(compared.loop.sample_time for compared in loops),
    )
    sources = [*map(str, read), *([FITTED] if _has_uncertainty(base) and truth_seeds else [])]
    if delay and truth_seeds:
        sources.append(f"a dead time of 0 to {delay} samples")
    return compare_loops(
        loops,
        plants,
        settings,
        spreads=sources,
        notes=notes,
        workers=workers,
        progress=progress,
    )


def _names(paths: Sequence[str | Path]) -> list[str]:
    """The names of files without their ends; with their folders where two are alike."""
    stems = [Path(path).stem for path in paths]
    return [
        stem if stems.count(stem) == 1 else Path(path).with_suffix("").as_posix()
        for stem, path in zip(stems, paths, strict=True)
    ]


def _has_uncertainty(base: ScenarioLoop) -> bool:
    fitted = base.scenario.uncertainty
    return bool(fitted and fitted.parameters) or any(base.uncertainties())


def _plants(
    base: ScenarioLoop, spreads: Sequence[ParameterSpread], seeds: Sequence[int], delay: int
) -> list[ComparedPlant]:
    """The nominal plant, and one for each seed. Raises ParameterError where nothing is drawn."""
    plant = base.scenario.plant
    plants = [ComparedPlant(NOMINAL, plant, base.scenario.initial_state)]
    if seeds and not (spreads or delay or _has_uncertainty(base)):
        raise ParameterError(
            "compare: there are truth seeds, but nothing from which truths are drawn; neither the"
            " scenario nor its muscle file states an uncertainty of parameters.",
            hint=Hint("To state a range", "spreads", ("mechanism.mass=20 %",)),
        )
    for seed in seeds:
        fitted = dict(
            parameter_draws(plant, base.uncertainties(), base.scenario.uncertainty, 1, seed)
        )
        truth = drawn_truth(next(iter(fitted.values()), plant), spreads, seed)
        with located_errors(f"truth {seed}"):
            start = base.initial_state_of(truth)
        plants.append(
            ComparedPlant(
                f"truth {seed}", truth, start, _drawn_delay(seed, delay), _changed(plant, truth)
            )
        )
    return plants


def _drawn_delay(seed: int, greatest: int) -> int:
    random = np.random.default_rng([seed, zlib.crc32(b"delay")])
    return int(random.integers(0, greatest + 1))


def _changed(plant: Plant, truth: Plant) -> Mapping[str, float]:
    """The parameters of a truth that differ from those of the nominal plant, by path."""
    return {
        leaf.path: leaf.value
        for leaf, nominal in zip(leaves(truth), leaves(plant), strict=True)
        if leaf.value != nominal.value
    }


def _difference(base: ScenarioLoop, other: ScenarioLoop) -> str:
    """In what another scenario differs from the rig, as a text; empty where it does not."""
    ours, theirs = base.scenario, other.scenario
    if structure(ours.plant) is not structure(theirs.plant):
        return "its plant has other parts"
    values = zip(leaves(ours.plant), flatten(theirs.plant).tolist(), strict=True)
    for leaf, value in values:
        if leaf.value != value:
            return f"its {leaf.path} is {value:.5g}, not {leaf.value:.5g} {leaf.declared.unit}"
    if ours.initial_state != theirs.initial_state:
        return "its initial state is another one"
    if ours.problem.duration != theirs.problem.duration:
        return f"its duration is {theirs.problem.duration:g} s, not {ours.problem.duration:g} s"
    if ours.problem.start_time != theirs.problem.start_time:
        return "its start time is another one"
    if repr(base.loop.other_inputs) != repr(other.loop.other_inputs):
        return "its other inputs are others"
    return ""


def _check_same_rig(base: ScenarioLoop, other: ScenarioLoop) -> None:
    """Raise ParameterError where a scenario has another plant, start or duration than the first."""
    if difference := _difference(base, other):
        raise ParameterError(
            f"{other.path}: {difference} in {base.path}. Controllers are compared on one plant:"
            " give both files the same [plant] and [run].",
            hint=Hint("To take plant, start, duration and other inputs of one file", "rig", ...),
        )

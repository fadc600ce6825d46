"""What one fit can, all can: progress, a budget, a checkpoint from which a killed search goes on to
the same bits, covariance, profiles and refits, and the name of a row that is not finite.

Every kind of fit of the bench is listed once, with a small problem of its own.
"""

from __future__ import annotations

import functools
import importlib
import inspect
import itertools
import pkgutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from arm_episodes import known_arm, made_episodes
from filling import hanging

import airmuscle.bench
from airmuscle.bench import (
    Creep,
    Experiment,
    InitialConditions,
    PolynomialCurve,
    fit,
    fit_creep,
    fit_dynamic,
    fit_hysteresis,
)
from airmuscle.bench.estimation import (
    LeastSquares,
    LeastSquaresProblem,
    ProblemSearch,
    SearchStage,
    SolvedProblem,
    watched_searches,
)
from airmuscle.bench.joint import (
    FreeRunProblem,
    JointProblem,
    ReadPressures,
    RegulatorLag,
    RegulatorLagProblem,
    RegulatorLimits,
    Windows,
    cut,
)
from airmuscle.bench.statics import VolumePoints, fit_nonlinear, fit_volume
from airmuscle.engine import Schedule, result_store, simulate
from airmuscle.errors import AirmuscleWarning, IdentificationError
from airmuscle.physics import Braid, Dahl, Isometric, Plant, Polytropic, TonduLopez2000
from airmuscle.recording import Recording


@functools.cache
def static() -> SolvedProblem:
    rows = np.meshgrid(np.linspace(1e5, 6e5, 8), np.linspace(0.0, 0.2, 8))
    pressure, contraction = (axis.ravel() for axis in rows)
    force = TonduLopez2000(Braid(0.0095, 0.42, 0.3), 1.3).force(pressure, contraction)
    columns = {
        "pressure": pressure,
        "contraction": contraction,
        "force": force + np.random.default_rng(0).standard_normal(force.size),
    }
    law = TonduLopez2000(Braid(0.012, 0.5, 0.3), 1.1)
    fitted = fit(law, Recording(columns, "grid"), fixed=("geometry.radius",))
    return SolvedProblem(fitted.problem, fitted.values)


@functools.cache
def of_dynamics() -> SolvedProblem:
    """Fills of a muscle that is held at one length."""
    muscle = hanging()
    plant = Plant(muscle.muscle, muscle.circuit, Isometric(0.05), Polytropic(1.2))
    command = Schedule({"fill": ((0.0, 1.0),)})
    start = InitialConditions.at_coordinates(plant, 0.0)
    experiments = []
    for seed in range(3):
        empty = plant.state_at(pressure=0.0)
        run = simulate(plant, command, duration=1.0, initial_state=empty, output_times=0.01)
        noise = 300.0 * np.random.default_rng(seed).standard_normal(len(run))
        noisy = run.with_columns(pressure=run["pressure"] + noise)
        experiments.append(Experiment(noisy, command, start))
    first = replace(plant, gas=Polytropic(1.3))
    free = ("circuit.fill.conductance", "gas.exponent")
    return fit_dynamic(first, experiments, free=free, observed={"pressure": 300.0}).solved


@functools.cache
def of_hysteresis() -> SolvedProblem:
    turns = (0.0, 0.12, 0.08, 0.11, 0.06, 0.12, 0.0)
    contraction = np.concatenate([np.linspace(a, b, 40) for a, b in itertools.pairwise(turns)])
    static_force = 400.0 - 2500.0 * contraction - 3000.0 * contraction**2
    friction = Dahl(3e4, 20.0).force_along(0.2 * contraction)
    noise = 0.2 * np.random.default_rng(1).standard_normal(contraction.size)
    columns = {
        "time": 0.1 * np.arange(contraction.size),
        "pressure": np.full(contraction.size, 3e5),
        "contraction": contraction,
        "force": static_force - friction + noise,
    }
    loop = Recording(columns, "loop", {"resting_length": 0.2})
    curve = PolynomialCurve("contraction", 2)
    return fit_hysteresis(Dahl(8e3, 60.0), loop, static_curve=curve).solved


@functools.cache
def of_creep() -> SolvedProblem:
    time = np.arange(0.0, 60.0, 0.2)
    values = Creep(0.1, (0.01, 0.02), (1.0, 15.0)).value_at(time)
    noisy = values + 2e-4 * np.random.default_rng(4).standard_normal(time.size)
    recording = Recording({"time": time, "contraction": noisy}, "hold")
    solved = fit_creep(recording, "contraction").solved
    assert solved is not None
    return solved


@functools.cache
def of_volume() -> SolvedProblem:
    contraction = np.linspace(0.0, 0.25, 30)
    noise = 1e-7 * np.random.default_rng(3).standard_normal(30)
    points = VolumePoints(contraction, Braid(0.01, 0.45, 0.3).volume(contraction) + noise, 0)
    return fit_volume(points, 0.3).solved


@functools.cache
def of_surface() -> SolvedProblem:
    rows = np.meshgrid(np.linspace(0.5e5, 6e5, 8), np.linspace(0.0, 900.0, 7))
    pressure, force = (axis.ravel() for axis in rows)
    contraction = 0.22 * (1.0 - np.exp(-pressure / 2.5e5)) * (1.0 - force / 2500.0)
    noise = 1e-3 * np.random.default_rng(0).standard_normal(force.size)
    columns = {"pressure": pressure, "force": force, "contraction": contraction + noise}
    data = Recording(columns, "surface")
    return fit_nonlinear(data, 0.3, pressure_degree=2, force_degree=1).solved


@functools.cache
def of_regulator_lags() -> SolvedProblem:
    random = np.random.default_rng(0)
    truth = RegulatorLag((0.2, 0.7, 0.4, 0.3, 0.2, 0.2, 3.0, 0.5), 2, True)
    command = random.normal(size=(20, 60))
    pressure = truth.pressures(np.full((20, 60), 1e5), command)
    pressure = pressure + 500.0 * random.standard_normal(pressure.shape)
    start = replace(truth, values=(0.1, 0.6, 0.6, 0.3, 0.3, 0.1, 3.2, 0.4))
    limits = RegulatorLimits(
        (-9.0, 0.05, 0.05, 0.0, 0.0, -1.0, 2.0, -9.0), (9.0, 1.0, 1.0, 2.0, 2.0, 1.0, 5.0, 9.0)
    )
    problem = RegulatorLagProblem(start, pressure, command, limits).with_known(7, 0.4)
    values = ProblemSearch(problem, LeastSquares(), problem.initial_values).run(200).values
    return SolvedProblem(problem, values)


@functools.cache
def windows() -> Windows:
    return cut(made_episodes(8), 0, 40).sample(40)


@functools.cache
def of_known_joint() -> SolvedProblem:
    arm = known_arm()
    system = ReadPressures(arm, (1.0,) * 2, (0.0,) * 2)
    problem = FreeRunProblem(system, ("zeros[0]", "zeros[1]", "arm.lags[0]"), windows())
    return problem.solved(problem.solve())


@functools.cache
def of_joint() -> SolvedProblem:
    paths = ("lags[0]", "mechanism.elements[0].coulomb_torque")
    problem = JointProblem(known_arm(), windows(), 0, paths)
    end = problem.search([SearchStage(40, 20, 20)])
    return replace(problem, arm=end.arm).solved


FITS = {
    "static": static,
    "dynamic": of_dynamics,
    "hysteresis": of_hysteresis,
    "creep": of_creep,
    "volume": of_volume,
    "surface": of_surface,
    "regulator lags": of_regulator_lags,
    "known joint": of_known_joint,
    "joint": of_joint,
}
SEARCHED = [name for name in FITS if name != "volume"]
"""Those whose parameters no linear equations give."""


def start_of(solved: SolvedProblem) -> np.ndarray:
    """An initial guess beside the solution, inside the bounds."""
    low, high = solved.problem.bounds
    sizes = solved.problem.coordinates.sizes
    moved = solved.values + 0.05 * np.where(solved.values == 0.0, sizes, np.abs(solved.values))
    return np.clip(moved, low, high)


def cost(solved: SolvedProblem, values: np.ndarray) -> float:
    """The sum that its search minimises."""
    return ProblemSearch(solved.problem, solved.loss, values).cost


def search(solved: SolvedProblem, runs: int = 60) -> np.ndarray:
    return ProblemSearch(solved.problem, solved.loss, start_of(solved)).run(runs).values


class KilledError(Exception):
    """A search that is ended from outside."""


@pytest.mark.parametrize("name", SEARCHED)
def test_the_search_of_every_fit_shows_its_progress_and_ends_with_a_budget(name: str):
    solved = FITS[name]()
    fractions: list[float] = []
    with watched_searches(lambda _, fraction: fractions.append(fraction)):
        found = search(solved)
    assert len(fractions) >= 2
    assert fractions == sorted(fractions)
    assert cost(solved, found) <= cost(solved, start_of(solved))
    with (
        pytest.warns(AirmuscleWarning, match="before convergence.*Give a longer budget"),
        watched_searches(budget=1e-9),
    ):
        ended = search(solved)
    assert cost(solved, ended) <= cost(solved, start_of(solved))


@pytest.mark.parametrize("name", SEARCHED)
def test_a_killed_search_of_every_fit_goes_on_to_the_same_bits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
):
    monkeypatch.setattr("airmuscle.bench.estimation.search.CHECKPOINT_INTERVAL", 0.0)
    solved = FITS[name]()
    problem = solved.problem
    counts = {"killed": 0, "resumed": 0, "alone": 0}
    state = {"which": "alone", "limit": 10**9}
    evaluate = type(problem).evaluate

    def counted(self: Any, *arguments: Any) -> Any:
        counts[state["which"]] += 1
        if counts[state["which"]] > state["limit"]:
            raise KilledError
        return evaluate(self, *arguments)

    monkeypatch.setattr(type(problem), "evaluate", counted)
    undisturbed = search(solved)
    if counts["alone"] < 4:
        pytest.skip("the search converges at once")
    with result_store.result_store(tmp_path):
        state.update(which="killed", limit=counts["alone"] - 1)
        with pytest.raises(KilledError):
            search(solved)
        state.update(which="resumed", limit=10**9)
        resumed = search(solved)
    np.testing.assert_array_equal(resumed, undisturbed)
    assert counts["resumed"] < counts["alone"], "it did not begin anew"


@pytest.mark.parametrize("name", FITS)
def test_every_fit_has_covariance_profile_and_identifiability(name: str):
    solved = FITS[name]()
    errors = np.array([estimate.stderr for estimate in solved.estimates])
    inside = [i for i, estimate in enumerate(solved.estimates) if not estimate.on_bound]
    assert (errors[inside] > 0.0).all()
    assert solved.covariance.run_count == len(np.unique(solved.problem.runs.run))
    assert solved.identifiability.singular_values.size == errors.size
    best = inside[int(np.argmin(errors[inside] / np.abs(solved.values[inside])))]
    if isinstance(solved.loss, LeastSquares):
        low, high = solved.profile(solved.problem.names[best])
        assert low < solved.values[best] < high
        assert high - low < 40.0 * errors[best]


@pytest.mark.parametrize("name", ["static", "dynamic", "hysteresis", "creep", "volume", "surface"])
def test_every_fit_is_refitted_to_runs_that_are_drawn(name: str):
    """Parts of a run stand for runs where there is one."""
    solved = FITS[name]()
    count = solved.problem.target.size
    runs = replace(solved.problem.runs, run=np.arange(count) * 6 // count)
    drawn = replace(solved, runs=runs).bootstrap(4, seed=1)
    assert drawn.shape == (4, solved.values.size)
    known = drawn[np.isfinite(drawn).all(axis=1)]
    assert len(known) >= 2
    assert np.ptp(known, axis=0).max() > 0.0


@pytest.mark.parametrize("name", FITS)
def test_every_fit_names_the_row_that_is_not_finite(name: str, monkeypatch: pytest.MonkeyPatch):
    solved = FITS[name]()
    problem = solved.problem
    target = problem.target.copy()
    row = target.size // 2
    target[row] = np.nan
    monkeypatch.setitem(vars(problem), "target", target)
    with pytest.raises(IdentificationError, match="1 of") as caught:
        ProblemSearch(problem, solved.loss, solved.values).check_start()
    assert problem.describe_row(row) in str(caught.value)


def problems() -> set[type]:
    """All classes of problems of the bench."""
    for module in pkgutil.walk_packages(airmuscle.bench.__path__, "airmuscle.bench."):
        importlib.import_module(module.name)
    found: set[type] = set()
    open_classes: list[type] = [LeastSquaresProblem]
    while open_classes:
        kind = open_classes.pop()
        open_classes += kind.__subclasses__()
        if not inspect.isabstract(kind) and kind.__module__.startswith("airmuscle."):
            found.add(kind)
    return found


def test_every_problem_of_the_bench_is_listed_here():
    listed = {type(make().problem) for make in FITS.values()}
    listed.add(RegulatorLagProblem)
    others = {kind.__name__ for kind in problems() - listed}
    # The holds of a campaign are one more kind of time constants.
    assert others <= {"HeldForceProblem", "PartialProblem"}

"""Plants composed at random from every model, within the declared bounds: each runs, ends with a
reason, or is refused.

No exception of another package is raised, no number is NaN, and the books of air mass, of the air's
energy and of the mechanism close. The tolerances of the books, relative to what was held or turned
over, are chosen; that of the mass is not less than one rounding error a step. Where the energies of
a plant are small beside the tolerance of the integrator, its energy books close with a smaller
tolerance.
"""

from __future__ import annotations

import collections
import dataclasses

import numpy as np
import pytest
from composer import STOCK, Composer, models_in

from airmuscle import Status
from airmuscle.core import DiagnosticCode
from airmuscle.engine import Problem, Rodas4, solve
from airmuscle.errors import AirmuscleError, ParameterError
from airmuscle.physics import (
    Ambient,
    EnergyBalance,
    FillDischarge,
    GaussianResidual,
    HangingMass,
    Isothermal,
    Plant,
    RegulatedSupply,
    Supply,
    Tank,
    Valve,
    WithEnergyMeters,
    WithLatch,
)

# Laws and geometries of different lengths are combined.
pytestmark = pytest.mark.filterwarnings("ignore:.*is the law of a muscle of")
DURATION = 0.5
VALVE = Valve(1e-8, 0.3)


def gaps(run):
    """The largest gap of each book, relative to what was held or turned over."""
    mechanical = run["kinetic_energy"] + run["potential_energy"]
    losses = run["mechanism_loss"]
    work = run["work_of_tension"]
    flow = run["energy_of_flow"]
    heat = run["heat_to_air"]
    expansion = run["work_of_air"]
    books = {
        "mass": (
            run["air_total"],
            run["air_supplied"] - run["air_exhausted"],
            run["air_total"].max() + turnover(run["air_supplied"], run["air_exhausted"]),
        ),
        "air": (
            run["air_energy"],
            flow + heat - expansion,
            run["air_energy"].max() + turnover(flow, heat, expansion),
        ),
        "mechanical": (mechanical, work - losses, turnover(mechanical, work, losses) + 1e-3),
    }
    return {
        name: np.abs(held - held[0] - brought).max() / size
        for name, (held, brought, size) in books.items()
    }


def turnover(*columns):
    return sum(np.abs(np.diff(column)).sum() for column in columns)


def outcome(seed):
    """How the plant of a seed ended: a status, or a refusal by the name of its exception."""
    composer = Composer(seed)
    try:
        plant = composer.plant()
        start = composer.state(plant)
        command = composer.command(plant, DURATION)
    except AirmuscleError as refusal:
        return type(refusal).__name__
    metered = WithEnergyMeters(plant)
    problem = Problem(metered, command, DURATION, metered.extend_state(start), output_times=5e-3)
    solution = solve(problem)
    run = solution.recording
    for name in run:
        assert np.isfinite(run[name]).all(), name
    if not solution.complete:
        reason = solution.diagnostics[-1]
        assert reason.code is DiagnosticCode.INCOMPLETE
        assert solution.status.message in str(reason)
    if len(run["time"]) > 1:
        rounding = np.finfo(float).eps * solution.statistics.steps
        assert gaps(run)["mass"] < max(1e-13, rounding), seed
        if solution.complete and not energies_close(run, plant):
            exact = solve(dataclasses.replace(problem, integrator=Rodas4(1e-9))).recording
            assert energies_close(exact, plant), (seed, gaps(run), gaps(exact))
    return solution.status


def energies_close(run, plant):
    """Whether the books of energy close, without the impact of a latch, which has no meter."""
    found = gaps(run)
    without_meter = any(isinstance(part, WithLatch) for part in models_in(plant.mechanism))
    return abs(found["air"]) < 1e-5 and (without_meter or found["mechanical"] < 1e-4)


@pytest.mark.parametrize(
    "seeds",
    [range(2), *(pytest.param(range(n, n + 20), marks=pytest.mark.slow) for n in (2, 22))],
    ids=str,
)
def test_a_plant_composed_at_random_runs_or_ends_with_a_reason_or_is_refused(seeds):
    outcomes = collections.Counter(outcome(seed) for seed in seeds)
    assert outcomes[Status.DONE] >= 1, outcomes


def test_the_energy_of_a_mechanism_with_a_residual_closes():
    """Two joints without tension and gravity, which the torques of the residual alone move:
    friction takes their work.
    """
    plant = Composer(2364).plant()
    assert any(isinstance(part, GaussianResidual) for part in models_in(plant.mechanism))
    assert outcome(2364) is Status.DONE


@pytest.mark.slow
@pytest.mark.parametrize("part", range(20))
def test_so_do_two_thousand(part):
    outcomes = collections.Counter(
        outcome(seed) for seed in range(1000 + 100 * part, 1100 + 100 * part)
    )
    assert outcomes[Status.DONE] >= 33, outcomes


def test_compositions_contain_every_model_that_enters_a_plant():
    composed = set()
    for seed in range(150):
        try:
            composed |= {type(model) for model in models_in(Composer(seed).plant())}
        except AirmuscleError:
            continue
    missing = {model.__name__ for model in set(STOCK) - composed}
    assert not missing


@pytest.mark.parametrize(
    "supply",
    [
        Supply(-9e4),
        Tank(Supply(-9e4), VALVE, 1e-3, EnergyBalance(0.1)),
        RegulatedSupply(Tank(Supply(-9e4), VALVE, 1e-3), VALVE, 3e5),
    ],
)
def test_a_supply_below_absolute_vacuum_is_refused_with_its_plant(supply):
    muscle = next(thing for thing in STOCK if thing.__name__ == "Muscle")
    parts = STOCK[muscle][0], FillDischarge(supply, VALVE, VALVE), HangingMass(10.0), Isothermal()
    assert Plant(*parts).circuits
    with pytest.raises(
        ParameterError, match=r"Supply.pressure .* is -90 kPa, .* allowed range: above -58 kPa"
    ):
        Plant(*parts, Ambient(pressure=5.8e4))

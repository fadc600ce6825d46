"""One plant with all that is hard at once: delayed valves, slack, an end stop, friction, a tube and
heat, switched ten thousand times, with parameters drawn at random. Its books of air mass and of
energy close, it meets no NaN and does not stall.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joints import chosen_muscle

from airmuscle.engine import Problem, Rodas4, Schedule, SolenoidDriver, WithDrivers, simulate, solve
from airmuscle.physics import (
    CreepElements,
    DirectionalDamper,
    DistributedTube,
    EndStop,
    EnergyBalance,
    FillDischarge,
    HangingMass,
    HuntCrossley,
    LuGre,
    MaxwellSlip,
    Plant,
    RegulatedSupply,
    SeriesSpring,
    Supply,
    Tank,
    Tube,
    Valve,
    ViscoelasticWall,
    WithEnergyMeters,
    WithTubes,
)

SWITCHINGS = 10_000


def drawn(seed):
    """A plant of parameters drawn at random, and how it is switched."""
    rng = np.random.default_rng(seed)

    def about(value, factor=2.0):
        return float(value * factor ** rng.uniform(-1, 1))

    friction = [
        MaxwellSlip((about(2e4), about(2e4)), (2e-4, 1e-3)),
        LuGre(about(4e4), about(15.0), 5.0, 0.01, 50.0, 20.0),
    ]
    muscle = replace(
        chosen_muscle(),
        damper=DirectionalDamper(about(200.0), about(100.0), 2e-4, 1e-4),
        friction=friction[seed % 2],
        stop=EndStop(rng.uniform(0.1, 0.14), HuntCrossley(about(3e8))),
        creep=CreepElements((about(3e3),), (about(0.3),)),
        wall=ViscoelasticWall(about(1e-11), about(0.03)),
    )
    heat = EnergyBalance(about(0.5))
    supply = RegulatedSupply(
        Tank(Supply(about(7e5, 1.1)), Valve(5e-9, 0.3), 2e-3, heat), Valve(4e-8, 0.3), 5e5
    )
    valves = FillDischarge(supply, Valve(about(1.5e-8, 1.3), 0.4), Valve(about(3e-8, 1.3), 0.3))
    tube = Tube.from_dimensions(about(0.5), about(5e-3, 1.3), 2, heat)
    plant = Plant(muscle, WithTubes(valves, tube), HangingMass(about(20.0, 1.3)), heat)
    return plant, switched(rng)


def switched(rng, count=SWITCHINGS):
    """Fill and discharge in turn for random times, through valves that answer late and move at a
    finite speed.
    """
    lengths = rng.uniform(0.007, 0.04, (count // 4, 4)) * np.array(
        [1.0, 1.0, 4.0, 1.0]
    )  # fill, wait, discharge, wait
    instants = 0.05 + np.cumsum(lengths.ravel()).reshape(-1, 4) - lengths[0, 0]
    levels = np.tile([1.0, 0.0], count // 4)
    changes = {
        name: tuple(zip(instants[:, pair].ravel().tolist(), levels.tolist(), strict=True))
        for name, pair in (("fill", [0, 1]), ("discharge", [2, 3]))
    }
    drivers = {
        "fill": SolenoidDriver(3.1e-3, 4.3e-3, 1e-3),
        "discharge": SolenoidDriver(2.2e-3, 5.7e-3, 0.0, 2e-3),
    }
    return WithDrivers(Schedule(changes), drivers), float(instants[-1, -1]) + 0.1


def run_of(seed, rtol):
    plant, (command, duration) = drawn(seed)
    metered = WithEnergyMeters(plant)
    start = metered.extend_state(plant.state_at(pressure=1e5, position=0.0))
    segments = command.segments(plant.inputs, 0.0, duration)
    assert segments.ends.size > SWITCHINGS
    problem = Problem(metered, command, duration, start, output_times=2e-3, integrator=Rodas4(rtol))
    return plant, solve(problem).raise_if_incomplete(), segments


def turned_over(column):
    """How much went back and forth in all."""
    return np.abs(np.diff(column)).sum()


def gaps(run):
    """What is missing in each book at its worst, as a share of what was turned over in it."""
    mechanical = run["kinetic_energy"] + run["potential_energy"]
    air = run["air_energy"]
    total = run["air_total"]
    books = {
        "mass": (total, run["air_supplied"] - run["air_exhausted"], run["air_supplied"]),
        "mechanical": (mechanical, run["work_of_tension"], run["work_of_tension"]),
        "air": (
            air,
            run["energy_of_flow"] + run["heat_to_air"] - run["work_of_air"],
            run["work_of_air"],
        ),
    }
    return {
        name: np.abs(held - held[0] - brought).max() / turned_over(size)
        for name, (held, brought, size) in books.items()
    }


def judged(seed, rtol):
    """What must hold of every draw: the greatest gap of each book, and the run."""
    plant, solution, segments = run_of(seed, rtol)
    run = solution.recording
    statistics = solution.statistics
    assert all(np.isfinite(run[name]).all() for name in run)
    assert (run["force"] == 0.0).any()  # it hung slack
    assert run["contraction"].max() > plant.muscle.stop.contraction  # and met its stop
    assert run["force"].min() < 0.0
    assert np.ptp(run["temperature"]) > 50.0
    assert (
        statistics.steps + statistics.rejected_steps
        < 80 * segments.ends.size * (1e-5 / rtol) ** 0.25
    )  # it is of order four
    found = gaps(run)
    assert found["mass"] < 1e-11
    assert found["air"] < 1e-11
    return found["mechanical"], run


def test_ten_thousand_switchings_of_everything_at_once():
    mechanical, run = judged(3, 1e-5)
    assert mechanical < 1e-5
    for wall in ("damping_heat", "friction_work"):
        assert run[wall][-1] > 1.0


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(8))
def test_ten_thousand_switchings_for_many_plants_and_the_book_closes_with_the_tolerance(seed):
    """The work of a tension with kinks is integrated to the tolerance, not to rounding; air and
    heat are to rounding.
    """
    coarse, fine = (judged(seed, rtol)[0] for rtol in (1e-5, 1e-7))
    assert coarse < 1e-4
    assert fine < coarse / 10


def series(seed):
    """The same with a series spring and a tube with inertia, switched less often: both are
    stiff.
    """
    plant, _ = drawn(seed)
    muscle = replace(
        plant.muscle, series=SeriesSpring(2e5), friction=MaxwellSlip((2e4, 1e4), (2e-4, 1e-3))
    )
    circuit = replace(plant.circuit, tube=DistributedTube(0.5, 5e-3, 6, plant.gas))
    return replace(plant, muscle=muscle, circuit=circuit)


def test_a_series_spring_and_a_tube_with_inertia_keep_the_books_as_well():
    plant = series(1)
    metered = WithEnergyMeters(plant)
    command, duration = switched(np.random.default_rng(1), 150)
    start = metered.extend_state(plant.state_at(pressure=1e5, position=0.0))
    run = simulate(
        metered,
        command,
        duration=duration,
        initial_state=start,
        integrator=Rodas4(1e-6),
        output_times=1e-3,
    )
    found = gaps(run)
    assert max(found["mass"], found["air"]) < 1e-11
    assert found["mechanical"] < 1e-6
    assert np.ptp(run["tube6.flow"]) > 1e-3
    given_out = sum(
        run[n] for n in ("work_of_tension", "damping_heat", "element_work", "friction_work")
    )
    assert np.abs(run["work_of_contractile"] - given_out).max() < 1e-5 * turned_over(
        run["work_of_contractile"]
    )

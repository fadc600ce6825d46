"""At its limits a run neither ends in NaN nor stalls: no flow, shut valves, equal pressures,
vacuum, an emptied muscle.

Every case runs for every gas; the steps are bounded, so that no case chatters. The bounds are
chosen, about twice what was counted.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joints import chosen_muscle

from airmuscle.engine import ZERO_INPUT, Problem, Rodas4, Schedule, simulate, solve
from airmuscle.physics import (
    AntagonisticJoint,
    ClosedChamber,
    Dahl,
    EnergyBalance,
    FillDischarge,
    HangingMass,
    HuntCrossley,
    Isometric,
    Isothermal,
    Plant,
    Polytropic,
    ProportionalRegulator,
    ProportionalValve,
    SecondOrderLag,
    SpringLoad,
    Supply,
    Tank,
    Tube,
    Valve,
    WithEndStops,
    WithLeak,
    WithTubes,
    find_equilibrium,
    total_air,
)

GASES = [Isothermal(), Polytropic(1.2), EnergyBalance(0.2), EnergyBalance(0.0)]
MUSCLE = chosen_muscle()
VALVE = Valve(2.6e-9, 0.433)
LOAD = SpringLoad(5.0, 1e3, 5.0, 40.0)
OPEN = Schedule({"fill": ((0.0, 1.0),)})
BOTH = Schedule({"fill": ((0.0, 1.0),), "discharge": ((0.0, 1.0),)})
EMPTY = Schedule({"discharge": ((0.0, 1.0),)})


def valves(pressure):
    return FillDischarge(Supply(pressure), VALVE, VALVE)


def pushed(plant, pressure):
    """Off its rest, so that what has just come to a limit swings about it."""
    start = find_equilibrium(plant, pressure=pressure)
    return {name: value + 0.05 * (name == "speed") for name, value in start.items()}


def in_limits(solution, most):
    """Every number is finite, and there are no more steps than this."""
    run = solution.recording
    for name in run:
        assert np.isfinite(run[name]).all(), name
    assert solution.statistics.steps <= most, solution
    assert all((run[name] > 0).all() for name in run if name.endswith("air_mass"))


CASES = {
    "no flow through a valve of conductance zero": (
        FillDischarge(Supply(5e5), Valve(0.0, 0.433), Valve(0.0, 0.433)),
        LOAD,
        BOTH,
        2e5,
        100.0,
        180,
    ),
    "shut valves for an hour": (valves(5e5), LOAD, ZERO_INPUT, 2e5, 3600.0, 180),
    "supply at the muscle's pressure": (valves(2e5), LOAD, OPEN, 2e5, 100.0, 150),
    "all at the pressure of the surroundings": (valves(0.0), LOAD, BOTH, 0.0, 100.0, 150),
    "both valves open": (valves(5e5), LOAD, BOTH, 2e5, 100.0, 210),
    "vacuum from the supply": (valves(-0.98e5), LOAD, OPEN, 0.0, 60.0, 120),
    "vacuum in a frame": (valves(-1e5), Isometric(0.05), OPEN, 1e5, 60.0, 120),
    "emptied through its valve": (valves(5e5), LOAD, EMPTY, 4e5, 100.0, 450),
    "emptied through a leak": (
        WithLeak(ClosedChamber(), Valve(1e-11, 0.3)),
        LOAD,
        ZERO_INPUT,
        4e5,
        3600.0,
        800,
    ),
    "emptied with a load that stretches it slack": (
        WithLeak(ClosedChamber(), Valve(1e-9, 0.3)),
        WithEndStops(HangingMass(15.0), -0.005, 0.1, HuntCrossley(1e7)),
        ZERO_INPUT,
        3e5,
        100.0,
        1200,
    ),
    "a tank that empties into the muscle": (
        FillDischarge(Tank(Supply(6e5), Valve(0.0, 0.3), 1e-4), VALVE, VALVE),
        LOAD,
        OPEN,
        0.0,
        100.0,
        330,
    ),
    "a regulator at its set point": (
        ProportionalRegulator(Supply(6e5), VALVE, VALVE, SecondOrderLag(20.0)),
        LOAD,
        Schedule({"setpoint": ((0.0, 2e5),)}),
        2e5,
        100.0,
        150,
    ),
    "a regulator set to nothing": (
        ProportionalRegulator(Supply(6e5), VALVE, VALVE, SecondOrderLag(20.0)),
        LOAD,
        ZERO_INPUT,
        4e5,
        100.0,
        500,
    ),
    "a proportional valve with underlap": (
        ProportionalValve(Supply(6e5), VALVE, VALVE, SecondOrderLag(50.0), -0.1),
        LOAD,
        ZERO_INPUT,
        2e5,
        100.0,
        420,
    ),
    "a tube with no pressure across it": (
        WithTubes(valves(2e5), Tube(Valve(1e-7, 0.2), 1e-6)),
        LOAD,
        OPEN,
        2e5,
        100.0,
        150,
    ),
}


@pytest.mark.parametrize("gas", GASES, ids=repr)
@pytest.mark.parametrize(
    ("circuit", "load", "command", "pressure", "duration", "most"), CASES.values(), ids=CASES
)
def test_a_plant_at_its_limits_runs_through(circuit, load, command, pressure, duration, most, gas):
    plant = Plant(MUSCLE, circuit, load, gas)
    in_limits(
        solve(Problem(plant, command, duration, pushed(plant, pressure))).raise_if_incomplete(),
        most,
    )


def test_an_emptied_muscle_ends_at_the_pressure_of_the_surroundings():
    plant = Plant(MUSCLE, WithLeak(ClosedChamber(), Valve(1e-10, 0.3)), LOAD)
    run = simulate(
        plant, ZERO_INPUT, duration=3600.0, initial_state=find_equilibrium(plant, pressure=4e5)
    )
    assert run["pressure"][-1] == pytest.approx(0.0, abs=1.0)
    assert run["mass_flow"][-1] == pytest.approx(0.0, abs=1e-12)


def test_vacuum_leaves_what_the_supply_has():
    plant = Plant(MUSCLE, valves(-0.98e5), LOAD)
    run = simulate(plant, OPEN, duration=60.0, initial_state=find_equilibrium(plant, pressure=0.0))
    assert run["pressure"][-1] == pytest.approx(-0.98e5, abs=50.0)
    assert run["force"].min() >= 0.0


def test_at_no_flow_and_shut_valves_the_air_stays_but_for_rounding():
    for name in ("no flow through a valve of conductance zero", "shut valves for an hour"):
        circuit, load, command, pressure, duration, _ = CASES[name]
        plant = Plant(MUSCLE, circuit, load)
        run = simulate(
            plant,
            command,
            duration=duration,
            initial_state=plant.state_at(pressure=pressure, position=0.01),
        )
        assert np.ptp(run["air_mass"]) <= 1e-15 * run["air_mass"][0]


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9])
def test_a_joint_between_equal_pressures_stays_where_it_is(rtol):
    muscles = tuple(
        replace(MUSCLE, name=name, friction=Dahl(1e5, 5.0)) for name in ("left", "right")
    )
    valve = ProportionalValve(Supply(3e5), VALVE, VALVE, SecondOrderLag(50.0), 0.05, muscle_count=2)
    plant = Plant(muscles, valve, AntagonisticJoint(0.03, 0.05, 0.2, 2.0, 0.12))
    start = find_equilibrium(plant, pressure=3e5)
    solution = solve(
        Problem(plant, ZERO_INPUT, 600.0, start, integrator=Rodas4(rtol))
    ).raise_if_incomplete()
    run = solution.recording
    in_limits(solution, 60)
    np.testing.assert_allclose(run["angle"], 0.0, atol=1e-9)
    air = total_air({name: run[name] for name in run})
    assert np.ptp(air) <= 1e-15 * air[0]


def test_a_thousand_switchings_at_equal_pressures_cost_a_few_steps_each():
    plant = Plant(MUSCLE, valves(2e5), LOAD)
    changes = tuple((0.01 * k, float(k % 2)) for k in range(1, 1001))
    start = find_equilibrium(plant, pressure=2e5)
    in_limits(
        solve(Problem(plant, Schedule({"fill": changes}), 10.1, start)).raise_if_incomplete(), 3100
    )

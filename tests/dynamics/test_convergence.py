"""A solution is the plant's, not the grid's: bit for bit the same wherever it is looked at, and
converging at the order of its method away from kinks. The smooth plants have a wall that lags,
creep, a cubic spring, and heat or a tube with inertia: not both, as air that turns round brings
another temperature, which is a kink.
"""

from __future__ import annotations

import functools

import numpy as np
import pytest
from joints import chosen_muscle

from airmuscle.engine import (
    ZERO_INPUT,
    DormandPrince8,
    Rodas4,
    RungeKutta4,
    SampledSignal,
    Schedule,
    simulate,
)
from airmuscle.physics import (
    Braid,
    ClosedChamber,
    CreepElements,
    CubicSpring,
    DistributedTube,
    EnergyBalance,
    FillDischarge,
    HangingMass,
    LinearDamper,
    Muscle,
    Plant,
    Polytropic,
    Supply,
    Valve,
    VirtualWork,
    ViscoelasticWall,
    WithTubes,
)

BRAID = Braid(0.01, 0.4363, 0.2)
HEAT = EnergyBalance(0.5)
MUSCLE = Muscle(
    VirtualWork(BRAID),
    BRAID,
    CubicSpring(3000.0, 20.0),
    LinearDamper(150.0),
    wall=ViscoelasticWall(2e-11, 0.05),
    creep=CreepElements((5e3,), (0.1,)),
)
WAVES = Polytropic(1.3)
SMOOTH = {
    "heat": Plant(MUSCLE, ClosedChamber(), HangingMass(20.0), HEAT),
    "tube": Plant(
        MUSCLE,
        WithTubes(ClosedChamber(), DistributedTube(0.5, 2e-3, 2, WAVES)),
        HangingMass(20.0),
        WAVES,
    ),
}
METHODS = [Rodas4(1e-5), RungeKutta4(2e-4), DormandPrince8(5e-4)]


def valves_and_all():
    valve = Valve(8e-9, 0.4)
    circuit = WithTubes(
        FillDischarge(Supply(5e5), valve, valve), DistributedTube(0.5, 3e-3, 2, HEAT)
    )
    return Plant(chosen_muscle(), circuit, HangingMass(10.0), HEAT)


# The grid


@pytest.mark.parametrize("method", METHODS, ids=repr)
def test_states_at_common_instants_are_bit_for_bit_the_same(method):
    plant = valves_and_all()
    start = plant.state_at(pressure=1e5, position=0.005)
    command = Schedule({"fill": ((0.0313, 1), (0.1, 0.5), (0.2, 0)), "discharge": ((0.25, 1),)})
    common = np.array([0.0313, 0.0777, 0.1, 0.123456789, 0.31, 0.4])
    grids = [common, np.linspace(0.0, 0.4, 1001), np.linspace(0.0, 0.4, 37), np.array([0.4])]
    runs = [
        simulate(
            plant,
            command,
            duration=0.4,
            initial_state=start,
            integrator=method,
            output_times=np.union1d(common, grid),
        )
        for grid in grids
    ]
    for run in runs:
        here = np.isin(run["time"], common)
        assert here.sum() == common.size
        for name in (s.name for s in plant.states):
            assert (run[name][here] == runs[0][name][np.isin(runs[0]["time"], common)]).all()
        assert run.notes[0] == runs[0].notes[0]  # the same steps


def test_the_last_state_does_not_know_how_often_it_was_looked_at():
    plant = valves_and_all()
    start = plant.state_at(pressure=1e5, position=0.005)
    command = SampledSignal({"fill": ((0.0, 0.0), (0.1, 1.0), (0.2, 0.0))})
    for method in METHODS:
        ends = [
            simulate(
                plant,
                command,
                duration=0.4,
                initial_state=start,
                integrator=method,
                output_times=output,
            )
            for output in (0.4, 1e-4)
        ]
        assert [ends[0][s.name][-1] for s in plant.states] == [
            ends[1][s.name][-1] for s in plant.states
        ]


# The order


def course(name, method, duration=0.32):
    """The states at 40 instants, by their nominal sizes, and the number of steps."""
    plant = SMOOTH[name]
    start = plant.state_at(pressure=3e5, position=0.025, speed=0.02)
    run = simulate(
        plant,
        ZERO_INPUT,
        duration=duration,
        initial_state=start,
        integrator=method,
        output_times=duration / 40,
    )
    steps = int(run.notes[0].split(": ")[1].split()[0])
    assert run["force"].min() > 10.0  # taut
    for flow in ("tube1.flow", "tube2.flow"):  # laminar
        assert name != "tube" or np.abs(run[flow]).max() * 2e-3 / (np.pi * 1e-6 * 1.82e-5) < 1187
    return np.array([run[s.name] / s.nominal for s in plant.states]), steps


@functools.cache
def exact(name):
    return course(name, DormandPrince8(1e-4))[0]


def error(name, method):
    found, steps = course(name, method)
    return np.abs(found - exact(name)).max(), steps


@pytest.mark.parametrize("name", SMOOTH)
@pytest.mark.parametrize(("method", "order"), [(RungeKutta4, 4), (DormandPrince8, 8)])
def test_explicit_methods_have_their_order(name, method, order):
    coarse = {("heat", 4): 2e-3, ("heat", 8): 16e-3, ("tube", 4): 4e-4, ("tube", 8): 8e-4}[
        name, order
    ]
    errors = np.array(
        [error(name, method(coarse / 2**i))[0] for i in range(2 if order == 8 else 3)]
    )
    measured = np.log2(errors[:-1] / errors[1:])
    assert measured == pytest.approx(order, abs=0.15 * order)


@pytest.mark.parametrize("name", SMOOTH)
def test_rodas4_has_order_four_in_its_steps_and_one_in_its_tolerance(name):
    tolerances = np.array([1e-6, 1e-7, 1e-8, 1e-9])
    errors, steps = np.array([error(name, Rodas4(rtol)) for rtol in tolerances]).T
    order = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    by_tolerance = np.polyfit(np.log(tolerances), np.log(errors), 1)[0]
    assert order == pytest.approx(4.0, abs=0.6)
    assert by_tolerance == pytest.approx(1.0, abs=0.2)

"""The straight-fibre muscle in motion: the circle with virtual work is closed-form, enters a plant
and keeps energy.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import airmuscle as am
from airmuscle.errors import AirmuscleWarning, TraceError
from airmuscle.physics import WithEnergyMeters


@pytest.fixture(scope="module")
def plant():
    with pytest.warns(
        AirmuscleWarning, match="tested up to a strain of 3, reached at about 19 % contraction"
    ):
        muscle = am.load("saga2007-circle").muscle
    valve = am.Valve(2.6167e-9, 0.433)
    circuit = am.FillDischarge(am.Supply(0.16e6), valve, valve)
    return am.Plant(
        dataclasses.replace(muscle, damper=am.LinearDamper(60.0)),
        circuit,
        am.HangingMass(10.0),
        am.Isothermal(),
    )


def test_it_lifts_its_load_to_where_the_law_balances_it(plant):
    start = am.find_equilibrium(plant, pressure=0.11e6)
    run = am.simulate(plant, am.Schedule({"fill": ((0.1, 1),)}), duration=8.0, initial_state=start)
    end = {name: run[name][-1] for name in run}
    law = plant.muscles[0].contractile
    assert run["contraction"][-1] > run["contraction"][0] + 0.05
    assert law.force(end["pressure"], end["contraction"]) == pytest.approx(10.0 * 9.80665, rel=1e-4)


def test_its_work_is_the_energy_of_the_load(plant):
    metered = WithEnergyMeters(plant)
    start = am.find_equilibrium(plant, pressure=0.11e6) | {s.name: 0.0 for s in metered.states[3:]}
    command = am.Schedule({"fill": ((0.1, 1), (0.5, 0))})
    run = am.simulate(
        metered, command, duration=1.0, initial_state=start, integrator=am.Rodas4(1e-10)
    )
    energy = run["kinetic_energy"] + run["potential_energy"]
    np.testing.assert_allclose(energy - energy[0], run["work_of_tension"], atol=1e-8)


def test_the_exact_meridian_cannot_be_traced_and_says_what_can():
    exact = am.load("saga2007-exact").characteristic
    braid = am.geometry.Braid(0.01, 0.4, 0.3)
    with pytest.raises(
        TraceError, match=r"ExactMeridian of muscle is not closed-form.*as_force_law"
    ):
        am.Plant(
            am.Muscle(exact, braid),
            am.FillDischarge(am.Supply(1e5), VALVE, VALVE),
            am.HangingMass(1.0),
        )


VALVE = am.Valve(1e-9, 0.4)

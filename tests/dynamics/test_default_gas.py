"""The default gas: it warms while a muscle is filled, less than an adiabatic gas, and cools to the
wall; one for all runs.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import airmuscle as am
from airmuscle.design import LiftRequirement, SizingConditions, size_muscles
from airmuscle.files import list_plants
from airmuscle.outlets.environments import arm_task, joint_task, lift_task
from airmuscle.physics import Ambient, EnergyBalance, WallHeatTransfer
from airmuscle.physics.pneumatics import DEFAULT_GAS

VALVE = am.Valve(1e-8, 0.3)
AMBIENT = Ambient()


def vessel(volume: float, gas: am.physics.Gas | None = None) -> am.Plant:
    """A held muscle of constant volume on a supply of 6 bar."""
    muscle = am.Muscle.ideal(am.geometry.Vessel(volume))
    plant = am.Plant(muscle, am.FillDischarge(am.Supply(6e5), VALVE, VALVE), am.Isometric(0.0))
    return plant if gas is None else replace(plant, gas=gas)


def fill(plant: am.Plant, duration: float) -> am.Recording:
    start = plant.state_at(pressure=0.0)
    return am.simulate(
        plant, am.Schedule({"fill": ((0.0, 1.0),)}), duration=duration, initial_state=start
    )


def test_a_fill_warms_the_air_less_than_an_adiabatic_one_and_it_cools_to_the_wall():
    run = fill(vessel(1e-4), 20.0)
    adiabatic = fill(vessel(1e-4, EnergyBalance(0.0)), 20.0)["temperature"].max()
    assert adiabatic == pytest.approx(388.0, abs=0.5)
    assert 320.0 < run["temperature"].max() < adiabatic
    assert run["temperature"][-1] == pytest.approx(AMBIENT.temperature, abs=0.5)


def test_the_air_of_a_filled_muscle_at_rest_is_that_of_the_isothermal_gas():
    mass = fill(vessel(1e-4), 20.0)["air_mass"][-1]
    assert mass == pytest.approx(7.01325e5 * 1e-4 / (287.05 * AMBIENT.temperature), rel=2e-3)
    assert mass == pytest.approx(
        fill(vessel(1e-4, am.Isothermal()), 20.0)["air_mass"][-1], rel=2e-3
    )


def test_size_and_a_default_plant_need_the_same_air():
    conditions = SizingConditions(supply=6e5)
    choice = size_muscles(
        LiftRequirement(stroke=0.03, mass=20.0), conditions, [am.load("dmsp-20-300")]
    ).choices[0]
    muscle = choice.muscle.muscle
    count = choice.count
    assert muscle is not None
    masses = []
    for point in (choice.design.extended, choice.design.contracted):
        plant = am.Plant(
            muscle, am.FillDischarge(am.Supply(6e5), VALVE, VALVE), am.Isometric(point.contraction)
        )
        masses.append(plant.state_at(pressure=point.pressure)["air_mass"])
    assert choice.air == pytest.approx(count * abs(masses[1] - masses[0]), rel=0.01)


@pytest.mark.parametrize(
    ("diameter", "slenderness", "share"),
    [(0.01, 15, 1.0), (0.02, 15, 1.0), (0.04, 15, 1.0), (0.02, 5, 0.738), (0.02, 60, 1.549)],
)
def test_the_heat_passes_the_surface_of_a_cylinder(
    diameter: float, slenderness: float, share: float
):
    length = slenderness * diameter
    volume = math.pi * diameter**2 / 4 * length
    surface = math.pi * diameter * (length + diameter / 2)
    gas = WallHeatTransfer(30.0)
    state = gas.state_at(3e5, volume, AMBIENT)
    warm = {**state, "internal_energy": 1.1 * state["internal_energy"]}
    heat = gas.heat_flow(warm, gas.air(warm, volume, AMBIENT), AMBIENT)
    assert 30.0 * surface * -0.1 * AMBIENT.temperature / heat == pytest.approx(share, rel=1e-3)


def test_a_larger_muscle_cools_more_slowly_in_proportion_to_its_diameter():
    def cooling_time(diameter: float) -> float:
        plant = vessel(math.pi * diameter**2 / 4 * 15 * diameter)
        start = plant.state_at(pressure=5e5)
        warm = {**start, "internal_energy": 1.1 * start["internal_energy"]}
        run = am.simulate(
            plant, am.Schedule({}), duration=20.0, initial_state=warm, output_times=0.01
        )
        return float(
            run["time"][np.argmax(run["temperature"] - AMBIENT.temperature < 29.3 / math.e)]
        )

    times = [cooling_time(d) for d in (0.01, 0.02, 0.04)]
    assert [t / times[0] for t in times] == pytest.approx([1.0, 2.0, 4.0], rel=0.05)


def test_all_runs_that_state_no_gas_have_one_default():
    assert vessel(1e-4).gas is DEFAULT_GAS
    assert WallHeatTransfer(25.0) == DEFAULT_GAS
    vessels = {"vessel-smc-itv2050"}  # rigid, and stated to be isothermal
    plants = [am.load(name).plant for name in list_plants() if name not in vessels]
    plants += [task[0].plant for task in (joint_task(), lift_task(), arm_task())]
    assert {plant.gas for plant in plants} == {DEFAULT_GAS}

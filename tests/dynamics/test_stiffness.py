"""Two stiffnesses: at constant pressure, k_p = -dF/deps, and with shut valves, where the pressure
follows the gas.

polytropic:  dp/deps = -n p_abs/V dV/deps
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from joints import chosen_muscle

from airmuscle.engine import Rodas4, simulate, spline_trajectory
from airmuscle.physics import (
    AntagonisticJoint,
    Braid,
    ClosedChamber,
    EnergyBalance,
    HangingMass,
    Isometric,
    Isothermal,
    Lever,
    LinearSpring,
    Muscle,
    MusclesInSeries,
    Plant,
    Polytropic,
    PrescribedMotion,
    SeriesSpring,
    VirtualWork,
    absolute_pressure,
    find_equilibrium,
    stiffness,
)
from airmuscle.physics.pneumatics import HEAT_CAPACITY_RATIO

BRAID = Braid(0.01, 0.4363, 0.2)
MUSCLE = Muscle(VirtualWork(BRAID), BRAID, LinearSpring(3000.0))
"""Without a damper, so that a pull however quick shows the stiffness alone."""
EXPONENTS = [(Isothermal(), 1.0), (Polytropic(1.2), 1.2), (EnergyBalance(0.0), HEAT_CAPACITY_RATIO)]
by_gas = pytest.mark.parametrize(("gas", "exponent"), EXPONENTS, ids=str)


def pulled(gas, pressure=3e5, contraction=0.12):
    """The tensions of a muscle that is slowly pulled by 0.5 mm on either side of a contraction,
    valves shut.
    """
    plant = Plant(MUSCLE, ClosedChamber(), PrescribedMotion(), gas)
    middle = contraction * 0.2
    amplitude = 5e-4
    motion = spline_trajectory([0.0, 2.0, 4.0], [middle + amplitude, middle, middle - amplitude])
    start = plant.state_at(pressure=pressure, position=middle)
    start |= {"position": middle + amplitude, "speed": 0.0}
    if "internal_energy" in start:  # put there without heat, as its content in the middle is
        before, after = (BRAID.volume(x / 0.2) for x in (middle, middle + amplitude))
        start["internal_energy"] *= (before / after) ** (HEAT_CAPACITY_RATIO - 1)
    run = simulate(
        plant,
        motion.input,
        duration=4.0,
        initial_state=start,
        integrator=Rodas4(1e-11),
        output_times=0.01,
    )
    return plant, run


@by_gas
def test_the_stiffness_with_shut_valves_is_that_of_a_simulated_pull(gas, exponent):
    plant, run = pulled(gas)
    state = plant.state_at(pressure=3e5, position=0.024)
    found = stiffness(plant, state).muscles["muscle"]
    near = np.abs(run["contraction"] - 0.12) < 1.3e-3
    slope = np.polyfit(run["contraction"][near] - 0.12, run["force"][near], 3)[-2]
    assert found.shut_valves == pytest.approx(-slope, rel=1e-5)
    assert found.shut_valves > 1.2 * found.constant_pressure


@pytest.mark.parametrize("warmer", [0.9, 1.0, 1.3])
def test_air_that_is_warmer_or_colder_than_its_wall_is_as_stiff_as_without_heat_transfer(warmer):
    """A fast motion is adiabatic: dp/deps = -gamma p_abs/V dV/deps, whatever heat flows
    meanwhile.
    """
    found = []
    for heat_transfer in (0.0, 5.0):
        plant = Plant(MUSCLE, ClosedChamber(), Isometric(0.12), EnergyBalance(heat_transfer))
        state = plant.state_at(pressure=3e5)
        found.append(
            stiffness(
                plant, {**state, "internal_energy": warmer * state["internal_energy"]}
            ).muscles["muscle"]
        )
    pressure = warmer * absolute_pressure(3e5, plant.ambient)
    area = VirtualWork(BRAID).effective_area(0.12)
    growth = BRAID.volume_derivative(0.12)
    following = area * HEAT_CAPACITY_RATIO * pressure / BRAID.volume(0.12) * growth
    assert found[0].shut_valves - found[0].constant_pressure == pytest.approx(following, rel=1e-9)
    assert found[1] == pytest.approx(found[0], rel=1e-12)


@by_gas
@given(st.floats(2e5, 6e5), st.floats(0.0, 0.15))
@settings(max_examples=20, deadline=None)
def test_both_are_their_formulas(gas, exponent, pressure, contraction):
    plant = Plant(MUSCLE, ClosedChamber(), Isometric(contraction), gas)
    found = stiffness(plant, plant.state_at(pressure=pressure))
    area = VirtualWork(BRAID).effective_area(contraction)
    growth = BRAID.volume_derivative(contraction)
    volume = BRAID.volume(contraction)
    at_pressure = MUSCLE.stiffness(pressure, contraction)
    following = area * exponent * absolute_pressure(pressure, plant.ambient) / volume * growth
    assert found.muscles["muscle"].constant_pressure == pytest.approx(at_pressure, rel=1e-9)
    assert found.muscles["muscle"].shut_valves == pytest.approx(at_pressure + following, rel=1e-9)
    assert found.per_metre["muscle"] == pytest.approx([k / 0.2 for k in found.muscles["muscle"]])
    assert found.coordinates == {}


def test_a_series_spring_stands_in_series():
    """Against the static tension of the whole at two contractions, with the same air."""
    muscle = replace(chosen_muscle(), series=SeriesSpring(4e4))
    gas = Polytropic(1.2)
    h = 1e-6
    middle = Plant(muscle, ClosedChamber(), Isometric(0.1), gas)
    state = middle.state_at(pressure=2e5)
    found = stiffness(middle, state).muscles["muscle"]

    def tension(contraction, **air):
        plant = replace(middle, mechanism=Isometric(contraction))
        return plant.outputs(find_equilibrium(plant, **air), {})["force"]

    for expected, air in (
        (found.constant_pressure, {"pressure": 2e5}),
        (found.shut_valves, {"air_mass": state["air_mass"]}),
    ):
        slope = (tension(0.1 + h, **air) - tension(0.1 - h, **air)) / (2 * h)
        assert expected == pytest.approx(-slope, rel=1e-5)
    rigid = stiffness(
        replace(middle, muscle=chosen_muscle()),
        Plant(chosen_muscle(), ClosedChamber(), Isometric(0.1), gas).state_at(pressure=2e5),
    )
    assert found.constant_pressure < rigid.muscles["muscle"].constant_pressure


@pytest.mark.parametrize(
    "mechanism",
    [
        AntagonisticJoint(0.03, 0.05, 0.2, 2.0, 0.12),
        Lever((0.05, 0.04), 4.0, 0.3, offsets=(0.1, 0.12)),
        MusclesInSeries(HangingMass(5.0), (0.2,)),
    ],
    ids=lambda m: type(m).__name__,
)
@pytest.mark.parametrize("gas", [Isothermal(), Polytropic(1.2)], ids=repr)
def test_that_of_a_coordinate_is_the_slope_of_the_pull_with_the_same_air(mechanism, gas):
    muscles = tuple(replace(MUSCLE, name=name) for name in ("left", "right"))
    plant = Plant(muscles, (ClosedChamber(), ClosedChamber()), mechanism, gas)
    place = {c.name: 0.05 * (i + 1) * 10 * c.nominal for i, c in enumerate(mechanism.coordinates)}
    state = plant.state_at(pressure=(3e5, 2e5), **place)
    found = stiffness(plant, state).coordinates
    assert set(found) == set(place)
    for c in mechanism.coordinates:
        h = 1e-6 * c.nominal
        pulls = []
        for sign in (1, -1):
            moved = {**state, c.name: state[c.name] + sign * h}
            tensions = [float(port.tension) for port in plant.muscle_states(moved)]
            pulls.append(
                mechanism.generalised_forces(moved, tensions, plant.resting_lengths)[c.name]
            )
        assert found[c.name].shut_valves == pytest.approx(
            -(pulls[0] - pulls[1]) / (2 * h), rel=1e-5
        )
        assert found[c.name].shut_valves > found[c.name].constant_pressure


def test_a_slack_muscle_has_none():
    plant = Plant(MUSCLE, ClosedChamber(), Isometric(0.3), Isothermal())
    found = stiffness(plant, plant.state_at(pressure=1e3)).muscles["muscle"]
    assert found == (0.0, 0.0)

"""A plant at rest: nothing accelerates, whatever is given of its air; every rest is found, and
judged as it behaves.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bumpy import Bumpy
from hypothesis import given, settings
from hypothesis import strategies as st
from joints import chosen_muscle
from widths import widened

from airmuscle.core import ops
from airmuscle.engine import ZERO_INPUT, Schedule, simulate
from airmuscle.engine.compile import compile_system
from airmuscle.errors import EquilibriumError, GeometryLimitError, ParameterError, UnitError
from airmuscle.physics import (
    AntagonisticJoint,
    ClosedChamber,
    CreepElements,
    Dahl,
    EnergyBalance,
    FillDischarge,
    HangingMass,
    HuntCrossley,
    Isometric,
    Isothermal,
    JointWithEndStops,
    Lever,
    MusclesInSeries,
    Plant,
    Polytropic,
    PrescribedMotion,
    ProportionalValve,
    SecondOrderLag,
    SeriesSpring,
    SpringLoad,
    Supply,
    Valve,
    ViscoelasticWall,
    WithLatch,
    WithOffsets,
    find_equilibria,
    find_equilibrium,
)
from airmuscle.physics.equilibrium.single_dof import grid
from airmuscle.physics.equilibrium.statics import Statics

LEFT, RIGHT = (replace(chosen_muscle(), name=name) for name in ("left", "right"))
VALVE = Valve(2.6e-8, 0.433)
CIRCUIT = FillDischarge(Supply(6e5), VALVE, VALVE)
JOINT = AntagonisticJoint(0.03, 0.05, 0.2, 2.0, 0.12)
COMPLIANT = replace(chosen_muscle(), series=SeriesSpring(5e4), wall=ViscoelasticWall(1e-12, 0.05))
GASES = [Isothermal(), Polytropic(1.2), EnergyBalance(1.0)]


def joint_plant(mechanism=JOINT, gas=Polytropic(1.2)):
    return Plant((LEFT, RIGHT), (ClosedChamber(), ClosedChamber()), mechanism, gas)


def rates(plant, state):
    found = compile_system(plant).rates(
        [state[s.name] for s in plant.states], [0.0] * len(plant.inputs)
    )
    return found / [s.nominal for s in plant.states]


PLANTS = {
    "joint": joint_plant(),
    "hanging": Plant(chosen_muscle(), CIRCUIT, HangingMass(20.0)),
    "compliant": Plant(COMPLIANT, CIRCUIT, HangingMass(20.0)),
    "creep and friction": Plant(
        replace(chosen_muscle(), creep=CreepElements((500.0,), (2.0,)), friction=Dahl(1e5, 5.0)),
        CIRCUIT,
        HangingMass(20.0),
    ),
    "lever": joint_plant(Lever((0.05, -0.05), 2.0, 0.3, 0.01, 0.1, (0.1, 0.1))),
    "parallel": joint_plant(WithOffsets(HangingMass(25.0), (0.02, 0.05))),
    "series": joint_plant(MusclesInSeries(HangingMass(20.0), (0.5,))),
    "series on a spring": joint_plant(MusclesInSeries(SpringLoad(1.0, 3e3), (0.5,))),
    "isometric": Plant(chosen_muscle(), CIRCUIT, Isometric(0.1)),
}


ALL = [(name, gas) for name in PLANTS for gas in GASES if name != "compliant" or gas == GASES[-1]]


def in_turn(name, gas):
    """Every mechanism with one gas and every gas with some; the compliant plant has one gas
    only.
    """
    return name == "compliant" or (list(PLANTS).index(name) + GASES.index(gas)) % len(GASES) == 0


@pytest.mark.parametrize(("name", "gas"), widened(ALL, in_turn), ids=str)
def test_at_an_equilibrium_nothing_moves(name, gas):
    plant = replace(PLANTS[name], gas=gas)
    for rest in find_equilibria(plant, pressure=3e5):
        assert np.abs(rates(plant, rest.state)).max() < 1e-6
    state = find_equilibrium(plant, pressure=3e5)
    run = simulate(plant, ZERO_INPUT, duration=1.0, initial_state=state)
    for c in plant.mechanism.coordinates:
        np.testing.assert_allclose(run[c.name], state[c.name], atol=1e-6 * c.nominal)


@pytest.mark.parametrize(
    ("name", "gas"),
    widened([pair for pair in ALL if pair[0] not in ("compliant", "creep and friction")], in_turn),
    ids=str,
)
def test_the_air_that_a_pressure_puts_in_gives_the_same_rest(name, gas):
    plant = replace(PLANTS[name], gas=gas)
    by_pressure = find_equilibrium(plant, pressure=2.5e5)
    air = tuple(by_pressure[f"{p}air_mass"] for p in plant.prefixes)
    by_mass = find_equilibrium(plant, air_mass=air)
    assert by_mass == pytest.approx(by_pressure, rel=1e-7, abs=1e-9)


def test_so_it_does_where_wall_and_series_spring_give():
    plant = Plant(COMPLIANT, CIRCUIT, Isometric(0.1))
    state = find_equilibrium(plant, pressure=2.5e5)
    assert find_equilibrium(plant, air_mass=state["air_mass"]) == pytest.approx(
        state, rel=1e-7, abs=1e-9
    )


def test_a_position_without_room_for_air_is_no_rest():
    shrinking = replace(chosen_muscle(), wall=ViscoelasticWall(2e-11, 0.05))
    (rest,) = find_equilibria(Plant(shrinking, CIRCUIT, HangingMass(1e-4)), pressure=-5e4)
    assert rest.stable
    assert np.isfinite(list(rest.state.values())).all()
    with pytest.raises(
        EquilibriumError, match=r"muscle pulls [.\d]+ N at -50 kPa and a contraction of -"
    ):
        find_equilibrium(Plant(shrinking, CIRCUIT, HangingMass(50.0)), pressure=-5e4)
    for find in (
        find_equilibria,
        find_equilibrium,
    ):  # at some positions the air would have more than 1000 bar
        with pytest.raises(
            EquilibriumError, match="PrescribedMotion is in equilibrium at every position"
        ):
            find(Plant(chosen_muscle(), CIRCUIT, PrescribedMotion()), air_mass=2e-4)


def test_shut_in_air_takes_up_pressure_where_the_load_stretches_the_muscle():
    plant = PLANTS["hanging"]
    state = find_equilibrium(plant, pressure=3e5)
    heavier = replace(plant, mechanism=HangingMass(25.0))
    found = find_equilibrium(heavier, air_mass=state["air_mass"])
    assert found["position"] < state["position"]
    assert heavier.outputs(found, {"fill": 0.0, "discharge": 0.0})["pressure"] > 3e5
    at_pressure = find_equilibrium(heavier, pressure=3e5)
    assert at_pressure["position"] < found["position"]


# The joint


@given(st.floats(1e5, 5e5))
@settings(max_examples=10, deadline=None)
def test_a_symmetric_joint_rests_at_zero(pressure):
    assert find_equilibrium(joint_plant(), pressure=pressure)["angle"] == pytest.approx(
        0.0, abs=1e-12
    )


@given(st.floats(1e5, 5e5), st.floats(1e5, 5e5))
@settings(max_examples=10, deadline=None)
def test_with_its_pressures_changed_over_it_rests_on_the_other_side(one, other):
    forward, back = (
        find_equilibrium(joint_plant(), pressure=p)["angle"] for p in ((one, other), (other, one))
    )
    assert forward == pytest.approx(-back, abs=1e-9)
    assert np.sign(round(forward, 9)) == np.sign(round(one - other, 3)) or abs(one - other) < 1.0


# Parallel and series


def test_two_equal_muscles_in_parallel_carry_twice_the_load():
    alone = find_equilibrium(Plant(LEFT, ClosedChamber(), HangingMass(10.0)), pressure=3e5)
    both = find_equilibrium(joint_plant(HangingMass(20.0)), pressure=3e5)
    assert both["position"] == pytest.approx(alone["position"], rel=1e-12)


def test_muscles_in_series_carry_the_same_load_over_the_sum_of_their_ways():
    single = find_equilibrium(Plant(LEFT, ClosedChamber(), HangingMass(10.0)), pressure=3e5)[
        "position"
    ]
    weak = find_equilibrium(Plant(LEFT, ClosedChamber(), HangingMass(10.0)), pressure=2e5)[
        "position"
    ]
    chain = joint_plant(MusclesInSeries(HangingMass(10.0), (0.5,), gravity=0.0))
    found = find_equilibrium(chain, pressure=(3e5, 2e5))
    assert found["node1.position"] == pytest.approx(single, rel=1e-9)
    assert found["position"] == pytest.approx(single + weak, rel=1e-9)


# All of them


@pytest.mark.parametrize("half", [2e-2, 1e-3, 1e-5, 1e-7])
@given(st.floats(0.0, 0.05))
@settings(max_examples=10, deadline=None)
def test_a_pair_of_rests_is_found_however_close(half, middle):
    plant = Plant(chosen_muscle(), ClosedChamber(), Bumpy(middle, half))
    found = find_equilibria(plant, pressure=1e5)
    assert [r.state["position"] for r in found] == pytest.approx(
        [middle - half, middle + half], abs=1e-10
    )
    assert [r.stable for r in found] == [True, False]


def test_no_pair_is_made_up_where_the_force_only_comes_near_zero():
    class Above(Bumpy):
        def acceleration(self, q, v, pulls, inputs):
            return {"position": (q["position"] - self.middle) ** 2 + self.half**2}

    assert (
        find_equilibria(Plant(chosen_muscle(), ClosedChamber(), Above(0.02, 1e-4)), pressure=1e5)
        == ()
    )


def statics_of(plant, pressure):
    compiled = compile_system(plant)
    return Statics.of_plants(
        compiled, compiled.parameters[None], (pressure,), np.zeros(len(plant.inputs))
    )


def test_a_rest_that_is_one_of_the_places_looked_at_is_found_once():
    class Towards(Bumpy):
        def acceleration(self, q, v, pulls, inputs):
            return {"position": self.middle - q["position"]}

    plant = Plant(chosen_muscle(), ClosedChamber(), Towards(0.0, 0.0))
    place = float(grid(statics_of(plant, 1e5))[0, 37])
    found = find_equilibria(replace(plant, mechanism=Towards(place, 0.0)), pressure=1e5)
    assert [r.state["position"] for r in found] == [place]


def test_of_a_stretch_in_balance_the_ends_are_given():
    class Flat(Bumpy):
        def acceleration(self, q, v, pulls, inputs):
            x = q["position"] - self.middle
            return {"position": ops.maximum(-self.half - x, 0.0) - ops.maximum(x - self.half, 0.0)}

    plant = Plant(chosen_muscle(), ClosedChamber(), Flat(0.02, 0.015))
    found = [r.state["position"] for r in find_equilibria(plant, pressure=1e5)]
    assert found == pytest.approx([0.005, 0.035], abs=np.diff(grid(statics_of(plant, 1e5)))[0, 0])
    assert find_equilibrium(plant, pressure=1e5)["position"] == found[0]


STANDING = replace(JOINT, weight_torque=-25.0)
"""A weight above the joint: its torque lies between what the muscles hold at constant pressure and
with shut valves.
"""


def test_a_joint_may_stand_with_shut_valves_that_falls_at_constant_pressure():
    plant = joint_plant(STANDING)
    (at_pressure,) = (
        r for r in find_equilibria(plant, pressure=2e5) if abs(r.state["angle"]) < 1e-9
    )
    air = tuple(at_pressure.state[f"{name}.air_mass"] for name in ("left", "right"))
    (shut,) = (r for r in find_equilibria(plant, air_mass=air) if abs(r.state["angle"]) < 1e-9)
    assert (at_pressure.stable, shut.stable) == (False, True)

    pushed = {**shut.state, "angle": 0.01}
    stands = simulate(plant, ZERO_INPUT, duration=10.0, initial_state=pushed)
    assert abs(stands["angle"][-1]) < 1e-3

    wide = FillDischarge(Supply(2e5), Valve(1e-6, 0.433), Valve(1e-6, 0.433))
    fed = replace(plant, circuit=(wide, wide))
    falls = simulate(
        fed,
        Schedule({"left.fill": ((0, 1),), "right.fill": ((0, 1),)}),
        duration=0.6,
        initial_state=pushed,
    )
    assert falls["angle"][-1] > 0.1


def test_between_stops_a_joint_that_falls_has_three_rests():
    stopped = JointWithEndStops(
        replace(JOINT, weight_torque=-60.0), -0.4, 0.4, 0.05, HuntCrossley(1e8)
    )
    found = find_equilibria(joint_plant(stopped), pressure=2e5)
    assert [r.stable for r in found] == [True, False, True]
    assert [r.state["angle"] for r in found] == pytest.approx([-0.4, 0.0, 0.4], abs=0.01)
    assert found[0].state["angle"] == pytest.approx(-found[2].state["angle"], abs=1e-9)


def test_of_two_stable_rests_the_one_nearer_to_full_length_is_taken():
    stopped = JointWithEndStops(
        replace(JOINT, weight_torque=-60.0), -0.4, 0.2, 0.05, HuntCrossley(1e8)
    )
    assert [r.stable for r in find_equilibria(joint_plant(stopped), pressure=2e5)] == [
        True,
        False,
        True,
    ]
    assert find_equilibrium(joint_plant(stopped), pressure=2e5)["angle"] == pytest.approx(
        0.2, abs=0.01
    )


# What is said where there is none


def test_the_failure_names_the_muscles_and_what_they_pull():
    with pytest.raises(
        EquilibriumError,
        match=r"left pulls [\d.]+ N at 200 kPa .*right pulls .* at 200 kPa.*rad/s2",
    ):
        find_equilibrium(joint_plant(replace(JOINT, weight_torque=-60.0)), pressure=2e5)
    with pytest.raises(
        EquilibriumError,
        match=(
            r"MusclesInSeries has no stable equilibrium: left pulls .*node1.position .* m/s2,"
            r" position"
        ),
    ):
        find_equilibrium(joint_plant(MusclesInSeries(HangingMass(900.0), (0.5,))), pressure=2e5)


def test_what_rests_anywhere_is_said_to():
    for mechanism in (PrescribedMotion(), WithLatch(HangingMass(5.0))):
        plant = Plant(chosen_muscle(), ClosedChamber(), mechanism)
        inputs = {"latched": 1.0} if plant.inputs == ("latched",) else None
        with pytest.raises(
            EquilibriumError,
            match=(
                r"is in equilibrium at every position.*plant.state_at\(pressure=..., position=...\)"
            ),
        ):
            find_equilibrium(plant, pressure=1e5, inputs=inputs)


def test_a_joint_whose_muscles_cannot_both_be_mounted_is_refused():
    with pytest.raises(
        GeometryLimitError, match="no position within the contraction limits of left, right"
    ):
        find_equilibrium(
            joint_plant(WithOffsets(replace(JOINT), (-0.6 + 0.12, -0.6 + 0.12))), pressure=1e5
        )


def test_air_that_no_pressure_holds_names_the_muscle():
    with pytest.raises(
        EquilibriumError, match=r"muscle cannot hold 10 kg of air at a contraction of 10.0 %"
    ):
        find_equilibrium(PLANTS["isometric"], air_mass=10.0)


@pytest.mark.parametrize(
    ("given_air", "message"),
    [
        ({}, "give either the pressure"),
        ({"pressure": 1e5, "air_mass": 1e-4}, "give either the pressure"),
        ({"pressure": (1e5, 1e5, 1e5)}, "pressure has 3 values; the plant has 2 muscles"),
        ({"air_mass": -1e-4}, "must be greater than 0"),
        ({"air_mass": float("nan")}, "must be a finite number in kg"),
        ({"pressure": b"3 bar"}, "must be a finite number in Pa"),
        ({"pressure": None, "air_mass": {}}, "must be a finite number in kg"),
        (
            {"pressure": {"left": 2e5, "right": 3e5}},
            "in Pa, or a tuple with the values of left, right",
        ),
        ({"pressure": -2e5}, "not above absolute vacuum"),
        ({"pressure": 1e5, "inputs": {"hold": 1.0}}, "no input 'hold'"),
    ],
)
def test_bad_input_is_refused(given_air, message):
    with pytest.raises(ParameterError, match=message):
        find_equilibrium(joint_plant(), **given_air)


def test_a_state_at_three_pressures_of_two_muscles_is_refused():
    with pytest.raises(ParameterError, match="3 pressures are given for 2 muscles"):
        joint_plant().state_at(pressure=(1e5, 1e5, 1e5))


def test_an_input_beyond_its_range_is_refused():
    valve = ProportionalValve(Supply(6e5), VALVE, VALVE, SecondOrderLag(80.0), muscle_count=2)
    with pytest.raises(ParameterError, match=r"the input 'command' is 2; allowed range: -1 to 1"):
        find_equilibrium(Plant((LEFT, RIGHT), valve, JOINT), pressure=1e5, inputs={"command": 2.0})


def test_states_and_equilibria_take_texts_with_a_unit_and_lists():
    plant = PLANTS["joint"]
    assert find_equilibrium(plant, pressure="2 bar") == find_equilibrium(plant, pressure=2e5)
    two = find_equilibrium(plant, pressure=(1e5, 2e5))
    assert find_equilibrium(plant, pressure=["1 bar", 2e5]) == two
    assert plant.state_at(pressure=["1 bar", "200 kPa"], angle="5 deg") == plant.state_at(
        pressure=(1e5, 2e5), angle=np.deg2rad(5.0)
    )
    one = PLANTS["isometric"]
    assert find_equilibrium(one, air_mass="0.1 g") == find_equilibrium(one, air_mass=1e-4)
    with pytest.raises(
        UnitError, match="find_equilibrium: pressure: unit 'N' cannot be converted to 'Pa'"
    ):
        find_equilibrium(one, pressure="3 N")
    with pytest.raises(
        UnitError, match="the angle of a state: unit 'mm' cannot be converted to 'rad'"
    ):
        plant.state_at(pressure=1e5, angle="5 mm")

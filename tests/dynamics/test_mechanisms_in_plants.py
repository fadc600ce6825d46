"""Mechanisms in plants: the energy book closes, a prescribed motion is followed, the joint is that
written by hand.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from joints import HEAT_CAPACITY, chosen_muscle, joint, joint_start
from widths import widened

from airmuscle.engine import (
    ZERO_INPUT,
    Rodas4,
    SampledSignal,
    Schedule,
    simulate,
    spline_trajectory,
)
from airmuscle.engine.compile import compile_system
from airmuscle.errors import ParameterError
from airmuscle.physics import (
    GAS_CONSTANT,
    AntagonisticJoint,
    ClosedChamber,
    DistributedTube,
    EnergyBalance,
    FillDischarge,
    HangingMass,
    HuntCrossley,
    Isothermal,
    Isotonic,
    JointWithEndStops,
    Lever,
    Manifold,
    MusclesInSeries,
    Plant,
    Polytropic,
    PrescribedMotion,
    ProportionalValve,
    Pulley,
    SecondOrderLag,
    SharedSupply,
    SpringLoad,
    Supply,
    ThreePositionValve,
    Tube,
    Valve,
    WithEndStops,
    WithEnergyMeters,
    WithOffsets,
    WithTubes,
    find_equilibrium,
)

LEFT, RIGHT = (replace(chosen_muscle(), name=name) for name in ("left", "right"))
VALVE = Valve(2.6e-8, 0.433)
CIRCUIT = FillDischarge(Supply(5e5), Valve(5e-9, 0.433), Valve(5e-9, 0.433))
JOINT = AntagonisticJoint(0.03, 0.05, 0.2, 2.0, 0.12)
LEVER = Lever((0.05, -0.05), 2.0, 0.3, 0.01, 0.3, (0.1, 0.1))
CONTACT = HuntCrossley(1e7, 0.4)
MECHANISMS = {
    "spring": SpringLoad(3.0, 2000.0, 20.0, 50.0),
    "isotonic": Isotonic(200.0, 2.0, 30.0),
    "pulley": Pulley(0.04, 30.0, 0.5, 0.02, 20.0),
    "parallel": WithOffsets(HangingMass(30.0), (0.0, 0.03)),
    "joint": JOINT,
    "lever": LEVER,
    "series": MusclesInSeries(HangingMass(12.0), (0.3,), 15.0),
    "series on a lever": MusclesInSeries(Lever((0.05,), 12.0, 0.1, 0.05, 0.3), (0.3,)),
    "stopped": WithEndStops(SpringLoad(3.0, 500.0, 5.0), -0.002, 0.02, CONTACT),
    "stopped joint": JointWithEndStops(JOINT, -0.1, 0.15, 0.05, CONTACT),
}


def pair(mechanism, gas=Polytropic(1.2), circuit=CIRCUIT):
    muscles = (LEFT, RIGHT)[: mechanism.muscle_count or 2]
    return Plant(muscles, (circuit,) * len(muscles), mechanism, gas)


OF_ONE_KIND = ("spring", "isotonic", "pulley", "lever", "series")
"""Their losses are the friction and damping of those that remain; the power of each is judged in
laws/test_mechanisms.
"""


@pytest.mark.parametrize("name", widened(MECHANISMS, lambda name: name not in OF_ONE_KIND))
def test_the_energy_book_closes_with_what_is_lost(name):
    """Fill one muscle, then the other, then let both out a little; at rtol 1e-9."""
    mechanism = MECHANISMS[name]
    plant = WithEnergyMeters(pair(mechanism))
    start = plant.extend_state(find_equilibrium(plant.plant, pressure=2e5))
    command = Schedule(
        {
            "left.fill": ((0.1, 1.0), (0.2, 0.0)),
            "right.fill": ((0.4, 1.0), (0.5, 0.0)),
            "left.discharge": ((0.9, 1.0), (0.94, 0.0)),
            "right.discharge": ((1.1, 1.0), (1.14, 0.0)),
        }
    )
    run = simulate(plant, command, duration=1.4, initial_state=start, integrator=Rodas4(1e-9))
    mechanical = run["kinetic_energy"] + run["potential_energy"]
    book = run["work_of_tension"] - run["mechanism_loss"]
    size = np.abs(run["work_of_tension"]).max()
    assert size > 0.3
    assert run["kinetic_energy"].max() > 1e-4 * size
    np.testing.assert_allclose(mechanical - mechanical[0], book, atol=1e-7 * size)
    assert (np.diff(run["mechanism_loss"]) >= -1e-9 * size).all()
    lossy = not isinstance(mechanism, WithOffsets)
    assert (run["mechanism_loss"][-1] > 1e-4 * size) == lossy


def test_stops_hold_between_their_ends_but_for_the_depth_of_the_contact():
    """At rest against the stop the contact carries what the muscle pulls beyond the spring."""
    plant = Plant(LEFT, CIRCUIT, MECHANISMS["stopped"])
    run = simulate(
        plant,
        Schedule({"fill": ((0.0, 1.0),)}),
        duration=3.0,
        initial_state=find_equilibrium(plant, pressure=0.0),
    )
    depth = run["position"][-1] - 0.02
    assert 0.0 < depth < 2e-3
    carried = run["force"][-1] - 500.0 * run["position"][-1]
    assert carried == pytest.approx(1e7 * depth**1.5, rel=1e-3)
    assert run["position"].max() < 0.025


# Prescribed motion


def test_a_prescribed_motion_is_followed_exactly():
    rng = np.random.default_rng(0)
    times = np.cumsum(rng.uniform(0.05, 0.4, 12))
    places = rng.uniform(0.0, 0.03, 12)
    motion = spline_trajectory(times, places)
    plant = Plant(chosen_muscle(), CIRCUIT, PrescribedMotion())
    start = plant.state_at(pressure=3e5, **motion.initial_state)
    run = simulate(
        plant,
        motion.input,
        duration=times[-1] - times[0],
        start_time=times[0],
        initial_state=start,
        output_times=times,
    )
    np.testing.assert_allclose(np.interp(times, run["time"], run["position"]), places, atol=1e-9)
    assert run["speed"][0] == 0.0
    assert run["speed"][-1] == pytest.approx(0.0, abs=1e-9)
    assert np.ptp(run["force"]) > 10.0


@given(st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4))
@settings(max_examples=10, deadline=None)
def test_a_cubic_that_does_not_begin_at_rest_is_itself(coefficients):
    cubic = np.polynomial.Polynomial(coefficients)
    times = np.array([0.0, 0.2, 0.5, 0.7, 1.0])
    motion = spline_trajectory(times, cubic(times), from_rest=False)
    assert motion.initial_state["speed"] == pytest.approx(cubic.deriv()(0.0), abs=1e-9)
    found = [value for _, value in motion.input.points["prescribed_acceleration"]]
    assert found == pytest.approx(cubic.deriv(2)(times), abs=1e-8)


def test_the_drive_takes_up_what_the_muscle_works():
    plant = WithEnergyMeters(Plant(chosen_muscle(), CIRCUIT, PrescribedMotion(), Isothermal()))
    motion = spline_trajectory([0.0, 0.5, 1.0], [0.0, 0.02, 0.005])
    command = SampledSignal({**motion.input.points, "fill": ((0.2, 0.0), (0.4, 0.5), (0.6, 0.0))})
    start = plant.extend_state(plant.plant.state_at(pressure=2e5, **motion.initial_state))
    run = simulate(plant, command, duration=1.0, initial_state=start, integrator=Rodas4(1e-10))
    np.testing.assert_allclose(run["mechanism_loss"], run["work_of_tension"], atol=1e-9)
    assert np.abs(run["work_of_tension"]).max() > 1.0


@pytest.mark.parametrize(
    ("times", "places", "settings", "message"),
    [
        ([0.0], [0.0], {}, "at least 2 times"),
        ([0.0, 1.0, 2.0], [0.0, 1.0, 0.0], {"from_rest": False}, "at least 4 times"),
        ([0.0, 1.0], [0.0], {}, "as many positions"),
        ([0.0, 1.0, 1.0], [0.0, 0.1, 0.2], {}, "times must rise; 1 s is followed by 1 s"),
        ([0.0, np.nan], [0.0, 0.1], {}, "must be finite"),
    ],
)
def test_points_that_are_no_motion_are_refused(times, places, settings, message):
    with pytest.raises(ParameterError, match=message):
        spline_trajectory(times, places, **settings)


# The joint


TUBE = Tube(Valve(4e-8, 0.433), 2e-5)
BY_HAND = {
    "speed": "angular_speed",
    "air_mass": "air_mass",
    "tube_mass": "tube.air_mass",
    "energy": "internal_energy",
}


def of_plant(state):
    """A state of the joint that is written by hand, by the plant's names; a spool is no state of
    the plant.
    """
    found = {}
    for name, value in state.items():
        side, _, kind = name.rpartition(".")
        if kind != "spool":
            found[f"{side}.{BY_HAND[kind]}" if side else BY_HAND.get(name, name)] = value
    return found


def random_state(system, rng):
    start = joint_start(system)
    moved = {n: v * rng.uniform(0.7, 1.5) for n, v in start.items()}
    return moved | {"angle": rng.uniform(-0.3, 0.3), "speed": rng.uniform(-2.0, 2.0)}


def test_the_joint_of_a_plant_is_the_joint_written_by_hand():
    system = joint()
    plant = pair(JOINT, Isothermal(), WithTubes(FillDischarge(Supply(6e5), VALVE, VALVE), TUBE))
    rng = np.random.default_rng(1)
    for _ in range(50):
        state = random_state(system, rng)
        inputs = {name: rng.uniform() for name in system.inputs}
        assert plant.inputs == system.inputs
        expected = of_plant(system.rates(state, inputs))
        found = plant.rates(of_plant(state), inputs)
        assert found == pytest.approx(expected, rel=1e-11, abs=1e-14)

    command = Schedule(
        {"left.fill": ((0.1, 1.0), (0.4, 0.0)), "right.discharge": ((0.2, 1.0), (0.5, 0.0))}
    )
    method = Rodas4(1e-9)
    start = joint_start(system)
    by_hand = simulate(system, command, duration=1.5, initial_state=start, integrator=method)
    run = simulate(plant, command, duration=1.5, initial_state=of_plant(start), integrator=method)
    assert np.ptp(run["angle"]) > 0.2
    np.testing.assert_allclose(run["angle"], by_hand["angle"], atol=1e-7)
    np.testing.assert_allclose(run["left.tube.air_mass"], by_hand["left.tube_mass"], rtol=1e-6)


def test_with_heat_it_is_too_but_that_air_that_leaves_a_muscle_flows_at_its_own_temperature():
    """By hand every orifice passes air as if it were as warm as the surroundings; in a plant as
    warm as it is.

    So a muscle that loses air loses sqrt(T_amb/T) times as much, and all else is equal. The spool
    by hand lags by one time constant; here its place is given.
    """
    system = joint(heat=True)
    valve = ThreePositionValve(Supply(6e5), VALVE, VALVE)
    plant = pair(JOINT, EnergyBalance(1.0), WithTubes(valve, TUBE))
    rng = np.random.default_rng(2)
    directions = set()
    for _ in range(50):
        state = random_state(system, rng)
        state |= {f"{side}.spool": rng.uniform(-1.0, 1.0) for side in ("left", "right")}
        expected = system.rates(state, dict.fromkeys(system.inputs, 0.0))
        places = {
            name: state[f"{side}.spool"]
            for name, side in zip(plant.inputs, ("left", "right"), strict=True)
        }
        found = plant.rates(of_plant(state), places)
        assert found["angular_speed"] == pytest.approx(expected["speed"], rel=1e-11)
        for side in ("left", "right"):
            leaving = expected[f"{side}.air_mass"] < 0
            directions.add(leaving)
            temperature = state[f"{side}.energy"] / (state[f"{side}.air_mass"] * HEAT_CAPACITY)
            factor = np.sqrt(293.15 / temperature) if leaving else 1.0
            flow = expected[f"{side}.air_mass"]
            assert found[f"{side}.air_mass"] == pytest.approx(factor * flow, rel=1e-11)
            assert found[f"{side}.tube.air_mass"] == pytest.approx(
                expected[f"{side}.tube_mass"] + (1 - factor) * flow, rel=1e-9, abs=1e-15
            )
            more = (factor - 1) * flow * (HEAT_CAPACITY + GAS_CONSTANT) * temperature
            assert found[f"{side}.internal_energy"] == pytest.approx(
                expected[f"{side}.energy"] + more, rel=1e-9
            )
    assert directions == {True, False}


def test_the_tubes_of_one_circuit_for_all_are_called_by_their_muscles():
    """Each tube belongs to a muscle, whose name it carries as it does where every muscle has a
    circuit of its own.
    """
    valve = ProportionalValve(Supply(6e5), VALVE, VALVE, SecondOrderLag(80.0), muscle_count=2)
    plant = Plant((LEFT, RIGHT), WithTubes(valve, Tube(VALVE, 1e-5, 2)), JOINT, Isothermal())
    of_tubes = [s.name for s in plant.states if "tube" in s.name]
    assert of_tubes == [f"{side}.tube{i}.air_mass" for side in ("left", "right") for i in (1, 2)]
    start = plant.state_at(pressure=(2e5, 3e5))
    assert start["left.tube1.air_mass"] / start["right.tube1.air_mass"] == pytest.approx(
        301.325 / 401.325
    )
    run = simulate(plant, Schedule({"command": ((0.0, 1.0),)}), duration=0.02, initial_state=start)
    assert (
        run["left.tube1.pressure"][-1]
        > run["left.tube2.pressure"][-1]
        > run["left.pressure"][-1]
        > 2e5
    )
    assert (
        run["right.tube1.pressure"][-1]
        < run["right.tube2.pressure"][-1]
        < run["right.pressure"][-1]
    )


@pytest.mark.parametrize("nested", [False, True], ids=["one circuit", "manifold"])
def test_a_run_says_where_air_ran_too_fast_for_a_distributed_tube(nested):
    """A wide valve before a long narrow tube into an empty muscle: beyond a third of the speed of
    sound, in one.
    """
    tube = DistributedTube(0.5, 2e-3, 3)
    wide = Valve(1e-7, 0.4)
    narrow = Valve(1e-10, 0.4)
    feeds = [
        WithTubes(FillDischarge(SharedSupply() if nested else Supply(6e5), v, v), tube)
        for v in (wide, narrow)
    ]
    circuit = Manifold(Supply(6e5), tuple(feeds), ("left", "right")) if nested else tuple(feeds)
    plant = Plant((LEFT, RIGHT), circuit, JOINT, Isothermal())
    command = Schedule({"left.fill": ((0.0, 1.0),), "right.fill": ((0.0, 1.0),)})
    found = simulate(
        plant,
        command,
        duration=0.02,
        initial_state=plant.state_at(pressure=0.0),
        integrator=Rodas4(1e-5),
    )
    doubts = [note for note in found.notes if "Mach number" in note]
    assert {note.partition(":")[0] for note in doubts} <= {f"left.tube{i}" for i in (1, 2, 3)}
    speeds = {
        i: (
            found[f"left.tube{i}.flow"]
            * GAS_CONSTANT
            * 293.15
            / (tube.area * (found[f"left.tube{i}.pressure"] + 101325))
        )
        for i in (1, 2, 3)
    }
    greatest = {
        i: float(abs(speed).max() / np.sqrt(GAS_CONSTANT * 293.15)) for i, speed in speeds.items()
    }
    assert len(doubts) == sum(share > 1 / 3 for share in greatest.values()) > 0
    assert f"the Mach number reached {greatest[3]:.2g}" in doubts[-1]
    still = simulate(plant, ZERO_INPUT, duration=0.02, initial_state=plant.state_at(pressure=0.0))
    assert not [note for note in still.notes if "Mach number" in note]


def test_two_tubes_of_one_name_are_refused():
    with pytest.raises(ParameterError, match=r"two of its parts use the name 'left.tube.air_mass'"):
        pair(
            JOINT,
            Isothermal(),
            WithTubes(WithTubes(ThreePositionValve(Supply(6e5), VALVE, VALVE), TUBE), TUBE),
        )


def test_one_five_port_valve_turns_a_joint_to_either_side():
    """Its command fills one muscle and discharges the other; changed over, the joint mirrors its
    motion.
    """
    valve = ProportionalValve(
        Supply(6e5),
        Valve(2.6e-9, 0.433),
        Valve(2.6e-9, 0.433),
        SecondOrderLag(80.0),
        0.05,
        muscle_count=2,
    )
    plant = Plant((LEFT, RIGHT), valve, JOINT, EnergyBalance(0.5))
    start = find_equilibrium(plant, pressure=2.5e5)
    runs = [
        simulate(
            plant,
            Schedule({"command": ((0.1, sign), (0.25, 0.0))}),
            duration=2.0,
            initial_state=start,
            integrator=Rodas4(1e-9),
        )
        for sign in (0.6, -0.6)
    ]
    assert runs[0]["angle"][-1] > 0.1
    assert abs(runs[0]["angular_speed"][-1]) < 0.05
    np.testing.assert_allclose(runs[1]["angle"], -runs[0]["angle"], atol=1e-6)
    np.testing.assert_allclose(runs[1]["left.pressure"], runs[0]["right.pressure"], rtol=1e-5)
    assert runs[0]["left.pressure"][-1] > 2.5e5 > runs[0]["right.pressure"][-1]


# Several muscles


def test_muscles_in_parallel_pull_as_one_with_the_sum_of_their_tensions():
    both = pair(WithOffsets(HangingMass(20.0), (0.0, 0.05)), circuit=ClosedChamber())
    state = both.state_at(pressure=(2e5, 3e5), position=0.01)
    expected = LEFT.tension(2e5, 0.05) + RIGHT.tension(3e5, 0.10)
    rates = compile_system(both).rates(list(state.values()), [])
    assert rates[list(state).index("speed")] == pytest.approx(expected / 20.0 - 9.80665, rel=1e-12)


def test_a_chain_of_equal_muscles_swings_as_one_of_their_length():
    """With a light node between them; both carry the same tension, and each takes half of the
    way.
    """
    chain = pair(MusclesInSeries(HangingMass(20.0), (1e-3,)), Isothermal(), ClosedChamber())
    start = find_equilibrium(chain, pressure=3e5)
    run = simulate(
        chain,
        ZERO_INPUT,
        duration=0.5,
        initial_state={**start, "speed": 0.2, "node1.speed": 0.1},
        integrator=Rodas4(1e-9),
    )
    assert np.ptp(run["position"]) > 5e-3
    np.testing.assert_allclose(run["left.force"], run["right.force"], atol=0.05)
    np.testing.assert_allclose(2 * run["node1.position"], run["position"], atol=2e-5)

"""Statics of a joint: two equations for two pressures, and their inverse.

Q_1(theta, p_1) + Q_2(theta, p_2) = dV/dtheta + load,   K_1 + K_2 = K with K_i = -dQ_i/dtheta at
                                                        constant pressure
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

import airmuscle as am
from airmuscle.errors import ColumnError, ParameterError, SolveError
from airmuscle.physics import (
    AntagonisticJoint,
    Clamped,
    ContractileSurface,
    CrankProfile,
    EnergyBalance,
    HangingMass,
    HuntCrossley,
    Isothermal,
    JointWithEndStops,
    LinearSpring,
    Plant,
    Polytropic,
    SeriesSpring,
    SwellingWall,
    VirtualWork,
    WithLatch,
    find_equilibria,
    find_equilibrium,
    joint_statics,
    plot_reachable_region,
    stiffness,
)
from airmuscle.physics.muscle.characteristic import exponents

DMSP = am.load("dmsp-20-300").muscle
BRAID = am.geometry.Braid(0.01, 0.4363, 0.3)
JOINT = AntagonisticJoint(0.04, 0.05, 0.2, 2.0, 0.11, min_angle=-1.0, max_angle=1.0)
SHAPED = replace(JOINT, profile=CrankProfile(0.2), weight_angle=0.5)
VALVE = am.Valve(2.6e-9, 0.433)
CIRCUIT = am.FillDischarge(am.Supply(6e5), VALVE, VALVE)
QUADRATIC = ContractileSurface(
    (300.0, -200.0, 40.0, 250.0, -60.0, 30.0), 0.0, 6e5, 0.0, 0.25, 0.0, 1500.0, 2
)
MUSCLES = {
    "affine": DMSP,
    "affine with a spring": am.Muscle(VirtualWork(BRAID), BRAID, LinearSpring(2000.0)),
    "quadratic": am.Muscle(QUADRATIC, BRAID),
}


def pair(muscle=DMSP, mechanism=JOINT, gas=Polytropic()):
    return Plant(
        (replace(muscle, name="left"), replace(muscle, name="right")),
        (CIRCUIT, CIRCUIT),
        mechanism,
        gas,
    )


def reachable(statics, count, load, seed=0):
    """Random angles, and stiffnesses within the middle of the reachable range."""
    rng = np.random.default_rng(seed)
    angle = rng.uniform(-0.4, 0.4, count)
    low, high = statics.stiffness_limits(angle, load)
    assert np.isfinite(low).all()
    return angle, low + rng.uniform(0.1, 0.9, count) * (high - low)


@pytest.mark.parametrize("mechanism", [JOINT, SHAPED], ids=["round", "shaped"])
@pytest.mark.parametrize("muscle", MUSCLES.values(), ids=MUSCLES)
def test_pressures_for_angle_and_stiffness_give_them_back_to_1e_9(muscle, mechanism):
    statics = joint_statics(pair(muscle, mechanism))
    angle, wanted = reachable(statics, 25, 1.0)
    points = statics.pressures(angle, wanted, 1.0)
    assert (points.count >= 1).all()
    np.testing.assert_allclose(points.constant_pressure[:, 0], wanted, rtol=1e-9)
    back = statics.angles((points.pressures[:, 0, 0], points.pressures[:, 0, 1]), 1.0)
    nearest = np.nanargmin(np.abs(back.angle - angle[:, None]), axis=1)
    rows = np.arange(angle.size)
    np.testing.assert_allclose(back.angle[rows, nearest], angle, atol=1e-9)
    np.testing.assert_allclose(back.constant_pressure[rows, nearest], wanted, rtol=1e-9)


@pytest.mark.parametrize("swapped", [False, True])
def test_two_muscles_of_different_laws_have_the_angle_and_the_stiffness_of_the_inverse(swapped):
    """One law is affine in the pressure and the other is not, so that there is no closed form."""
    muscles = (MUSCLES["quadratic"], DMSP) if swapped else (DMSP, MUSCLES["quadratic"])
    left, right = (
        replace(muscle, name=name) for muscle, name in zip(muscles, ("left", "right"), strict=True)
    )
    statics = joint_statics(replace(pair(mechanism=SHAPED), muscle=(left, right)))
    assert [function.affine for function in statics.unlimited] == [not swapped, swapped]
    angle, wanted = reachable(statics, 10, 1.0)
    points = statics.pressures(angle, wanted, 1.0)
    first, second = points.pressures[:, 0].T
    torques = [
        f(angle, p, "torque", "stiffness")
        for f, p in zip(statics.torques, (first, second), strict=True)
    ]
    np.testing.assert_allclose(torques[0][1] + torques[1][1], wanted, rtol=1e-9)
    np.testing.assert_allclose(
        torques[0][0] + torques[1][0], statics.load(angle)[0] + 1.0, atol=1e-9
    )


@pytest.mark.parametrize(
    ("plant", "affine", "bound"),
    [(pair(), True, 15e-3), (am.load("joint-sam-30x290").plant, False, 25e-3)],
    ids=["affine", "SAM of the library"],
)
def test_a_thousand_points_of_the_inverse_take_a_few_milliseconds(plant, affine, bound):
    """To 1e-9. The target on a quiet machine is 5 ms of CPU time; the bounds allow for other
    processes.
    """
    statics = joint_statics(plant)
    assert [function.affine for function in statics.unlimited] == [affine, affine]
    angle, wanted = reachable(statics, 1000, 0.0)
    times = []
    for _ in range(11):
        start = time.thread_time()
        points = statics.pressures(angle, wanted)
        times.append(time.thread_time() - start)
    assert (points.count == 1).all()
    np.testing.assert_allclose(points.constant_pressure[:, 0], wanted, rtol=1e-9)
    assert min(times) < bound


@pytest.mark.parametrize(
    "gas", [Polytropic(1.3), Isothermal(), EnergyBalance(0.5)], ids=lambda gas: type(gas).__name__
)
@pytest.mark.parametrize(
    "muscle", [*MUSCLES.values(), replace(DMSP, wall=SwellingWall(4e-5, 2e5, 3e4, 0.05))]
)
def test_both_stiffnesses_are_those_of_the_plant(muscle, gas):
    plant = pair(muscle, SHAPED, gas)
    statics = joint_statics(plant)
    points = statics.angles((3e5, 2.5e5), 0.5)
    state = plant.state_at(pressure=(3e5, 2.5e5), angle=float(points.angle[0, 0]))
    both = stiffness(plant, state).coordinates["angle"]
    assert points.constant_pressure[0, 0] == pytest.approx(both.constant_pressure, rel=1e-10)
    assert points.shut_valves[0, 0] == pytest.approx(both.shut_valves, rel=1e-10)
    assert points.shut_valves[0, 0] > points.constant_pressure[0, 0]


def test_angles_are_the_equilibria_of_the_plant():
    plant = pair(mechanism=WithLatch(SHAPED))
    points = joint_statics(plant).angles((3e5, 2e5))
    found = find_equilibria(plant, pressure=(3e5, 2e5))
    assert points.angle[0].tolist() == pytest.approx([e.state["angle"] for e in found], abs=1e-9)
    assert points.stable[0].tolist() == [float(e.stable) for e in found]


def test_an_inverted_pendulum_with_soft_muscles_has_an_unstable_equilibrium_between_two_stable_ones():
    inverted = replace(JOINT, weight_torque=-20.0)
    plant = pair(mechanism=inverted)
    points = joint_statics(plant).angles((1.2e5, 1.2e5))
    assert points.stable[0].tolist() == [1.0, 0.0, 1.0]
    assert points.angle[0] == pytest.approx(-points.angle[0][::-1], abs=1e-12)


def test_a_symmetric_joint_at_angle_zero_needs_equal_pressures_and_mirrored_ones_elsewhere():
    statics = joint_statics(pair())
    points = statics.pressures([0.0, 0.3, -0.3], 35.0)
    first = points.pressures[:, 0, 0]
    second = points.pressures[:, 0, 1]
    assert first[0] == pytest.approx(second[0], rel=1e-12)
    assert (first[1], second[1]) == pytest.approx((second[2], first[2]), rel=1e-12)
    assert first[1] > second[1]


def test_a_load_is_carried_by_the_difference_of_the_torques():
    statics = joint_statics(pair())
    points = statics.pressures(0.2, 35.0, 4.0)
    left, right = points.tensions[0, 0]
    assert 0.04 * (left - right) == pytest.approx(4.0 + 2.0 * np.sin(0.2), rel=1e-12)
    assert points.cocontraction[0, 0] == pytest.approx(0.04 * right, rel=1e-12)


def test_a_law_whose_stiffness_falls_again_with_pressure_has_two_solutions_and_both_are_found():
    """A cubic law with a term x q^2: the stiffness of a symmetric joint has a maximum over the
    co-contraction.
    """
    powers = dict.fromkeys(exponents(3), 0.0) | {
        (0, 0): 700.0,
        (1, 0): -350.0,
        (0, 1): 400.0,
        (1, 1): -60.0,
        (1, 2): 150.0,
    }
    law = ContractileSurface(tuple(powers.values()), 0.0, 6e5, 0.0, 0.25, 0.0, 1e4, 3)
    statics = joint_statics(pair(am.Muscle(law, BRAID), replace(JOINT, weight_torque=0.0)))
    levels = np.linspace(0.4e5, 5.6e5, 24)
    wanted = statics.angles((levels, levels)).constant_pressure[:, 0]
    points = statics.pressures(np.zeros(24), wanted)
    assert points.count.max() >= 2
    for row in range(24):
        own = points.pressures[row][np.isfinite(points.pressures[row, :, 0])]
        assert np.abs(own - levels[row]).max(axis=1).min() < 1.0, row
        np.testing.assert_allclose(
            points.constant_pressure[row][: len(own)], wanted[row], rtol=1e-9
        )


def test_the_search_in_cells_agrees_with_the_closed_form():
    """A clamp with limits that are never reached makes an affine law formally nonlinear."""
    smooth, clamped = (
        joint_statics(pair(am.Muscle(law, BRAID)))
        for law in (VirtualWork(BRAID), Clamped(VirtualWork(BRAID), 0.0, 1e5))
    )
    clamped = replace(clamped, unlimited=clamped.torques)
    angle, wanted = reachable(smooth, 50, 0.0)
    expected = smooth.pressures(angle, wanted).pressures
    found = clamped.pressures(angle, wanted).pressures
    np.testing.assert_allclose(found[:, :1], expected, rtol=1e-10)
    assert np.isnan(found[:, 1:]).all()


# What is not reachable


def test_just_beyond_the_reachable_stiffness_there_is_no_solution_and_the_reason_states_the_range():
    statics = joint_statics(pair())
    (low,), (high,) = statics.stiffness_limits(0.1, 0.0)
    assert statics.pressures(0.1, [low * 1.0001, high * 0.9999]).count.tolist() == [1, 1]
    assert statics.pressures(0.1, [low * 0.9999, high * 1.0001]).count.tolist() == [0, 0]
    with pytest.raises(
        SolveError,
        match=rf"allowed range at pressures of 0 to 600 kPa: {low:.4g} to {high:.4g} N m/rad",
    ):
        statics.check_reachable(0.1, 500.0)
    assert statics.check_reachable(0.1, 0.5 * (low + high)).count == 1


def test_a_load_that_no_pressures_carry_is_explained_by_the_range_of_the_load():
    statics = joint_statics(pair())
    (low,), (high,) = statics.torque_limits(0.1)
    assert np.isnan(statics.stiffness_limits(0.1, high + 0.1)[0])
    assert np.isfinite(statics.stiffness_limits(0.1, high - 0.5)[0])
    with pytest.raises(SolveError, match=f"range of the load .*{low:.4g} to {high:.4g} N m"):
        statics.check_reachable([0.1, 0.1], 35.0, [0.0, 200.0])


def test_the_supply_bounds_the_pressures_unless_a_range_is_given():
    assert joint_statics(pair()).pressure_range == (0.0, pytest.approx(6e5))
    assert joint_statics(pair(), (1e4, 4e5)).pressure_range == (1e4, 4e5)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (
            lambda: joint_statics(Plant(DMSP, CIRCUIT, HangingMass(5.0))),
            "one angle and two muscles are required",
        ),
        (lambda: joint_statics(pair(), (5e5, 1e5)), "pressure_range is 500000 to 100000 Pa"),
        (lambda: joint_statics(pair()).pressures(np.nan, 30.0), "must be finite"),
        (lambda: joint_statics(pair()).pressures([0.0, 0.1], [30.0, 30.0, 30.0]), "of one length"),
        (lambda: joint_statics(pair()).pressures("a", 30.0), "must be numbers"),
        (
            lambda: joint_statics(
                pair(replace(DMSP, damper=am.LinearDamper(100.0), series=SeriesSpring(1e5)))
            ),
            "left has a series spring",
        ),
        (
            lambda: joint_statics(pair(mechanism=replace(JOINT, offset=0.9))).angles((1e5, 1e5)),
            "there is no angle",
        ),
    ],
)
def test_what_is_no_joint_is_refused(build, message):
    with pytest.raises(ParameterError, match=message):
        build()


def test_end_stops_carry_what_the_muscles_pull_beyond_them():
    stopped = JointWithEndStops(JOINT, -0.1, 0.1, 0.05, HuntCrossley(1e9))
    free, held = (
        joint_statics(pair(mechanism=m)).angles((5e5, 1e5)).angle[0] for m in (JOINT, stopped)
    )
    assert free[0] > 0.4
    assert held.tolist() == pytest.approx([0.1], abs=5e-3)


# Recordings and the figure


def test_a_recording_gains_torque_stiffness_and_cocontraction():
    """In the slow part of a run the torque carries the weight, and the stiffnesses are those of the
    plant.
    """
    plant = pair()
    statics = joint_statics(plant)
    start = find_equilibrium(plant, pressure=(3e5, 2.5e5))
    command = am.Schedule({"left.fill": ((0.1, 1.0), (0.2, 0.0))})
    run = statics.with_columns(am.simulate(plant, command, duration=3.0, initial_state=start))
    weight = 2.0 * np.sin(run["angle"])
    inertial = 0.05 * run["angular_acceleration"] + 0.2 * run["angular_speed"]
    np.testing.assert_allclose(run["torque"], weight + inertial, atol=1e-9)
    smaller = 0.04 * np.minimum(run["left.force"], run["right.force"])
    np.testing.assert_allclose(run["cocontraction"], smaller, rtol=1e-12)
    state = {s.name: float(run[s.name][-1]) for s in plant.states}
    both = stiffness(plant, state).coordinates["angle"]
    assert run["stiffness"][-1] == pytest.approx(both.constant_pressure, rel=1e-9)
    assert run["shut_valves_stiffness"][-1] == pytest.approx(both.shut_valves, rel=1e-9)
    with pytest.raises(ColumnError, match=r"left\.pressure"):
        statics.with_columns(
            am.Recording({"time": np.zeros(2), "angle": np.zeros(2)}, origin="made")
        )


def test_the_figure_shows_the_limits_of_the_stiffness_and_contours_of_stiffness_and_angle():
    statics = joint_statics(pair())
    region, plane = plot_reachable_region(statics, 1.0).axes
    low, high = statics.stiffness_limits(np.radians(region.lines[0].get_xdata()), 1.0)
    np.testing.assert_allclose(region.lines[0].get_ydata(), low)
    np.testing.assert_allclose(region.lines[1].get_ydata(), high)
    assert plane.get_xlabel() == "pressure of left [bar]"
    assert len(plane.collections) == 2
    assert plane.texts

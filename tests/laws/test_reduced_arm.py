"""An arm of unknown size: reduced forces, links in space and stick-slip, driven by pressures.

F = S(p a + d),   d/dt dT/dv - dT/dq + dV/dq = Q,   power of friction + growth of bristle energy <=
                  0
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from joints import chosen_muscle

from airmuscle.engine import RungeKutta4, SampledSignal, simulate
from airmuscle.errors import ParameterError
from airmuscle.physics import (
    AntagonisticJoint,
    ArmLink,
    Braid,
    FillDischarge,
    HangingMass,
    LinearInPressure,
    Muscle,
    MuscleRoute,
    PlanarArm,
    Plant,
    PressureDriven,
    SerialArm,
    SpatialLink,
    StickSlip,
    Supply,
    Valve,
    VirtualWork,
    WithStickSlip,
)

BRAID = Braid(0.01, 0.4363, 0.2)
PAIR = (MuscleRoute((1,), (0.03,), 0.1), MuscleRoute((2,), (-0.03,), 0.1))
ARM = SerialArm(
    (
        SpatialLink((0, 0, 1), rotor_inertia=0.02, damping=0.1),
        SpatialLink((0, -1, 0), (0.05, 0.0, 0.1), 1.5, (0.14, 0.02, -0.01), 0.012, 0.003, 0.2, 0.3),
        SpatialLink((1, 0, 0), (0.3, 0.0, 0.0), 0.8, (0.05, 0.06, 0.02), 0.004, 0.001, 0.05, -0.2),
    ),
    PAIR,
)
SLIP = StickSlip(2.0, (0.01, 0.02), 0.0, 1.0, 0.004)
angles = st.floats(-2.0, 2.0)
speeds = st.floats(-4.0, 4.0)
three = st.tuples


def place(q):
    return {f"joint{i}.angle": x for i, x in enumerate(q, start=1)}


def motion(v):
    return {f"joint{i}.angular_speed": x for i, x in enumerate(v, start=1)}


# The reduced law


@given(pressure=st.floats(0.0, 6e5), contraction=st.floats(-0.05, 0.2))
def test_the_law_of_a_braid_is_a_reduced_law_with_an_area_of_degree_two(pressure, contraction):
    tangent = np.tan(0.4363)
    sine = np.sin(0.4363)
    a = 3.0 / tangent**2
    b = 1.0 / sine**2
    section = np.pi * 0.01**2
    law = LinearInPressure((section * (a - b), -2 * section * a, section * a), (0.0,), 1e-6)
    known = VirtualWork(BRAID).force(pressure, contraction)
    assert law.force(pressure, contraction) == pytest.approx(known, rel=1e-9, abs=1e-5)


@given(pressure=st.floats(-1e5, 6e5), contraction=st.floats(-0.1, 0.3))
def test_a_reduced_muscle_never_pushes_and_is_slack_over_its_width(pressure, contraction):
    law = LinearInPressure((5e-4, -2e-3), (-20.0,), 3.0, 0.05)
    net = pressure * (5e-4 - 2e-3 * (contraction - 0.05)) - 20.0
    assert law.force(pressure, contraction) >= 0.0
    assert 0.0 <= law.force(pressure, contraction) - max(net, 0.0) <= 1.5 + 1e-9


def test_a_reduced_law_without_coefficients_is_refused():
    with pytest.raises(
        ParameterError, match="area and passive_force need at least one coefficient each"
    ):
        LinearInPressure(())


# Links in space


@given(q=three(angles, angles), v=three(speeds, speeds), torques=three(speeds, speeds))
def test_links_about_parallel_axes_are_a_planar_arm(q, v, torques):
    upper = ArmLink(0.3, 1.5, 0.14, 0.012, 0.1)
    lower = ArmLink(0.25, 1.1, 0.11, 0.006, 0.2)
    links = (
        SpatialLink((0, 1, 0), (0, 0, 0), 1.5, (0, 0, -0.14), 0.012, 0.0, 0.1),
        SpatialLink((0, 1, 0), (0, 0, -0.3), 1.1, (0, 0, -0.11), 0.006, 0.0, 0.2),
    )
    forces = {"joint1.angle": torques[0], "joint2.angle": torques[1]}
    known = PlanarArm((upper, lower), PAIR).acceleration(place(q), motion(v), forces, {})
    found = SerialArm(links, PAIR).acceleration(place(q), motion(v), forces, {})
    assert [*found.values()] == pytest.approx([*known.values()], rel=1e-9, abs=1e-9)


@given(
    q=three(angles, angles, angles),
    v=three(speeds, speeds, speeds),
    a=three(speeds, speeds, speeds),
)
def test_an_arm_in_space_obeys_lagranges_equations(q, v, a):
    """The momenta M v are differentiated along the motion, the energies across it, both by central
    differences.
    """
    q, v, a, step, names = np.array(q), np.array(v), np.array(a), 1e-5, place((0, 0, 0))
    momentum = lambda s: np.array(ARM.mass_matrix(place(q + s * v + 0.5 * s * s * a))) @ (v + s * a)  # noqa: E731
    change = (momentum(step) - momentum(-step)) / (2 * step)
    lagrangian = lambda x: ARM.kinetic_energy(place(x), motion(v)) - ARM.potential_energy(place(x))  # noqa: E731
    slopes = [(lagrangian(q + step * e) - lagrangian(q - step * e)) / (2 * step) for e in np.eye(3)]
    damping = np.array([link.damping for link in ARM.links])
    torques = ARM.inverse_dynamics(place(q), motion(v), dict(zip(names, a, strict=True)))
    np.testing.assert_allclose([*torques.values()], change - slopes + damping * v, atol=2e-6)
    back = ARM.acceleration(place(q), motion(v), torques, {})
    np.testing.assert_allclose([*back.values()], a, atol=1e-9)


@given(q=three(angles, angles, angles))
def test_the_mass_matrix_in_space_is_symmetric_and_positive_definite(q):
    matrix = np.array(ARM.mass_matrix(place(q)))
    np.testing.assert_allclose(matrix, matrix.T, rtol=1e-12, atol=1e-15)
    assert np.linalg.eigvalsh(matrix).min() > 1e-4


@given(q=three(angles, angles, angles), v=three(speeds, speeds, speeds))
def test_tensions_do_the_work_of_the_shortening(q, v):
    """Virtual work: sum F_i dL_i = sum Q_k dtheta_k."""
    tensions = (300.0, 120.0)
    lengths = (0.2, 0.2)
    forces = ARM.generalised_forces(place(q), tensions, lengths)
    rates = ARM.contraction_speeds(place(q), motion(v), lengths)
    power = sum(forces[c.name] * w for c, w in zip(ARM.coordinates, v, strict=True))
    assert power == pytest.approx(
        sum(f * r for f, r in zip(tensions, rates, strict=True)), abs=1e-9
    )


# Friction that holds at rest


@given(bristle=st.floats(-1.0, 1.0), speed=st.floats(-30.0, 30.0), load=st.floats(0.0, 50.0))
def test_friction_that_sticks_is_passive(bristle, speed, load):
    """The power of the friction and the growth of the energy of its bristle never have a positive
    sum.
    """
    power = SLIP.torque(bristle, load, speed) * speed
    stored = (
        SLIP.level(load, speed)
        * SLIP.presliding_angle
        * bristle
        * SLIP.bristle_rate(bristle, speed)
    )
    assert power + stored <= 1e-9
    assert abs(bristle) < 1.0 or bristle * SLIP.bristle_rate(bristle, speed) <= 0.0


def joint_on(torque, element=SLIP):
    """Angle of a joint without weight at a constant torque of two muscles, after 2 s."""
    lever = AntagonisticJoint(0.03, 0.05, 0.2)
    law = LinearInPressure((1e-3,), (0.0,), 1e-6)
    pair = tuple(Muscle(law, BRAID, name=n) for n in "ab")
    driven = PressureDriven(pair, WithStickSlip(lever, (element,)), (0.02, 0.02))
    start = driven.state_at((1e5 + torque / 3e-5, 1e5))
    pressures = {"a.measured_pressure": 1e5 + torque / 3e-5, "b.measured_pressure": 1e5}
    held = SampledSignal({name: [(0.0, p)] for name, p in pressures.items()})
    return simulate(driven, held, duration=2.0, initial_state=start, integrator=RungeKutta4(1e-3))[
        "angle"
    ]


def test_a_joint_holds_below_its_friction_and_slides_above_it():
    """The level is 2 N m and the load of the two tendons, 0.01 x 100 N and 0.02 x 100 N and their
    growth.
    """
    unloaded = replace(SLIP, load_arms=())
    assert abs(joint_on(1.9, unloaded)[-1]) < 0.004 * 20.0
    assert joint_on(2.2, unloaded)[-1] > 1.0
    assert abs(joint_on(2.2)[-1]) < 0.004


BEAM = SerialArm(
    (
        SpatialLink((0, 0, 1), rotor_inertia=0.02),
        SpatialLink((1, 0, 0), (0.3, 0.0, 0.0), 1.5, (0.1, 0.0, 0.0), 0.01, 0.02),
    ),
    PAIR,
)
"""A link whose centre of mass is on its axis, 0.4 m from the vertical axis of the joint before."""


@given(angle=angles, speed=speeds, acceleration=st.floats(-50.0, 50.0))
def test_a_bearing_carries_its_links_and_accelerates_them(angle, speed, acceleration):
    """m sqrt((L alpha)^2 + g^2) across the axis, m L w^2 along it; the first joint, the other way
    round.
    """
    motion_of_both = {"joint1.angle": 0.3, "joint2.angle": angle, "joint1.angular_speed": speed}
    rates = {"joint1.angle": acceleration, "joint2.angle": 7.0}
    rotation = {**motion_of_both, "joint2.angular_speed": 1.0}
    first, second = (BEAM.bearing_force(joint, motion_of_both, rotation, rates) for joint in (0, 1))
    turned = 1.5 * 0.4 * speed**2
    turning = 1.5 * 0.4 * acceleration
    weight = 1.5 * BEAM.gravity
    assert second == pytest.approx((np.hypot(turning, weight), turned), rel=1e-4, abs=1e-9)
    assert first == pytest.approx((np.hypot(turning, turned), weight), rel=1e-4, abs=0.101)


@given(torque=st.floats(-20.0, 20.0), speed=st.floats(0.5, 4.0), turning=speeds)
def test_the_friction_grows_with_the_load_of_the_bearing(torque, speed, turning):
    """T_c + r_1 R_r + r_2 R_a at the accelerations of the arm, in whose power that leaves it this
    friction is.
    """
    element = StickSlip(0.4, (), presliding_angle=0.004, bearing_arms=(0.02, 0.03))
    arm = WithStickSlip(BEAM, (StickSlip(0.1, presliding_angle=0.004), element))
    q = {
        "joint1.angle": 0.2,
        "joint2.angle": -0.4,
        "joint1.friction_bristle": 0.0,
        "joint2.friction_bristle": 1.0,
    }
    v = {"joint1.angular_speed": turning, "joint2.angular_speed": speed}
    forces = {"joint1.angle": torque, "joint2.angle": 3.0}
    moved = arm.acceleration(q, v, forces, {})
    across, along = BEAM.bearing_force(1, q, v, moved)
    friction = 3.0 - BEAM.inverse_dynamics(q, v, moved)["joint2.angle"]
    assert friction == pytest.approx(0.4 + 0.02 * across + 0.03 * along, rel=1e-9)
    without = replace(arm, elements=(arm.elements[0], replace(element, bearing_arms=())))
    lost = [each.dissipated_power(q, v, forces, {}) for each in (arm, without)]
    assert lost[0] - lost[1] == pytest.approx((friction - 0.4) * speed, rel=1e-9)


@pytest.mark.parametrize(
    ("inner", "arms"), [(BEAM, (0.1,) * 3), (AntagonisticJoint(0.03, 0.05), (0.1,))]
)
def test_bearing_arms_are_those_of_a_serial_arm(inner, arms):
    name = (
        f"{len(arms)} bearing_arms are given for a joint of {type(inner).__name__}; a SerialArm"
        " takes one or two"
    )
    elements = (replace(SLIP, load_arms=(), bearing_arms=arms),) * len(inner.coordinates)
    with pytest.raises(ParameterError, match=name):
        WithStickSlip(inner, elements)


def test_friction_needs_an_element_for_each_angle_and_a_load_for_each_muscle():
    with pytest.raises(
        ParameterError,
        match="SerialArm has 3 angles and 1 elements are given; give one for each angle",
    ):
        WithStickSlip(ARM, (SLIP,))
    with pytest.raises(
        ParameterError, match="takes 2 muscles, and 1 load_arms are given; give one for each muscle"
    ):
        WithStickSlip(ARM, (SLIP, SLIP, replace(SLIP, load_arms=(0.1,))))


# Pressures as inputs


def test_a_driven_plant_has_the_motion_of_a_plant_at_its_pressures():
    muscles = tuple(replace(chosen_muscle(), name=n) for n in "ab")
    lever = AntagonisticJoint(0.03, 0.05, 0.2, 2.0, 0.1)
    valve = Valve(1e-8, 0.4)
    plant = Plant(muscles, (FillDischarge(Supply(6e5), valve, valve),) * 2, lever)
    driven = PressureDriven(muscles, lever, (0.02, 0.05))
    state = plant.state_at(pressure=3e5, angle=0.1, angular_speed=0.4)
    known = plant.rates(state, dict.fromkeys(plant.inputs, 0.0))
    pressures = {f"{n}.pressure": 3e5 for n in "ab"}
    at = {s.name: state.get(s.name, 0.0) for s in driven.states} | pressures
    found = driven.rates(at, {"a.measured_pressure": 3.5e5, "b.measured_pressure": 2e5})
    assert found["angular_speed"] == pytest.approx(known["angular_speed"], rel=1e-9)
    assert (found["a.pressure"], found["b.pressure"]) == pytest.approx((5e4 / 0.02, -1e5 / 0.05))


def test_an_arm_with_stick_slip_is_traced_and_compiled():
    """The compiled run of a coupled arm keeps its energy book: what the muscles give is stored or
    rubbed away.
    """
    muscles = tuple(Muscle(LinearInPressure((6e-4,), (-5.0,)), BRAID, name=n) for n in "ab")
    driven = PressureDriven(muscles, WithStickSlip(ARM, (SLIP,) * 3), (0.02, 0.02))
    levels = {"a": (1e5, 3e5, 1e5), "b": (1e5, 5e4, 2e5)}
    signal = SampledSignal(
        {
            f"{n}.measured_pressure": [*zip((0.0, 0.3, 0.6), p, strict=True)]
            for n, p in levels.items()
        }
    )
    start = driven.state_at((1e5, 1e5), **{"joint2.angle": 0.4, "joint3.angular_speed": 1.0})
    run = simulate(
        driven,
        signal,
        duration=0.6,
        initial_state=start,
        integrator=RungeKutta4(5e-4),
        output_times=1e-3,
    )
    energy = []
    lost = []
    given = []
    for row in range(len(run["time"])):
        state = {s.name: run[s.name][row] for s in driven.states}
        tensions = [run[f"{n}.force"][row] for n in "ab"]
        forces = driven.mechanism.generalised_forces(state, tensions, driven.resting_lengths)
        energy.append(ARM.kinetic_energy(state, state) + ARM.potential_energy(state))
        lost.append(driven.mechanism.dissipated_power(state, state, forces, {}))
        given.append(sum(forces[c.name] * state[c.speed] for c in ARM.coordinates))
    work = np.trapezoid(np.array(given) - lost, run["time"])
    assert energy[-1] - energy[0] == pytest.approx(work, abs=0.01 * np.ptp(energy))
    assert np.ptp(energy) > 0.1


def test_a_driven_plant_counts_its_muscles_lags_and_pressures():
    muscles = tuple(replace(chosen_muscle(), name=n) for n in "ab")
    with pytest.raises(
        ParameterError,
        match="2 muscles, 1 lags and a mechanism for any number of muscles are given",
    ):
        PressureDriven(muscles, HangingMass(2.0), (0.02,))
    with pytest.raises(ParameterError, match="two muscles have the same name"):
        PressureDriven((muscles[0],) * 2, HangingMass(2.0), (0.02, 0.02))
    driven = PressureDriven(muscles, HangingMass(2.0), (0.02, 0.02))
    with pytest.raises(ParameterError, match="1 pressures are given for 2 muscles"):
        driven.state_at((1e5,))
    with pytest.raises(ParameterError, match="no state 'angle'; there are position"):
        driven.state_at((1e5, 1e5), angle=1.0)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"axis": (1, 1, 0)}, r"axis is \(1, 1, 0\); it must be"),
        ({"centre": (0.0, 0.0)}, "centre has 2 numbers; give x, y and z"),
        ({"min_angle": 1.0, "max_angle": 0.0}, "min_angle 1 must be less than max_angle 0"),
        ({"rotor_inertia": 0.0}, "mass and rotor_inertia are 0; give at least one of them"),
    ],
)
def test_a_link_that_cannot_be_is_refused(values, message):
    with pytest.raises(ParameterError, match=message):
        SpatialLink(**{"axis": (0, 0, 1), "rotor_inertia": 0.1, **values})


def test_friction_by_load_gives_at_most_what_the_rising_load_gives_its_bristle():
    """Without a static excess: work given <= integral of theta_s z^2/2 over the rising level; at
    constant load none is given. Below the sliding range some is.
    """
    element = StickSlip(0.3, presliding_angle=0.02)
    omega = 2 * np.pi
    step = 5e-4
    amplitude, swing, phase = np.meshgrid([2e-3, 6e-3, 0.05], [0.0, 1.0], [0.0, 1.5, 3.0, 4.5])
    bristle = np.zeros_like(amplitude)
    given = np.zeros_like(amplitude)
    paid = np.zeros_like(amplitude)
    for t in np.arange(0.0, 4.0, step):
        speed = amplitude * omega * np.cos(omega * (t + 0.5 * step))
        load = 1.0 + swing * np.sin(2 * omega * t + phase)
        rate = 2 * omega * swing * np.cos(2 * omega * t + phase)
        middle = bristle + 0.5 * step * element.bristle_rate(bristle, speed)
        if t >= 3.0:  # a period after the start has faded
            given += element.torque(middle, load, speed) * speed * step
            paid += 0.5 * element.presliding_angle * middle**2 * np.maximum(rate, 0.0) * step
        bristle = bristle + step * element.bristle_rate(middle, speed)
    assert np.all(given < paid + 1e-6)
    assert np.all(given[swing == 0.0] < 0.0)
    assert 1e-3 < given[amplitude == 6e-3].max() < 2e-3

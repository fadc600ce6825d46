"""Joints and arms: pulleys whose length is the integral of their moment arm, and Lagrange's
equations of an arm.

r(theta) = dL/dtheta,   M = d2T/dv dv,   d/dt dT/dv - dT/dq + dV/dq = Q
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airmuscle.errors import ParameterError
from airmuscle.physics import (
    AntagonisticJoint,
    ArmLink,
    ConstantRadius,
    CrankProfile,
    JointWithFriction,
    MuscleRoute,
    PlanarArm,
    PolynomialProfile,
    SpringLoad,
)

PROFILES = (
    ConstantRadius(),
    PolynomialProfile((0.4, -0.3, 0.1)),
    CrankProfile(0.3),
    CrankProfile(-0.2),
)
JOINT = AntagonisticJoint(
    0.03, 0.05, 0.2, 2.0, 0.12, 0.7, -1.0, 1.0, PolynomialProfile((0.4, -0.3))
)
UPPER = ArmLink(0.3, 1.5, 0.14, 0.012, 0.1, -1.5, 1.5)
LOWER = ArmLink(0.25, 1.1, 0.11, 0.006, 0.2, -1.5, 1.5)
SIX = (
    MuscleRoute((1,), (0.03,), 0.1),
    MuscleRoute((1,), (-0.03,), 0.1),
    MuscleRoute((2,), (0.025,), 0.1, (CrankProfile(0.2),)),
    MuscleRoute((2,), (-0.025,), 0.1, (CrankProfile(-0.2),)),
    MuscleRoute((1, 2), (0.02, 0.015), 0.1),
    MuscleRoute((1, 2), (-0.02, -0.015), 0.1),
)
ARM = PlanarArm((UPPER, LOWER), SIX, 0.7)
LENGTHS = (0.3, 0.3, 0.2, 0.2, 0.35, 0.35)
angles = st.floats(-0.9, 0.9)


def at(q1, q2):
    return {"joint1.angle": q1, "joint2.angle": q2}


def moving(v1, v2):
    return {"joint1.angular_speed": v1, "joint2.angular_speed": v2}


@pytest.mark.parametrize("profile", PROFILES, ids=str)
@given(angle=angles)
def test_the_moment_arm_is_the_derivative_of_the_shortening(profile, angle):
    step = 1e-6
    slope = (profile.integral(angle + step) - profile.integral(angle - step)) / (2 * step)
    assert profile.ratio(angle) == pytest.approx(slope, abs=1e-8)
    assert profile.ratio(0.0) == pytest.approx(1.0)
    assert profile.integral(0.0) == pytest.approx(0.0, abs=1e-15)


@given(angle=angles, first=st.floats(0.0, 1e3), second=st.floats(0.0, 1e3))
def test_a_symmetric_pair_is_its_own_mirror_image(angle, first, second):
    """Exchanging the muscles and the sign of the angle changes the sign of the torque only."""
    lengths = (0.3, 0.3)
    one = JOINT.generalised_forces({"angle": angle}, (first, second), lengths)["angle"]
    other = JOINT.generalised_forces({"angle": -angle}, (second, first), lengths)["angle"]
    assert one == pytest.approx(-other, abs=1e-12)
    assert (
        JOINT.contractions({"angle": angle}, lengths)
        == JOINT.contractions({"angle": -angle}, lengths)[::-1]
    )


def test_the_weight_of_a_joint_acts_from_its_own_hanging_position():
    joint = AntagonisticJoint(0.03, 0.05, weight_torque=2.0, weight_angle=0.5 * np.pi)
    still = {"angular_speed": 0.0}
    down = joint.acceleration({"angle": 0.0}, still, {"angle": 0.0}, {})["angle"]
    assert down == pytest.approx(-2.0 / 0.05)
    assert joint.acceleration({"angle": -0.5 * np.pi}, still, {"angle": 0.0}, {})[
        "angle"
    ] == pytest.approx(0.0)


def test_dry_friction_opposes_motion_with_its_torque_and_vanishes_at_rest():
    rubbing = JointWithFriction(replace(JOINT, damping=0.0, weight_torque=0.0), 0.6, 0.01)
    assert rubbing.friction(0.0) == 0.0
    assert rubbing.friction(1.0) == pytest.approx(-0.6, rel=1e-4)
    assert rubbing.friction(-0.03) == pytest.approx(0.6, rel=0.052)
    power = rubbing.dissipated_power({"angle": 0.2}, {"angular_speed": -2.0}, {"angle": 0.0}, {})
    assert power == pytest.approx(1.2, rel=1e-4)


# Arms


def cartesian_kinetic_energy(arm, q, v):
    """Kinetic energy from the velocities of the points of the links: a derivation without a mass
    matrix.
    """
    velocity = np.zeros(2)
    energy = 0.0
    for link, angle, speed in zip(arm.links, np.cumsum(q), np.cumsum(v), strict=True):
        along = speed * np.array([np.cos(angle), np.sin(angle)])
        centre = velocity + link.centre * along
        energy += 0.5 * link.mass * centre @ centre + 0.5 * link.inertia * speed**2
        velocity = velocity + link.length * along
    return energy + 0.5 * arm.payload * velocity @ velocity


@given(q1=angles, q2=angles, v1=st.floats(-3, 3), v2=st.floats(-3, 3))
def test_the_kinetic_energy_of_an_arm_is_that_of_its_points(q1, q2, v1, v2):
    found = ARM.kinetic_energy(at(q1, q2), moving(v1, v2))
    expected = cartesian_kinetic_energy(ARM, np.array([q1, q2]), np.array([v1, v2]))
    assert found == pytest.approx(expected, rel=1e-12, abs=1e-14)
    speeds = np.array([v1, v2])
    assert found == pytest.approx(
        0.5 * speeds @ np.array(ARM.mass_matrix(at(q1, q2))) @ speeds, rel=1e-12, abs=1e-14
    )


@given(q1=angles, q2=st.floats(-3.1, 3.1))
def test_the_mass_matrix_is_symmetric_and_positive_definite(q1, q2):
    matrix = np.array(ARM.mass_matrix(at(q1, q2)))
    np.testing.assert_allclose(matrix, matrix.T, rtol=1e-14)
    assert np.linalg.eigvalsh(matrix).min() > 1e-3


@given(
    q1=angles,
    q2=angles,
    v1=st.floats(-3, 3),
    v2=st.floats(-3, 3),
    t1=st.floats(-5, 5),
    t2=st.floats(-5, 5),
)
def test_an_arm_obeys_lagranges_equations_of_its_points(q1, q2, v1, v2, t1, t2):
    """d/dt dT/dv - dT/dq + dV/dq = Q - b v, with T and V of the points by finite differences."""
    q = np.array([q1, q2])
    v = np.array([v1, v2])
    step = 1e-4
    forces = {"joint1.angle": t1, "joint2.angle": t2}
    acceleration = np.array([*ARM.acceleration(at(*q), moving(*v), forces, {}).values()])

    def energy(x, w):
        heights = [ARM.links[0].centre, ARM.links[0].length]
        upper, lower = -np.cos(x[0]), -np.cos(x[0] + x[1])
        weight = ARM.links[0].mass * heights[0] * upper
        weight += ARM.links[1].mass * (heights[1] * upper + ARM.links[1].centre * lower)
        weight += ARM.payload * (heights[1] * upper + ARM.links[1].length * lower)
        return cartesian_kinetic_energy(ARM, x, w), ARM.gravity * weight

    def momentum(x, w):
        ends = [[energy(x, w + s * e)[0] for s in (1, -1)] for e in np.eye(2)]
        return np.array(
            [(a - b) / 2 for a, b in ends]
        )  # exact, because the energy is quadratic in the speeds

    change = (
        momentum(q + step * v, v + step * acceleration)
        - momentum(q - step * v, v - step * acceleration)
    ) / (2 * step)
    slopes = [[np.subtract(*energy(q + s * step * e, v)) for s in (1, -1)] for e in np.eye(2)]
    lagrangian = np.array([(a - b) / (2 * step) for a, b in slopes])
    damping = np.array([link.damping for link in ARM.links])
    np.testing.assert_allclose(change - lagrangian, np.array([t1, t2]) - damping * v, atol=1e-5)


def test_an_arm_of_one_link_is_a_joint():
    link = ArmLink(0.4, 2.0, 0.15, 0.02, 0.3)
    arm = PlanarArm((link,), (MuscleRoute((1,), (0.03,), 0.1), MuscleRoute((1,), (-0.03,), 0.1)))
    joint = AntagonisticJoint(0.03, 0.02 + 2.0 * 0.15**2, 0.3, 2.0 * 0.15 * arm.gravity, 0.1)
    forces = arm.generalised_forces({"joint1.angle": 0.3}, (200.0, 50.0), (0.3, 0.3))
    own = joint.generalised_forces({"angle": 0.3}, (200.0, 50.0), (0.3, 0.3))
    assert forces["joint1.angle"] == pytest.approx(own["angle"])
    found = arm.acceleration({"joint1.angle": 0.3}, {"joint1.angular_speed": 0.5}, forces, {})
    expected = joint.acceleration({"angle": 0.3}, {"angular_speed": 0.5}, own, {})
    assert found["joint1.angle"] == pytest.approx(expected["angle"])


def test_a_biarticular_muscle_acts_on_both_joints():
    forces = ARM.generalised_forces(at(0.2, -0.3), (0.0, 0.0, 0.0, 0.0, 100.0, 0.0), LENGTHS)
    assert forces == pytest.approx({"joint1.angle": 2.0, "joint2.angle": 1.5})


def test_the_tip_of_a_stretched_arm_is_at_its_length():
    assert ARM.tip(at(0.0, 0.0)) == pytest.approx((0.0, -0.55))
    assert ARM.tip(at(0.5 * np.pi, 0.0)) == pytest.approx((0.55, 0.0))
    assert ARM.tip(at(0.5 * np.pi, 0.5 * np.pi)) == pytest.approx((0.3, 0.25))


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (
            lambda: replace(JOINT, min_angle=1.0, max_angle=0.5),
            "min_angle 1 must be less than max_angle 0.5",
        ),
        (
            lambda: replace(JOINT, profile=CrankProfile(0.0), max_angle=2.0),
            "allowed range: greater than 0 from -2 to 2 rad",
        ),
        (lambda: PolynomialProfile(()), "coefficients is empty"),
        (
            lambda: JointWithFriction(SpringLoad(1.0, 1.0), 0.1),
            "SpringLoad has no coordinate in rad",
        ),
        (
            lambda: JointWithFriction(ARM, 0.1),
            "2 coordinates in rad; set coordinate .* joint1.angle or joint2.angle",
        ),
        (
            lambda: JointWithFriction(ARM, 0.1, coordinate="angle"),
            "no coordinate 'angle' in rad; PlanarArm has joint1.angle, joint2.angle",
        ),
        (lambda: ArmLink(0.3, 1.0, 0.0), "moment of inertia about the joint is zero"),
        (
            lambda: ArmLink(0.3, 1.0, 0.1, min_angle=1.0, max_angle=0.0),
            "min_angle 1 must be less than max_angle 0",
        ),
        (lambda: MuscleRoute((0,), (0.1,)), "different joint numbers, counted from 1"),
        (lambda: MuscleRoute((1, 1), (0.1, 0.1)), "different joint numbers"),
        (lambda: MuscleRoute((1, 2), (0.1,)), "one radius for each joint"),
        (lambda: PlanarArm((UPPER,), SIX), "route 3 crosses joint 2; allowed range: 1 to 1"),
        (lambda: PlanarArm((UPPER,), ()), "one route for each muscle"),
    ],
)
def test_impossible_joints_and_arms_are_refused(build, message):
    with pytest.raises(ParameterError, match=message):
        build()

"""Mechanisms: what muscles do on them is virtual work, their energies are those of Newton's law,
and stops only push.

Q = d(sum F_i L_i eps_i)/dq,   d(T + V)/dt = Q q' - P_lost,   dT/dt = v (inertial force)
"""

from __future__ import annotations

import dataclasses
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from joints import chosen_muscle

from airmuscle.core import autodiff
from airmuscle.errors import ParameterError
from airmuscle.physics import (
    AntagonisticJoint,
    ArmLink,
    ClosedChamber,
    ConstantRadius,
    CrankProfile,
    ExternalLoad,
    HangingMass,
    HuntCrossley,
    Isometric,
    Isothermal,
    Isotonic,
    JointWithEndStops,
    JointWithExternalTorque,
    JointWithFriction,
    Lever,
    Mechanism,
    MuscleRoute,
    MusclesInSeries,
    PlanarArm,
    Plant,
    PolynomialProfile,
    PrescribedMotion,
    Pulley,
    SpringLoad,
    WithEndStops,
    WithLatch,
    WithOffsets,
)

CONTACT = HuntCrossley(1e7, 0.4)
JOINT = AntagonisticJoint(0.03, 0.05, 0.2, 2.0, 0.12)
SHAPED = replace(
    JOINT, weight_angle=1.2, min_angle=-1.4, max_angle=1.4, profile=PolynomialProfile((0.3, -0.2))
)
ARM = PlanarArm(
    (
        ArmLink(0.3, 1.5, 0.14, 0.01, 0.1),
        ArmLink(0.25, 1.0, 0.11, 0.005, 0.2),
        ArmLink(0.1, 0.4, 0.05, 0.0, 0.05),
    ),
    (
        MuscleRoute((1,), (0.03,), 0.1),
        MuscleRoute((1, 2), (-0.03, -0.02), 0.1, (ConstantRadius(), CrankProfile(0.3))),
        MuscleRoute((2, 3), (0.02, -0.01), 0.05),
    ),
    0.5,
)
LEVER = Lever((0.05, 0.08), 4.0, 0.3, 0.01, 0.1, (0.1, 0.15))
MECHANISMS: dict[str, tuple[Mechanism, int]] = {
    "hanging": (HangingMass(8.0), 2),
    "mounted": (WithOffsets(HangingMass(8.0), (0.05, -0.02)), 2),
    "spring": (SpringLoad(3.0, 2000.0, 20.0, 5.0), 1),
    "isotonic": (Isotonic(150.0, 0.5, 3.0), 1),
    "prescribed": (PrescribedMotion(), 1),
    "lever": (LEVER, 2),
    "against": (replace(LEVER, arms=(0.05, -0.06)), 2),
    "pulley": (Pulley(0.04, 12.0, 0.5, 0.02, 4.0), 1),
    "series": (MusclesInSeries(HangingMass(5.0), (0.3, 0.2), 8.0), 3),
    "series on a lever": (MusclesInSeries(replace(LEVER, arms=(0.07,), offsets=()), (0.3,)), 2),
    "series in a frame": (MusclesInSeries(Isometric(0.05), (0.3,)), 2),
    "joint": (JOINT, 2),
    "crank": (replace(SHAPED, profile=CrankProfile(0.1)), 2),
    "shaped": (SHAPED, 2),
    "rubbing": (JointWithFriction(SHAPED, 0.4), 2),
    "arm": (ARM, 3),
    "rubbing stopped arm": (
        JointWithEndStops(
            JointWithFriction(ARM, 0.4, coordinate="joint2.angle"),
            -0.1,
            0.2,
            0.05,
            CONTACT,
            "joint1.angle",
        ),
        3,
    ),
    "stopped": (WithEndStops(SpringLoad(3.0, 2000.0), -0.01, 0.02, CONTACT), 1),
    "stopped chain": (
        WithEndStops(
            MusclesInSeries(HangingMass(5.0), (0.3,)), -0.01, 0.02, CONTACT, "node1.position"
        ),
        2,
    ),
    "stopped joint": (JointWithEndStops(JOINT, -0.3, 0.4, 0.05, CONTACT), 2),
    "latched": (WithLatch(JOINT), 2),
    "loaded": (JointWithExternalTorque(SHAPED), 2),
}
LENGTHS = (0.2, 0.25, 0.3)
each = pytest.mark.parametrize(("mechanism", "count"), MECHANISMS.values(), ids=MECHANISMS)
numbers = st.floats(-1.0, 1.0)


def placed(mechanism, draw):
    """Coordinates and speeds of about their nominal sizes."""
    q = {}
    v = {}
    for i, c in enumerate(mechanism.coordinates):
        q[c.name] = 4 * c.nominal * draw[2 * i]
        v[c.speed] = c.nominal_speed * draw[2 * i + 1]
    return q, v


def work(mechanism, q, tensions, lengths):
    return sum(
        f * n * e
        for f, n, e in zip(tensions, lengths, mechanism.contractions(q, lengths), strict=True)
    )


@each
@given(
    st.lists(numbers, min_size=6, max_size=6), st.lists(st.floats(0.0, 2e3), min_size=3, max_size=3)
)
def test_pulls_are_virtual_work(mechanism, count, draw, tensions):
    """Central differences of the work, and for every pull written by hand the derived one."""
    lengths = LENGTHS[:count]
    tensions = tensions[:count]
    q, _ = placed(mechanism, draw)
    pulls = mechanism.generalised_forces(q, tensions, lengths)
    assert set(pulls) == set(q)
    assert pulls == pytest.approx(
        Mechanism.generalised_forces(mechanism, q, tensions, lengths), rel=1e-12, abs=1e-9
    )
    for name in q:
        step = 1e-6
        ends = [work(mechanism, {**q, name: q[name] + s}, tensions, lengths) for s in (step, -step)]
        assert pulls[name] == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-6, abs=1e-4)


@each
@given(st.lists(numbers, min_size=6, max_size=6))
def test_speeds_of_shortening_are_the_rates_of_contraction(mechanism, count, draw):
    lengths = LENGTHS[:count]
    q, v = placed(mechanism, draw)
    dt = 1e-7
    before, after = (
        mechanism.contractions(
            {c.name: q[c.name] + s * v[c.speed] for c in mechanism.coordinates}, lengths
        )
        for s in (-dt, dt)
    )
    found = mechanism.contraction_speeds(q, v, lengths)
    expected = [n * (b - a) / (2 * dt) for n, a, b in zip(lengths, before, after, strict=True)]
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-7)


@each
@given(
    st.lists(numbers, min_size=6, max_size=6),
    st.lists(st.floats(0.0, 500.0), min_size=3, max_size=3),
    numbers,
)
def test_the_power_of_the_pulls_goes_into_energy_or_is_lost(
    mechanism, count, draw, tensions, given_input
):
    """d(T + V)/dt along the motion, exactly, against what the muscles give and what is lost."""
    lengths = LENGTHS[:count]
    q, v = placed(mechanism, draw)
    inputs = {i.name: 0.0 if i.name == "latched" else given_input for i in mechanism.inputs}
    pulls = mechanism.generalised_forces(q, tensions[:count], lengths)
    acceleration = mechanism.acceleration(q, v, pulls, inputs)
    names, speeds = list(q), list(v)

    def energy(x):
        places, moving = (
            dict(zip(names, x, strict=False)),
            dict(zip(speeds, x[len(names) :], strict=True)),
        )
        return [mechanism.potential_energy(places) + mechanism.kinetic_energy(places, moving)]

    along = [v[s] for s in speeds] + [acceleration[n] for n in names]
    (growth,) = autodiff.jvp(energy, [*q.values(), *v.values()], along)
    power = sum(pulls[n] * v[s] for n, s in zip(names, speeds, strict=True))
    lost = mechanism.dissipated_power(q, v, pulls, inputs)
    scale = abs(power) + abs(lost) + abs(growth) + 1e-3
    assert growth == pytest.approx(power - lost, abs=1e-9 * scale)
    if not {"prescribed_acceleration", "external_torque"} & set(inputs):  # a drive may give power
        assert lost >= -1e-12 * scale


@pytest.mark.parametrize(
    "mechanism",
    [
        ExternalLoad(("a", "b")),
        WithOffsets(ExternalLoad(("a", "b")), (0.05, -0.02)),
        WithLatch(ExternalLoad(("a", "b"))),
        MusclesInSeries(ExternalLoad(), (0.3,)),
    ],
    ids=repr,
)
def test_a_load_outside_moves_its_muscles_also_through_a_wrapper_and_receives_their_power(
    mechanism,
):
    """The speeds are differences of the contractions along the given motion; the tensions' power is
    in the books.
    """
    lengths = LENGTHS[:2]
    tensions = (300.0, 120.0)
    dt = 1e-6
    places = [i.name for i in mechanism.inputs if i.name.endswith("shortening")]
    places += [c.name for c in mechanism.coordinates]
    speeds = [
        f"{name}_speed" if name.endswith("shortening") else name.replace("position", "speed")
        for name in places
    ]
    q = dict(zip(places, (0.01, -0.004), strict=True))
    v = dict(zip(speeds, (0.05, 0.2), strict=True))
    moved = {n: q[n] + dt * v[s] for n, s in zip(places, speeds, strict=True)}
    before, after = (mechanism.contractions(at, lengths) for at in (q, moved))
    found = mechanism.contraction_speeds(q, v, lengths)
    assert found == pytest.approx(
        [n * (b - a) / dt for n, a, b in zip(lengths, before, after, strict=True)], rel=1e-8
    )
    pulls = mechanism.generalised_forces(q, tensions, lengths)
    lost = mechanism.dissipated_power(q, v, pulls, v)
    kept = sum(pulls[c.name] * v[c.speed] for c in mechanism.coordinates)
    assert lost + kept == pytest.approx(
        sum(f * s for f, s in zip(tensions, found, strict=True)), rel=1e-12
    )


# What each is


def test_a_lever_at_a_small_angle_is_a_weight_at_the_ratio_of_its_arms():
    lever = Lever((0.1,), 5.0, 0.2)
    pulls = lever.generalised_forces({"angle": 0.0}, [98.0665], [0.3])
    assert pulls["angle"] == pytest.approx(9.80665)
    assert lever.acceleration({"angle": 0.0}, {"angular_speed": 0.0}, pulls, {})[
        "angle"
    ] == pytest.approx(0.0, abs=1e-12)
    (contraction,) = lever.contractions({"angle": 0.5 * np.pi}, [0.3])
    assert contraction == pytest.approx(1 - np.hypot(0.1, 0.2) / 0.3)


def test_a_muscle_on_a_negative_arm_turns_a_lever_back():
    lever = Lever((0.1, -0.1), 0.0, 0.2, 0.01)
    up, down = lever.contractions({"angle": 0.05}, [0.3, 0.3])
    assert up > 0 > down
    assert lever.generalised_forces({"angle": 0.0}, [100.0, 100.0], [0.3, 0.3])[
        "angle"
    ] == pytest.approx(0.0, abs=1e-12)


def test_a_pulley_of_ratio_one_without_inertia_is_a_hanging_mass():
    pulley = Pulley(0.05, 7.0)
    hanging = HangingMass(7.0)
    for tension in (0.0, 40.0, 300.0):
        pulls = pulley.generalised_forces({"position": 0.01}, [tension], [0.3])
        at = ({"position": 0.01}, {"speed": 0.3}, pulls, {})
        assert pulley.acceleration(*at) == pytest.approx(hanging.acceleration(*at))
    half = Pulley(0.05, 7.0, 0.5, 0.01)
    assert half.acceleration(*at)["position"] == pytest.approx(
        (300 - 0.5 * 7 * 9.80665) / (0.01 / 0.05**2 + 0.25 * 7)
    )


def test_a_chain_of_muscles_shortens_by_the_sum_of_its_parts():
    chain = MusclesInSeries(HangingMass(5.0), (0.3, 0.2))
    q = {"node1.position": 0.01, "node2.position": 0.015, "position": 0.05}
    contractions = chain.contractions(q, LENGTHS)
    assert sum(n * e for n, e in zip(LENGTHS, contractions, strict=True)) == pytest.approx(0.05)
    assert contractions == pytest.approx((0.01 / 0.2, 0.005 / 0.25, 0.035 / 0.3))


def test_the_first_muscle_turns_the_joint_forward_and_the_second_back():
    forward, back = JOINT.contractions({"angle": 0.1}, [0.2, 0.25])
    assert forward == pytest.approx(0.12 + 0.003 / 0.2)
    assert back == pytest.approx(0.12 - 0.003 / 0.25)
    still = {"angular_speed": 0.0}
    for tensions, sign in (((100.0, 20.0), 1), ((20.0, 100.0), -1), ((50.0, 50.0), 0)):
        pulls = JOINT.generalised_forces({"angle": 0.0}, tensions, [0.2, 0.25])
        assert np.sign(JOINT.acceleration({"angle": 0.0}, still, pulls, {})["angle"]) == sign


@given(st.floats(-0.4, 0.6), st.floats(-3.0, 3.0))
def test_stops_act_beyond_the_ends_alone_and_push_back(angle, speed):
    stops = JointWithEndStops(JOINT, -0.3, 0.4, 0.05, CONTACT)
    push = stops.stop_force({"angle": angle}, {"angular_speed": speed})
    if -0.3 <= angle <= 0.4:
        assert push == 0.0
    else:
        assert push * angle <= 0.0
    still = stops.stop_force({"angle": angle}, {"angular_speed": 0.0})
    depth = 0.05 * (max(-0.3 - angle, 0.0) - max(angle - 0.4, 0.0))
    assert still == pytest.approx(0.05 * 1e7 * np.sign(depth) * abs(depth) ** 1.5, abs=1e-9)


@given(st.floats(-3.0, 3.0))
def test_a_stop_begins_without_a_jump(speed):
    """Where the contact begins, on either side of it, and where it opens again because the body
    leaves fast.
    """
    stops = JointWithEndStops(JOINT, -0.3, 0.4, 0.05, CONTACT)
    still = {"angle": 0.0}
    for end in (-0.3, 0.4):
        inside, outside = (
            stops.acceleration({"angle": end * (1 + h)}, {"angular_speed": speed}, still, {})[
                "angle"
            ]
            for h in (-1e-9, 1e-9)
        )
        assert outside == pytest.approx(inside, abs=1e-4)
    leaving = -1 / (0.4 * 0.05)
    push = [
        stops.stop_force({"angle": 0.45}, {"angular_speed": leaving + h})
        for h in (-1e-9, 0.0, 1e-9)
    ]
    assert push == pytest.approx([0.0, 0.0, 0.0], abs=1e-4)


def test_stops_of_a_named_joint_act_on_this_joint():
    """Only joint 2 is beyond its stop: the torque on it is R F(R (q - q_high)), and the others have
    none.
    """
    stops = JointWithEndStops(ARM, -0.1, 0.2, 0.05, CONTACT, "joint2.angle")
    q = {"joint1.angle": 0.5, "joint2.angle": 0.3, "joint3.angle": -0.4}
    v = {c.speed: 0.0 for c in ARM.coordinates}
    torque = -0.05 * 1e7 * (0.05 * 0.1) ** 1.5
    pushed = ARM.acceleration(q, v, {**dict.fromkeys(q, 0.0), "joint2.angle": torque}, {})
    assert stops.acceleration(q, v, dict.fromkeys(q, 0.0), {}) == pytest.approx(pushed)


@pytest.mark.parametrize(
    "joint", [JOINT, SHAPED, replace(SHAPED, profile=CrankProfile(0.1))], ids=("round", "", "crank")
)
@pytest.mark.parametrize("angle", [-0.7, 0.0, 0.4])
def test_a_moment_arm_is_the_shortening_of_its_muscle_per_angle(joint, angle):
    step = 1e-6
    ends = [joint.contractions({"angle": angle + h}, LENGTHS[:2]) for h in (-step, step)]
    shortening = [
        length * (b - a) / (2 * step) for length, a, b in zip(LENGTHS, *ends, strict=False)
    ]
    arms = [
        joint.generalised_forces({"angle": angle}, pulls, ())["angle"]
        for pulls in ((1.0, 0.0), (0.0, 1.0))
    ]
    assert arms == pytest.approx(shortening, rel=1e-8)


# What cannot be


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Lever((), 1.0, 0.1), "give one arm for each muscle"),
        (lambda: Lever((0.1, 0.1), 1.0, 0.1, offsets=(0.1,)), "2 arms and 1 offsets are given"),
        (lambda: Lever((0.1,), 1.0, 0.0), "the total inertia is zero"),
        (
            lambda: WithOffsets(JOINT, (0.1,)),
            "AntagonisticJoint takes 2 muscles; 1 offsets are given",
        ),
        (lambda: MusclesInSeries(HangingMass(1.0), ()), "give the mass of each node"),
        (lambda: MusclesInSeries(JOINT, (0.1,)), "AntagonisticJoint takes 2"),
        (
            lambda: WithEndStops(JOINT, 0.0, 0.1, CONTACT),
            "AntagonisticJoint has no coordinate in m; use another mechanism",
        ),
        (
            lambda: WithEndStops(MusclesInSeries(HangingMass(1.0), (0.1,)), 0.0, 0.1, CONTACT),
            "node1.position or position",
        ),
        (
            lambda: WithEndStops(HangingMass(1.0), 0.0, 0.1, CONTACT, "angle"),
            "no coordinate 'angle' in m",
        ),
        (
            lambda: WithEndStops(HangingMass(1.0), 0.1, 0.1, CONTACT),
            "lower_stop is 0.1; it must be less than upper_stop, 0.1",
        ),
        (lambda: SpringLoad(float("nan"), 1.0), "must be finite"),
        (lambda: Isotonic(-5.0, 1.0), "allowed range: 0 to"),
        (lambda: Pulley(0.0, 1.0), "allowed range: 0.0001"),
    ],
)
def test_what_cannot_be_is_refused(make, message):
    with pytest.raises(ParameterError, match=message):
        make()


def test_a_plant_refuses_another_number_of_muscles_than_its_mechanism_takes():
    with pytest.raises(ParameterError, match="AntagonisticJoint takes 2 muscles; 1 are given"):
        Plant(chosen_muscle(), ClosedChamber(), JOINT, Isothermal())


def test_wrapping_hands_on_everything():
    """A wrapper's interface is the inner mechanism's; none of it falls back to the base's."""
    stopped = WithEndStops(WithLatch(SpringLoad(3.0, 2000.0, 20.0)), -1.0, 1.0, CONTACT)
    assert [i.name for i in stopped.inputs] == ["latched"]
    q = {"position": 0.1}
    v = {"speed": 0.2}
    assert stopped.potential_energy(q) == 10.0
    assert stopped.kinetic_energy(q, v) == pytest.approx(0.06)
    assert stopped.dissipated_power(q, v, {"position": 0.0}, {"latched": 0.0}) == pytest.approx(0.8)
    moved = dataclasses.replace(stopped, lower_stop=-2.0)
    assert [
        each.stop_force({"position": -1.5}, {"speed": 0.0}) > 0.0 for each in (stopped, moved)
    ] == [True, False]

"""Sizing: the shortest muscle whose law holds the load at both end points.

lift   F(p_1, eps_1) = F_1/n,   F(p_2, eps_1 + S/L) = F_2/n,   S_F F <= F_max(eps) = min(F(p_max,
       eps), F_rated)
joint  n r (F(p_c, eps_c) - F(p_min, eps_e)) = M,   eps_c - eps_e = r Theta/L
air    m = p V/(R T) of both end points
"""

from __future__ import annotations

import dataclasses
import itertools
import math
import pickle
import re

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import PchipInterpolator

import airmuscle as am
from airmuscle.core import STANDARD_GRAVITY
from airmuscle.design import (
    GripperRequirement,
    JointRequirement,
    LiftRequirement,
    MuscleChoice,
    SizingConditions,
    SizingResult,
    by_air,
    by_area,
    by_count,
    by_diameter,
    by_length,
    by_reserve,
    catalogue,
    choose,
    discharge_valve,
    fill_valve,
    scenario_text,
    size_muscles,
)
from airmuscle.design.sizing import air_path, working_muscle
from airmuscle.errors import AirmuscleError, ParameterError, SolveError
from airmuscle.files import Entry
from airmuscle.physics import (
    GAS_CONSTANT,
    REFERENCE_DENSITY,
    EffectiveLength,
    MartensBoblan2017,
    PressureLaw,
    Ratings,
    ValidityRange,
)

pytestmark = pytest.mark.filterwarnings("ignore::airmuscle.core.errors.AirmuscleWarning")

SIX_BAR = SizingConditions(supply=6e5)
LIFT = LiftRequirement(stroke=0.040, mass=20.0)
SPRING = LiftRequirement(stroke=0.030, force=80.0, stiffness=4000.0)
FALLING = LiftRequirement(stroke=0.030, force=300.0, stiffness=-8000.0)
JOINT = JointRequirement(angle=math.radians(60.0), torque=5.0, inertia=0.05)
MUSCLES = ("dmsp-10-250", "dmsp-20-300", "festo-tool-dmsp-20", "sarosi-dmsp-20-400n")


def effective_length(length: float = 0.3) -> Entry:
    """A muscle with rigid ends of 60 mm, whose force at a contraction depends on its length."""
    entry = am.load("sarosi-dmsp-20-400n")
    law = EffectiveLength(entry.characteristic, resting_length=length, dead_length=0.06)
    geometry = dataclasses.replace(am.load("dmsp-20-300").geometry, resting_length=length)
    return dataclasses.replace(
        entry, name="with rigid ends", characteristic=law, geometry=geometry, checks=()
    )


def force(choice: MuscleChoice, pressure: float, contraction: float) -> float:
    """Force of the law itself."""
    return float(choice.entry.characteristic.force(pressure, contraction))


# Force balance


@pytest.mark.parametrize("name", MUSCLES)
@pytest.mark.parametrize("requirement", [LIFT, SPRING, FALLING])
@pytest.mark.parametrize("count", [1, 2])
def test_the_law_holds_the_load_at_both_ends_of_the_stroke(
    name: str, requirement: LiftRequirement, count: int
):
    choice = choose(am.load(name), requirement, SIX_BAR, count)
    first = choice.design.extended
    last = choice.design.contracted
    loads = requirement.load(0.0) / count, requirement.load(requirement.stroke) / count
    for point, load in zip((first, last), loads, strict=True):
        assert force(choice, point.pressure, point.contraction) == pytest.approx(load, rel=1e-9)
        assert SIX_BAR.safety_factor * load <= point.capacity * (1 + 1e-9)
        assert SIX_BAR.min_pressure <= point.pressure <= 6e5
    assert (last.contraction - first.contraction) * choice.length == pytest.approx(
        requirement.stroke, rel=1e-9
    )
    assert choice.design.reserve >= SIX_BAR.safety_factor - 1.0 - 1e-9


@pytest.mark.parametrize("name", MUSCLES)
@pytest.mark.parametrize("requirement", [LIFT, SPRING, FALLING])
def test_the_reserve_is_that_of_the_worst_position_of_the_stroke(
    name: str, requirement: LiftRequirement
):
    """The capacity is convex in the contraction, so that a falling load can come closest to it
    between the ends.
    """
    choice = choose(am.load(name), requirement, SIX_BAR)
    first = choice.design.extended.contraction
    last = choice.design.contracted.contraction
    eps = np.linspace(first, last, 301)
    load = np.linspace(requirement.load(0.0), requirement.load(requirement.stroke), 301)
    capacity = np.minimum(
        [force(choice, choice.muscle.pressure_range[1], each) for each in eps],
        choice.muscle.max_force,
    )
    assert choice.design.reserve == pytest.approx(np.min(capacity / load) - 1.0, abs=2e-3)


@pytest.mark.parametrize("name", ["dmsp-10-250", "dmsp-20-300"])
def test_the_reserve_of_a_lift_is_the_safety_factor_where_an_end_limits_the_length(name: str):
    assert choose(am.load(name), LIFT, SIX_BAR).design.reserve == pytest.approx(
        SIX_BAR.safety_factor - 1.0, abs=1e-9
    )


@pytest.mark.parametrize("inertia", [0.05, 20.0])
def test_the_reserve_of_a_joint_is_the_safety_factor_where_the_length_is_the_shortest(
    inertia: float,
):
    for safety_factor in (1.5, 2.0):
        conditions = dataclasses.replace(SIX_BAR, safety_factor=safety_factor)
        choice = choose(
            am.load("dmsp-20-300"), dataclasses.replace(JOINT, inertia=inertia), conditions
        )
        assert choice.design.reserve == pytest.approx(safety_factor - 1.0, rel=1e-6)


def test_the_load_is_the_weight_plus_force_and_spring():
    both = LiftRequirement(stroke=0.02, mass=3.0, force=10.0, stiffness=500.0)
    assert both.load(0.02) == 3.0 * STANDARD_GRAVITY + 10.0 + 500.0 * 0.02
    assert both.work == pytest.approx(
        (3.0 * STANDARD_GRAVITY + 10.0) * 0.02 + 0.5 * 500.0 * 0.02**2
    )


@pytest.mark.parametrize(("load", "travel"), [(0.5, 1.0), (1.0, 0.25), (0.3, 0.4)])
def test_a_reduced_requirement_has_the_fraction_of_load_and_motion(load: float, travel: float):
    full = LiftRequirement(stroke=0.03, mass=4.0, force=80.0, stiffness=4000.0)
    lift = full.reduced(load, travel)
    joint = JOINT.reduced(load, travel)
    assert lift.stroke == pytest.approx(travel * full.stroke)
    assert lift.load(0.0) == pytest.approx(load * full.load(0.0))
    assert lift.load(lift.stroke) == pytest.approx(load * full.load(full.stroke))
    assert (joint.torque, joint.inertia, joint.angle) == pytest.approx(
        (load * JOINT.torque, load * JOINT.inertia, travel * JOINT.angle)
    )


@pytest.mark.parametrize("name", MUSCLES)
def test_the_muscles_hold_the_torque_at_the_ends_of_the_angle(name: str):
    choice = choose(am.load(name), JOINT, SIX_BAR)
    design = choice.design
    rest = design.extended
    pulling = design.contracted
    slack = max(force(choice, rest.pressure, rest.contraction), 0.0)
    pull = force(choice, pulling.pressure, pulling.contraction)
    assert design.radius * (pull - slack) == pytest.approx(JOINT.torque, rel=1e-9)
    used = pulling.contraction - rest.contraction
    assert used == pytest.approx(design.radius * JOINT.angle / choice.length, rel=1e-9)
    assert design.radii[0] <= 1.1 * design.radius
    assert design.radius <= design.radii[1]


def test_the_extended_muscle_of_a_joint_accelerates_the_inertia():
    heavy = dataclasses.replace(JOINT, inertia=20.0)
    choice = choose(am.load("dmsp-20-300"), heavy, SIX_BAR)
    design = choice.design
    muscle = choice.muscle
    torque = (
        heavy.torque + heavy.inertia * 0.5 * heavy.angle * (2 * math.pi / SIX_BAR.cycle_time) ** 2
    )
    opposing = float(muscle.floor(design.contracted.contraction))
    reached = design.radius * (design.extended.capacity - opposing)
    assert reached == pytest.approx(1.5 * torque, rel=1e-6)  # it limits: the length is the shortest
    assert choice.length > choose(am.load("dmsp-20-300"), JOINT, SIX_BAR).length


# Lever and gripper


def test_a_lever_is_a_lift_of_its_ratio():
    """Static: i times the load over the travel divided by i; the mass moves as i^2 m."""
    slow = dataclasses.replace(SIX_BAR, cycle_time=1e3)
    lever = LiftRequirement(stroke=0.2, mass=6.0, force=10.0, stiffness=40.0, lever=5.0)
    direct = LiftRequirement(
        stroke=0.04, mass=30.0, force=50.0, stiffness=25 * 40.0
    )  # the spring is 25 times as stiff
    first, second = (choose(am.load("dmsp-20-300"), each, slow) for each in (lever, direct))
    assert first.length == pytest.approx(second.length, rel=1e-6)
    assert first.design.contracted.force == pytest.approx(second.design.contracted.force, rel=1e-9)
    assert lever.work == pytest.approx(direct.work, rel=1e-12)
    assert lever.moving_mass == 25 * 6.0
    quick = dataclasses.replace(SIX_BAR, cycle_time=0.8)
    fast = choose(am.load("dmsp-20-300"), lever, quick)
    inertial = lever.moving_mass * 0.5 * lever.travel * (2 * math.pi / 0.8) ** 2
    needed = 1.5 * (lever.load(0.0) + inertial)
    assert fast.design.extended.capacity >= needed * (1 - 1e-9)


@pytest.mark.parametrize(("lever", "fingers"), [(1.0, 2.0), (2.5, 3.0)])
def test_a_gripper_holds_its_grip_at_every_position_and_opens(lever: float, fingers: float):
    """Virtual work: the muscles hold i n G beyond the opening spring, and can yield to it alone."""
    gripper = GripperRequirement(opening=0.02, grip=40.0, fingers=fingers, lever=lever)
    choice = choose(am.load("dmsp-20-300"), gripper, SIX_BAR)
    grip = lever * fingers * 40.0
    spring = 0.1 * grip
    ends = np.linspace(choice.design.extended.contraction, choice.design.contracted.contraction, 9)
    assert ends[-1] - ends[0] == pytest.approx(0.02 / lever / choice.length)
    for contraction in ends:
        assert force(choice, 6e5, contraction) >= 1.5 * (spring + grip) * (1 - 1e-9)
        assert force(choice, choice.muscle.pressure_range[0], contraction) <= spring * (1 + 1e-9)
    assert choice.design.extended.force == pytest.approx(spring, rel=1e-9)
    assert choice.design.contracted.force == pytest.approx(spring + grip, rel=1e-9)


# Shortest length


def some_mounting_suffices(
    entry: Entry, requirement: LiftRequirement, length: float, count: int = 1
) -> bool:
    """Whether any contraction at the start meets the requirement with this length: independent of
    the search.
    """
    muscle = working_muscle(
        am.files.library.scaling.scale_entry(entry, resting_length=length), SIX_BAR
    )
    low, high = muscle.contraction_range
    starts = np.linspace(low, high, 4001)[:, None]
    displacement, load = requirement.path
    inertial = (
        requirement.mass
        * (0.5 * requirement.stroke - displacement)
        * (2 * math.pi / SIX_BAR.cycle_time) ** 2
    )
    contraction = starts + displacement / length
    inside = contraction[:, -1] <= high
    strong = muscle.capacity(contraction) >= 1.5 * np.maximum(load, load + inertial) / count
    fits = strong & (muscle.floor(contraction) <= np.minimum(load, load + inertial) / count)
    return bool((fits.all(axis=1) & inside).any())


@pytest.mark.parametrize("requirement", [LIFT, SPRING, FALLING])
@pytest.mark.parametrize(
    "entry",
    [am.load("dmsp-10-250"), am.load("dmsp-20-300"), effective_length()],
    ids=lambda e: e.name,
)
def test_no_shorter_muscle_meets_the_requirement(entry: Entry, requirement: LiftRequirement):
    length = choose(entry, requirement, SIX_BAR).length
    assert some_mounting_suffices(entry, requirement, length * 1.002)
    assert not any(
        some_mounting_suffices(entry, requirement, length * part) for part in (0.999, 0.97, 0.8)
    )


def test_no_shorter_muscle_holds_the_torque_of_a_joint():
    strong = dataclasses.replace(JOINT, torque=20.0)
    choice = choose(am.load("dmsp-20-300"), strong, SIX_BAR)
    muscle = choice.muscle
    eps = np.linspace(*muscle.contraction_range, 1501)
    arms = (
        np.maximum(eps - eps[:, None], 0.0) * 0.999 * choice.length / JOINT.angle
    )  # rows: extended
    torque = arms * (muscle.capacity(eps) - muscle.floor(eps)[:, None])
    assert torque.max() < 1.5 * strong.torque
    assert torque.max() == pytest.approx(0.999 * 1.5 * strong.torque, rel=1e-3)


@pytest.mark.parametrize("name", ["dmsp-10-250", "dmsp-20-300", "festo-tool-dmsp-40"])
@pytest.mark.parametrize("torque", [0.05, 2.0, 20.0])
@pytest.mark.parametrize("count", [1, 2])
def test_the_muscles_on_both_sides_of_a_pulley_do_not_touch(name: str, torque: float, count: int):
    choice = choose(am.load(name), dataclasses.replace(JOINT, torque=torque), SIX_BAR, count)
    nominal = choice.entry.ratings.diameter
    thickest = choice.diameter if choice.entry.geometry is not None else 1.75 * nominal
    assert 2 * choice.design.radius >= 1.1 * thickest * (1 - 1e-3)
    assert choice.length >= 3 * nominal
    muscle = choice.muscle
    eps = np.linspace(*choice.muscle.contraction_range, 801)
    radius = (eps - eps[:, None]) * 0.99 * choice.length / JOINT.angle  # rows: extended
    loads = count * np.maximum(radius, 0.0) * (muscle.capacity(eps) - muscle.floor(eps)[:, None])
    room = 2 * radius >= 1.1 * muscle.outer_diameter(eps)
    assert (
        choice.length == 3 * nominal or not (room & (loads >= 1.5 * torque)).any()
    )  # none is shorter


def test_where_the_pulley_decides_the_muscles_are_as_close_as_permitted():
    choice = choose(am.load("dmsp-20-300"), dataclasses.replace(JOINT, torque=0.05), SIX_BAR)
    assert 2 * choice.design.radius == pytest.approx(
        1.1 * choice.diameter, rel=2e-3
    )  # the outline has 33 points


def test_the_radii_of_a_longer_muscle_are_those_with_which_it_meets_the_requirement():
    requirement = dataclasses.replace(JOINT, torque=20.0)
    choice = choose(am.load("dmsp-20-300"), requirement, SIX_BAR)
    muscle = choice.muscle
    eps = np.linspace(*choice.muscle.contraction_range, 1201)
    radius = (eps - eps[:, None]) * 1.1 * choice.length / JOINT.angle  # rows: extended
    inertial = requirement.acceleration_torque(SIX_BAR.cycle_time)
    enough = radius * (muscle.capacity(eps) - muscle.floor(eps)[:, None]) >= 1.5 * 20.0
    enough &= radius * (muscle.capacity(eps)[:, None] - muscle.floor(eps)) >= 1.5 * (
        20.0 + inertial
    )
    possible = radius[enough & (2 * radius >= 1.1 * muscle.outer_diameter(eps))]
    step = 2 * 1.1 * choice.length / JOINT.angle * np.ptp(eps) / 128  # of the grid of the search
    assert choice.design.radii[0] == pytest.approx(possible.min(), abs=step)
    assert choice.design.radii[1] == pytest.approx(possible.max(), abs=step)
    used = np.array(choice.design.radii) * JOINT.angle / (1.1 * choice.length)
    assert used * 128 / np.ptp(eps) == pytest.approx(
        np.round(used * 128 / np.ptp(eps)), abs=1e-6
    )  # of that length


@pytest.mark.parametrize(("torque", "inertia", "deciding"), [(0.3, 0.0, 0), (0.1, 2.0, 1)])
def test_the_reserve_of_a_joint_is_that_of_the_end_with_less(
    torque: float, inertia: float, deciding: int
):
    requirement = dataclasses.replace(JOINT, torque=torque, inertia=inertia)
    choice = choose(
        am.load("dmsp-20-300"), requirement, SIX_BAR
    )  # longer than the torques need: the pulley decides
    rest = choice.design.extended
    pulling = choice.design.contracted
    arm = choice.design.radius
    full = [
        force(choice, choice.muscle.pressure_range[1], point.contraction)
        for point in (pulling, rest)
    ]
    least = [
        max(force(choice, choice.muscle.pressure_range[0], each.contraction), 0.0)
        for each in (rest, pulling)
    ]
    needed = torque, torque + inertia * 0.5 * JOINT.angle * (2 * math.pi / SIX_BAR.cycle_time) ** 2
    factors = [
        arm * (high - low) / each for high, low, each in zip(full, least, needed, strict=True)
    ]
    assert np.argmin(factors) == deciding
    assert factors[deciding] > 1.59
    assert factors[1 - deciding] > 1.2 * factors[deciding]
    assert choice.design.reserve == pytest.approx(factors[deciding] - 1.0, rel=1e-9)


def test_a_pulley_without_room_for_the_muscles_states_the_radius_that_is_needed():
    small = dataclasses.replace(JOINT, torque=0.1)
    with pytest.raises(
        SolveError, match=r"pulley has a radius of at most .* mm thick at pressure, need \S+ mm"
    ):
        choose(am.load("dmsp-20-300"), small, dataclasses.replace(SIX_BAR, max_length=0.08))


def test_the_load_of_a_fast_lift_is_accelerated_and_does_not_overshoot():
    law = am.load("dmsp-20-300")
    fast = dataclasses.replace(SIX_BAR, cycle_time=0.4)
    heavy = dataclasses.replace(LIFT, mass=63.0)
    choice = choose(law, heavy, fast)
    inertial = heavy.mass * 0.5 * heavy.stroke * (2 * math.pi / 0.4) ** 2
    assert (
        1.5 * (heavy.load(0.0) + inertial)
        <= choice.design.extended.capacity
        < 1.6 * (heavy.load(0.0) + inertial)
    )
    assert choice.design.reserve >= 0.5 - 1e-9
    with pytest.raises(
        SolveError, match=r"150\d N is needed"
    ):  # 1.5 times the load that is accelerated at the start
        choose(law, heavy, dataclasses.replace(SIX_BAR, cycle_time=0.36))
    with pytest.raises(
        SolveError, match=r"with a cycle of 0.1 s, the load pulls with -\S+ N at 40 mm.*overshoot"
    ):
        choose(law, LIFT, dataclasses.replace(SIX_BAR, cycle_time=0.1))


def test_a_requirement_states_the_load_as_it_is_given():
    assert LIFT.describe() == "20 kg (196.1 N) over 40 mm"
    assert LiftRequirement(stroke=0.04, force=200.0).describe() == "200 N over 40 mm"


def test_a_law_that_depends_on_the_length_needs_the_length_at_which_it_is_evaluated():
    entry = effective_length()
    choice = choose(entry, LIFT, SIX_BAR)
    assert (
        choice.entry.characteristic.resting_length
        == choice.length
        == choice.entry.geometry.resting_length
    )
    assert choice.length > 1.2 * choose(am.load("sarosi-dmsp-20-400n"), LIFT, SIX_BAR).length


def test_a_muscle_is_at_least_as_long_as_the_least_nominal_length():
    small = dataclasses.replace(LIFT, stroke=0.001)
    assert choose(am.load("dmsp-20-300"), small, SIX_BAR).length == 0.060  # three diameters


def test_a_law_of_one_length_is_not_scaled():
    entry = am.load("saga2007-circle")
    own = entry.geometry.resting_length
    limits = ValidityRange(0.0, 1.6e5, 0.0, 0.2)
    fixed = dataclasses.replace(entry, validity_range=limits)
    conditions = SizingConditions(supply=1.6e5)
    assert choose(fixed, LiftRequirement(stroke=0.004, force=20.0), conditions).length == own
    with pytest.raises(SolveError, match="with 72 mm"):
        choose(fixed, LiftRequirement(stroke=0.04, force=20.0), conditions)


@pytest.mark.parametrize(
    ("name", "limits"),
    [
        ("hunt2017-festo-10", None),
        ("borzikova-monotone", ValidityRange(0.5e5, 3.5e5, 0.0, 0.3)),
    ],
)
def test_a_law_that_is_not_solved_for_the_force_is_sized_by_its_own_direction(
    name: str, limits: ValidityRange | None
):
    entry = am.load(name)
    entry = entry if limits is None else dataclasses.replace(entry, validity_range=limits)
    choice = choose(entry, LiftRequirement(stroke=0.02, force=60.0), SizingConditions(supply=4e5))
    law = entry.characteristic
    for point in (choice.design.extended, choice.design.contracted):
        assert point.force == pytest.approx(60.0, rel=1e-9)
        if isinstance(law, PressureLaw):
            assert float(law.pressure(point.contraction, 60.0)) == pytest.approx(
                point.pressure, rel=1e-9
            )
        else:
            assert float(law.contraction(point.pressure, 60.0)) == pytest.approx(
                point.contraction, rel=1e-9
            )


def test_a_muscle_is_used_up_to_the_end_of_its_table():
    for stroke in np.linspace(0.05, 0.09, 9):
        choice = choose(
            am.load("festo-tool-dmsp-40"), LiftRequirement(stroke=float(stroke), mass=20.0), SIX_BAR
        )
        assert choice.design.contracted.contraction == pytest.approx(0.25, rel=1e-12)


# Number in parallel


def test_two_muscles_in_parallel_each_hold_half_the_force():
    doubled = dataclasses.replace(LIFT, mass=2 * LIFT.mass)
    one = choose(am.load("dmsp-20-300"), LIFT, SIX_BAR)
    two = choose(am.load("dmsp-20-300"), doubled, SIX_BAR, 2)
    assert two.length == pytest.approx(one.length, rel=1e-12)
    assert two.design.contracted.force == pytest.approx(one.design.contracted.force, rel=1e-12)
    assert two.air == pytest.approx(2 * one.air, rel=1e-9)
    same_load = choose(am.load("dmsp-20-300"), LIFT, SIX_BAR, 2)
    assert same_load.design.extended.force == pytest.approx(
        0.5 * one.design.extended.force, rel=1e-9
    )


def test_an_exact_number_is_the_only_one_that_is_tried():
    exact = dataclasses.replace(SIX_BAR, min_count=2, max_count=2)
    result = size_muscles(LIFT, exact, [am.load(name) for name in MUSCLES])
    assert {choice.count for choice in result.choices} == {2}
    with pytest.raises(ParameterError, match="max_count is 2; allowed range: 3 to 20"):
        dataclasses.replace(exact, min_count=3)


def test_a_load_that_decreases_over_the_stroke_takes_air_and_has_no_scenario():
    choice = choose(am.load("dmsp-20-300"), FALLING, SIX_BAR)
    assert choice.air > 0.0
    with pytest.raises(
        SolveError, match="the scenario of a load that decreases over the stroke is not written"
    ):
        scenario_text(choice)


def test_a_number_that_is_neither_shorter_nor_takes_less_air_is_left_out():
    entry = am.load("sarosi-dmsp-20-400n")
    result = size_muscles(LIFT, SIX_BAR, [entry])
    (choice,) = result.choices  # two are longer, because the least pressure limits them
    assert choice.count == 1
    assert choose(entry, LIFT, SIX_BAR, 2).length > choice.length


# Air and valves


@pytest.mark.parametrize("count", [1, 3])
def test_the_air_of_a_cycle_is_the_difference_of_mass_by_the_gas_law(count: int):
    choice = choose(am.load("dmsp-20-300"), LIFT, SIX_BAR, count)
    ambient = SIX_BAR.ambient
    geometry = choice.entry.geometry
    masses = [
        (point.pressure + ambient.pressure)
        * geometry.volume(point.contraction)
        / (GAS_CONSTANT * ambient.temperature)
        for point in (choice.design.contracted, choice.design.extended)
    ]
    assert choice.air == pytest.approx(count * (masses[0] - masses[1]), rel=1e-12)
    assert choice.reference_volume == pytest.approx(choice.air / REFERENCE_DENSITY, rel=1e-12)


def test_a_joint_takes_the_air_of_both_muscles():
    choice = choose(am.load("dmsp-20-300"), JOINT, SIX_BAR)
    path = air_path(choice)
    assert choice.air == pytest.approx(2 * (path.mass[-1] - path.mass[0]), rel=1e-12)


def test_the_efficiency_is_the_work_per_available_energy_and_less_than_one():
    choice = choose(am.load("dmsp-20-300"), LIFT, SIX_BAR)
    ratio = (6e5 + 101_325.0) / 101_325.0
    assert choice.air_energy == pytest.approx(
        choice.air * GAS_CONSTANT * 293.15 * math.log(ratio), rel=1e-12
    )
    assert 0.0 < choice.efficiency == pytest.approx(LIFT.work / choice.air_energy, rel=1e-12)
    assert choice.efficiency < 1.0


def test_a_law_without_geometry_and_product_has_no_air_and_no_diameter():
    load = LiftRequirement(stroke=0.02, force=60.0)
    choice = choose(am.load("hunt2017-festo-10"), load, SizingConditions(supply=4e5))
    unknown = (choice.air, choice.air_energy, choice.efficiency, choice.diameter, choice.area)
    assert unknown == (None,) * 5
    with pytest.raises(SolveError, match="has no geometry; valves and a scenario need it"):
        fill_valve(choice, 1.0)


def test_a_law_without_geometry_has_the_volume_of_another_law_of_its_product():
    choice = choose(am.load("festo-tool-dmsp-20"), LIFT, SIX_BAR)
    last = choice.design.contracted
    braid = dataclasses.replace(am.load("dmsp-20-300").geometry, resting_length=choice.length)
    assert choice.muscle.volume(last.pressure, last.contraction) == pytest.approx(
        float(braid.volume(last.contraction)), rel=1e-9
    )
    assert choice.geometry_source == "geometry of dmsp-20-300, another law of this product"


def test_a_valve_for_half_the_time_has_twice_the_conductance():
    choice = choose(am.load("dmsp-20-300"), LIFT, SIX_BAR)
    for size in (fill_valve, discharge_valve):
        assert size(choice, 0.5).conductance == pytest.approx(
            2 * size(choice, 1.0).conductance, rel=1e-12
        )
    with pytest.raises(
        SolveError, match=r"sonic conductance of .*; allowed range: above 0 to 1000"
    ):
        fill_valve(choice, 1e-5)


@pytest.mark.parametrize("size", [fill_valve, discharge_valve])
def test_the_quasi_static_motion_through_a_valve_takes_the_wanted_time(size):
    choice = choose(am.load("dmsp-20-300"), LIFT, SIX_BAR)
    path = air_path(choice)
    valve = size(choice, 0.7)
    pressure = PchipInterpolator(path.mass, path.pressure)
    fills = size is fill_valve

    def rate(_: float, mass):
        p = pressure(mass)
        ends = (6e5 + 101_325.0, p) if fills else (p, 101_325.0)
        return (1 if fills else -1) * valve.mass_flow(*ends, 1.0, 293.15)

    start, end = (path.mass[0], path.mass[-1]) if fills else (path.mass[-1], path.mass[0])
    moved = solve_ivp(rate, (0.0, 0.7), [start], rtol=1e-9, atol=1e-14).y[0, -1]
    assert moved == pytest.approx(end, rel=2e-3)


# Catalogue and ranking


def test_the_catalogue_has_the_muscles_whose_maker_states_permitted_values():
    entries = catalogue()
    assert all(entry.ratings is not None and not entry.warning for entry in entries)
    assert {"dmsp-10-250", "dmsp-20-300", "festo-tool-dmsp-40"} <= {entry.name for entry in entries}


@pytest.mark.parametrize("sort", [by_air, by_area, by_count, by_diameter, by_length, by_reserve])
def test_the_choices_are_ranked_by_the_criterion_and_those_without_a_value_are_last(sort):
    names = (*MUSCLES, "hunt2017-festo-10")
    load = LiftRequirement(stroke=0.02, force=60.0)
    result = size_muscles(
        load, SizingConditions(supply=4e5), [am.load(name) for name in names], sort
    )
    values = [sort(choice) for choice in result.choices]
    known = [value for value in values if value is not None]
    assert len(known) > 3
    assert values[len(known) :] == [None] * (len(values) - len(known))
    assert all(b >= a * (1 - 1e-6) for a, b in itertools.pairwise(map(abs, known))) or (
        sort is by_reserve and known == sorted(known)
    )


def test_choices_that_a_criterion_does_not_separate_are_ranked_by_number():
    """The same length of hose in one, two or three muscles: equal but for rounding."""
    result = size_muscles(JOINT, SIX_BAR, [am.load("dmsp-10-250")])
    areas = [choice.area for choice in result.choices]
    assert areas == pytest.approx([areas[0]] * 3, rel=1e-7)
    assert len(set(areas)) > 1  # so that a comparison of the numbers themselves could fail
    assert [choice.count for choice in result.choices] == [1, 2, 3]


@pytest.mark.parametrize("sort", [by_air, by_area, by_count, by_diameter, by_length, by_reserve])
def test_a_criterion_is_a_function_of_a_choice_which_it_names_where_it_receives_something_else(
    sort,
):
    with pytest.raises(
        ParameterError,
        match=f"{sort.__name__}: choice must be an instance of MuscleChoice; it is 'x'",
    ):
        sort("x")


def test_every_entry_of_the_catalogue_is_a_choice_or_has_a_reason():
    result = size_muscles(LIFT, SIX_BAR)
    used = {choice.entry.name for choice in result.choices}
    compared = {law.name for law in result.laws if law.choices}
    refused = {item.name: item.reason for item in result.unsuitable}
    assert {entry.name for entry in catalogue()} <= compared | set(refused)
    assert used <= compared
    assert not used & set(refused)
    assert refused["borzikova-monotone"].startswith("no validity range is stated")
    assert refused["shadow-20-210"] == "no law of this product is published"


def test_the_permitted_force_of_the_maker_limits_the_muscle():
    entry = am.load("festo-tool-dmsp-20")
    rated = dataclasses.replace(entry, ratings=dataclasses.replace(entry.ratings, max_force=200.0))
    with pytest.raises(SolveError, match=r"is 200 N, which the maker permits; 300.1 N is needed"):
        choose(rated, LIFT, SIX_BAR)


def test_an_outer_diameter_beyond_the_limit_is_refused():
    narrow = dataclasses.replace(SIX_BAR, max_diameter=0.02)
    assert choose(am.load("dmsp-10-250"), LIFT, narrow, 2).diameter < 0.02
    with pytest.raises(
        ParameterError, match=r"at the contracted end is .* mm; at most 20 mm is allowed"
    ):
        choose(am.load("dmsp-20-300"), LIFT, narrow)
    with pytest.raises(ParameterError, match="diameter is not known"):
        choose(am.load("hunt2017-festo-10"), LiftRequirement(stroke=0.02, force=60.0), narrow)


# Requests that cannot be met


def test_an_unreachable_load_states_the_reason_and_what_is_reachable():
    result = size_muscles(dataclasses.replace(LIFT, mass=500.0), SIX_BAR, [am.load("dmsp-20-300")])
    with pytest.raises(
        SolveError, match=r"force at 6 bar and 1.333 % is 1445 N; 2501 N is needed"
    ) as error:
        result.check_reachable()
    assert "Reachable: " in str(error.value)
    assert "3 x dmsp-20-300" in str(error.value)


def test_a_result_shows_its_choices_or_what_is_reachable():
    found, none = (
        size_muscles(dataclasses.replace(LIFT, mass=mass), SIX_BAR, (am.load("dmsp-20-300"),))
        for mass in (20.0, 500.0)
    )
    assert "The best choice is 1 x festo-dmsp-20, " in str(pickle.loads(pickle.dumps(found)))
    assert "No muscle meets the requirement" in str(none)
    assert "Reachable: " in none._repr_html_()


def test_what_is_stated_as_reachable_is_reachable_and_more_is_not():
    entry = am.load("dmsp-20-300")
    short = dataclasses.replace(SIX_BAR, max_length=0.15, max_count=1)
    with pytest.raises(SolveError, match=r"over 40 mm: dmsp-20-300: with 150 mm") as error:
        size_muscles(LIFT, short, [entry]).check_reachable()
    stroke = 1e-3 * float(
        re.search(r"196\.1 N\) over ([\d.]+) mm \(1 x dmsp-20-300", str(error.value))[1]
    )
    assert choose(entry, dataclasses.replace(LIFT, stroke=stroke), short).length <= 0.15
    with pytest.raises(SolveError):
        choose(entry, dataclasses.replace(LIFT, stroke=1.02 * stroke), short)


def test_a_stroke_that_is_too_long_states_the_contraction():
    with pytest.raises(
        SolveError, match="with 150 mm, the stroke needs a contraction of 28 %; 25 % is allowed"
    ):
        choose(am.load("dmsp-20-300"), LIFT, dataclasses.replace(SIX_BAR, max_length=0.15))


def test_a_supply_above_the_permitted_pressure_is_refused():
    with pytest.raises(
        ParameterError, match="supply pressure of 9 bar exceeds the permitted 6 bar; reduce it"
    ):
        choose(am.load("dmsp-20-300"), LIFT, SizingConditions(supply=9e5))


def test_a_supply_below_the_validity_range_is_refused():
    with pytest.raises(
        ParameterError,
        match=r"its law is valid from 3 to 6\.2 bar; the working range is 0\.1 to 2 bar",
    ):
        choose(am.load("festo-tool-dmsp-10"), LIFT, SizingConditions(supply=2e5))


def test_a_load_below_the_least_force_is_refused():
    entry = am.load("sarosi-dmsp-20-400n")
    narrow = dataclasses.replace(entry, validity_range=ValidityRange(1e5, 5e5, 0.0, 0.05))
    with pytest.raises(
        SolveError,
        match=r"the load at the start, 9.807 N, is less than the force at the least pressure",
    ):
        choose(narrow, dataclasses.replace(LIFT, mass=1.0, stroke=0.01), SIX_BAR)


def test_a_joint_beyond_the_length_states_the_torque():
    with pytest.raises(
        SolveError, match=r"with 60 mm, the torque at the ends is at most .* N m; 7.5 N m is needed"
    ):
        choose(am.load("dmsp-20-300"), JOINT, dataclasses.replace(SIX_BAR, max_length=0.06))


def test_a_joint_limited_by_its_inertia_states_the_torque_with_that_of_the_inertia():
    heavy = dataclasses.replace(JOINT, inertia=100.0)
    short = dataclasses.replace(SIX_BAR, max_length=0.15)
    torque = heavy.torque + heavy.acceleration_torque(short.cycle_time)
    with pytest.raises(SolveError, match=r"with that of the inertia") as error:
        choose(am.load("dmsp-20-300"), heavy, short)
    found = re.search(r"at most (\S+) N m; (\S+) N m is needed", str(error.value))
    assert found is not None
    reached, needed = (float(number) for number in found.groups())
    assert needed == pytest.approx(short.safety_factor * torque, rel=1e-3)
    share = reached / needed
    reduced = heavy.reduced(load=0.999 * share)
    assert choose(am.load("dmsp-20-300"), reduced, short).length <= 0.15
    with pytest.raises(SolveError):
        choose(am.load("dmsp-20-300"), heavy.reduced(load=1.001 * share), short)


@pytest.mark.parametrize(
    "make",
    [
        lambda: LiftRequirement(stroke=0.0, mass=1.0),
        lambda: LiftRequirement(stroke=-0.04, mass=1.0),
        lambda: LiftRequirement(stroke=math.nan, mass=1.0),
        lambda: LiftRequirement(stroke=0.04, mass=-1.0),
        lambda: LiftRequirement(stroke=0.04, force=math.inf),
        lambda: LiftRequirement(stroke=0.04),
        lambda: LiftRequirement(stroke=0.04, force=100.0, stiffness=-5000.0),
        lambda: LiftRequirement(stroke="40 kg", mass=1.0),
        lambda: JointRequirement(angle=0.0, torque=1.0),
        lambda: JointRequirement(angle=1.0, torque=-1.0),
        lambda: JointRequirement(angle=1.0, torque=0.0),
        lambda: JointRequirement(angle=7.0, torque=1.0),
        lambda: SizingConditions(supply=0.0),
        lambda: SizingConditions(supply=math.nan),
        lambda: SizingConditions(supply=6e5, safety_factor=1.0),
        lambda: SizingConditions(supply=6e5, cycle_time=0.0),
        lambda: SizingConditions(supply=6e5, max_count=0),
        lambda: SizingConditions(supply=6e5, max_count=True),
        lambda: SizingConditions(supply=2e4, min_pressure=3e4),
        lambda: choose(am.load("dmsp-20-300"), LIFT, SIX_BAR, 0),
        lambda: choose(am.load("dmsp-20-300"), LIFT, SIX_BAR, 1.5),
        lambda: size_muscles(LIFT, SIX_BAR, []),
        lambda: size_muscles(LIFT, SIX_BAR, ["dmsp-20-300"]),
        lambda: size_muscles("20 kg", SIX_BAR),
        lambda: size_muscles(LIFT, SIX_BAR, [am.load("dmsp-20-300")], sort="air"),
    ],
)
def test_wrong_input_is_refused_with_a_sentence(make):
    with pytest.raises(AirmuscleError) as error:
        make()
    assert re.search(
        r"allowed range|must be|give |cannot be converted|expected", str(error.value)
    ), str(error.value)


def test_a_new_muscle_of_ones_own_is_sized_as_those_of_the_library():
    law = am.load("dmsp-20-300").characteristic
    assert isinstance(law, MartensBoblan2017)
    own = Entry(
        "own",
        "A muscle of my own",
        "chosen",
        law,
        law.geometry,
        validity_range=ValidityRange(3e4, 7e5, 0.0, 0.25),
        ratings=Ratings(max_force=1200.0),
    )
    assert (
        choose(own, LIFT, SIX_BAR).length
        < choose(am.load("dmsp-20-300"), LIFT, SIX_BAR).length * 1.01
    )


def test_the_work_of_a_joint_is_the_torque_over_the_angle_in_both_directions():
    assert JOINT.work == pytest.approx(2 * 5.0 * math.radians(60.0), rel=1e-12)


def test_the_diameter_is_twice_the_largest_radius_or_that_of_a_braid_of_25_degrees():
    """Without a geometry: a braid of 25 degrees and the nominal diameter, sin(theta)/sin(25 deg)
    times as thick.
    """
    cylinder = choose(am.load("dmsp-20-300"), LIFT, SIX_BAR).muscle
    assert cylinder.diameter(0.1) == pytest.approx(
        2 * max(cylinder.entry.geometry.outline(0.1)[1]), rel=1e-12
    )
    assert cylinder.outer_diameter(np.array([0.1])) == pytest.approx(
        cylinder.diameter(0.1), rel=1e-3
    )
    table = choose(am.load("festo-tool-dmsp-40"), LIFT, SIX_BAR).muscle
    for contraction in (0.0, 0.1, 0.25):
        theta = math.acos((1.0 - contraction) * math.cos(math.radians(25.0)))
        ratio = math.sin(theta) / math.sin(math.radians(25.0))
        assert table.diameter(contraction) == pytest.approx(0.040 * ratio, rel=1e-9)


def test_the_row_of_a_choice_states_air_a_minute_and_efficiency_of_the_choice():
    choice = choose(am.load("dmsp-20-300"), LIFT, dataclasses.replace(SIX_BAR, cycle_time=3.0))
    result = SizingResult(LIFT, choice.conditions, (choice,), (), (choice.entry,))
    (table,) = [each for each in result.chapter().tables if each.name == "air"]
    row = {
        name: column.values[0]
        for name, column in table.columns.items()
        if hasattr(column, "values")
    }
    assert row["air a minute"] == pytest.approx(20 * row["air a cycle"], rel=1e-12)
    assert row["air a cycle"] == pytest.approx(choice.reference_volume, rel=1e-12)
    assert row["efficiency"] == pytest.approx(choice.efficiency, rel=1e-12)
    assert row["diameter"] == pytest.approx(choice.diameter, rel=1e-12)

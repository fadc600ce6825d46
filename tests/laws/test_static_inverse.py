"""The static inverse is the root of F(p, eps) = F for every traceable force law: the force at its
pressure is the wanted one to 1e-9 of the force range, and a force that the range cannot produce
gives the nearer limit. Of an antagonistic joint, the pressures give the wanted torque and
stiffness, and where they cannot, the torque.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from control_plants import INVERSE, JOINT, MECHANISM, MUSCLES
from hypothesis import given
from hypothesis import strategies as st

import airmuscle as am
from airmuscle.control import AntagonisticInverse, StaticFeedForward, StaticInverse
from airmuscle.core import autodiff
from airmuscle.errors import ParameterError
from airmuscle.files.library import LAWS as LAW_FILES
from airmuscle.physics import (
    CubicSpring,
    EndStop,
    ForceLaw,
    HuntCrossley,
    LinearSpring,
    Muscle,
    Ratings,
    SeriesSpring,
    ValidityRange,
    Vessel,
    as_force_law,
)
from airmuscle.physics.analysis.joint_torque import torque_functions


def force_laws():
    for name in sorted(path.stem for path in LAW_FILES.glob("*.toml")):
        entry = am.load(name)
        law = getattr(entry, "characteristic", None)
        if isinstance(law, ForceLaw) and law.traceable:
            yield name, law


LAWS = dict(force_laws())


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("name", LAWS)
def test_the_force_at_the_pressure_of_the_inverse_is_the_wanted_one(name):
    inverse = StaticInverse(LAWS[name], max_pressure=6e5)
    low, high = LAWS[name].contraction_range
    contraction = np.linspace(max(low, 0.0), 0.6 * high, 25)
    pressure = np.linspace(0.0, 6e5, 41)[:, None]
    force = inverse.force(pressure, contraction)
    rising = (np.diff(force, axis=0) > 0).all(axis=0)
    assert rising.sum() >= 5
    taut = force[:, rising]
    contractions = np.broadcast_to(contraction, force.shape)[:, rising]
    found = inverse.pressure(contractions, taut)
    assert np.abs(inverse.force(found, contractions) - taut).max() <= 1e-9 * np.abs(taut).max()


@pytest.mark.parametrize("name", LAWS)
def test_beyond_the_range_the_inverse_is_that_of_the_muscle_in_a_plant(name):
    """Stretched and slack, by numbers and as a traced expression, as which a loop compiles it."""
    law = LAWS[name]
    if law.refuses_beyond:
        pytest.skip("the law refuses what lies beyond its range")
    muscle = Muscle(
        law,
        Vessel(2e-4),
        spring=LinearSpring(500.0),
        validity_range=ValidityRange(0.5e5, 6e5, 0.0, 0.12),
        ratings=Ratings(max_force=1500.0),
    )
    inverse = StaticInverse(muscle, max_pressure=6e5)
    traced = autodiff.value_and_derivative(inverse, "pressure", 2)
    checked = 0
    for contraction in (-0.2, -0.05, -0.01, 0.13, 0.16):
        for pressure in np.linspace(0.5e5, 5.5e5, 11):
            tension = float(muscle.tension(pressure, contraction))
            if not 0.0 < tension < 1.5 * 1500.0 - 1e-6:
                continue
            solved = inverse.pressure(contraction, tension)
            assert muscle.tension(solved, contraction) == pytest.approx(tension, rel=1e-8)
            value, _ = traced(contraction, tension)
            assert value == pytest.approx(solved, rel=1e-9)
            checked += 1
    assert checked > 15
    # no pressure stretches the muscle beyond its limit
    assert inverse.pressure(-0.3, 2e4) == 6e5


@pytest.mark.parametrize("name", ["dmsp-20-300", "sarosi-dmsp-10", "tondu-lopez"])
def test_the_statics_of_a_joint_have_a_muscle_beyond_its_range_as_a_plant_has_it(name):
    """At 1 rad one muscle is stretched by 3.7 %; torque and tension are those of the plant."""
    muscles = tuple(
        dataclasses.replace(
            muscle, contractile=LAWS[name], validity_range=ValidityRange(0.5e5, 6e5, 0.0, 0.2)
        )
        for muscle in MUSCLES
    )
    mechanism = dataclasses.replace(MECHANISM, offset=0.03)
    plant = dataclasses.replace(JOINT, muscle=muscles, mechanism=mechanism)
    inverse = AntagonisticInverse(muscles, mechanism, 0.2e5, 5e5)
    lengths = [muscle.geometry.resting_length for muscle in muscles]
    contractions = mechanism.contractions({"angle": 1.0}, lengths)
    assert min(contractions) < -0.03
    pressures = (4.5e5, 1.2e5)
    tensions = [m.tension(p, c) for m, p, c in zip(muscles, pressures, contractions, strict=True)]
    assert min(tensions) > 0.0
    torque = mechanism.generalised_forces({"angle": 1.0}, tensions, lengths)["angle"]
    assert inverse.torque(*pressures, 1.0) == pytest.approx(torque, rel=1e-12)
    for limited in (True, False):
        rows = [
            function(np.array([1.0]), np.array([pressure]), "tension")[0]
            for function, pressure in zip(
                torque_functions(plant, limited=limited), pressures, strict=True
            )
        ]
        np.testing.assert_allclose(np.concatenate(rows), tensions, rtol=1e-12)


def test_a_force_beyond_the_range_gives_the_nearer_limit():
    inverse = StaticInverse(MUSCLES[0], min_pressure=1e4, max_pressure=4e5)
    assert inverse.pressure(0.1, 1e6) == 4e5
    assert inverse.pressure(0.1, -1e6) == 1e4


@pytest.mark.parametrize("contraction", [0.04, 0.12])
def test_the_inverse_of_a_muscle_includes_its_parallel_spring_and_its_end_stop(contraction):
    """In front of the stop and behind it, where the stop carries a part of the tension."""
    stop = EndStop(0.1, HuntCrossley(1e6))
    muscle = dataclasses.replace(MUSCLES[0], spring=CubicSpring(2000.0, 20.0), stop=stop)
    pressure = np.linspace(2e5, 5e5, 7)
    length = muscle.geometry.resting_length
    spring = 2000.0 * contraction * length * (1.0 + 20.0 * contraction**2)
    carried = spring + 1e6 * (max(contraction - 0.1, 0.0) * length) ** 1.5
    tension = muscle.contractile.force(pressure, contraction) - carried
    assert StaticInverse(muscle).pressure(contraction, tension) == pytest.approx(pressure, rel=1e-9)


@pytest.mark.parametrize(("named", "load"), [("", 120.0), ("load", 200.0)])
@pytest.mark.parametrize("acceleration", [-1.5, 0.0, 4.0])
def test_the_feed_forward_pressure_carries_the_load_and_accelerates_the_mass_at_the_wanted_position(
    named, load, acceleration
):
    law = StaticFeedForward(
        StaticInverse(MUSCLES[0]),
        "pressure",
        0.3,
        load=120.0,
        mass=8.0,
        offset=0.04,
        load_setpoint=named,
        acceleration_setpoint="acceleration",
    )
    pressure = law.command({"position": 0.02, "acceleration": acceleration, "load": load})[
        "pressure"
    ]
    assert MUSCLES[0].tension(pressure, 0.04 + 0.02 / 0.3) == pytest.approx(
        load + 8.0 * acceleration, rel=1e-9
    )


def test_the_inverse_of_an_approximated_law_errs_by_no_more_than_its_stated_error():
    law = am.load("saga2007").characteristic
    allowed = ValidityRange(0.5e5, 2.5e5, 0.02, 0.15)
    surrogate = as_force_law(law, allowed)
    inverse = StaticInverse(surrogate, max_pressure=3e5)
    for contraction in (0.04, 0.08, 0.12):
        for pressure in (0.8e5, 1.5e5, 2.2e5):
            force = float(law.force(pressure, contraction))
            slope = surrogate.slopes(pressure, contraction).by_pressure
            assert (
                abs(inverse.pressure(contraction, force) - pressure) <= surrogate.max_error / slope
            )


def test_the_inverse_is_traced_with_its_derivatives():
    inverse = StaticInverse(am.load("sarosi-dmsp-20-400n").characteristic)
    slope = autodiff.derivative(inverse, "pressure", 0.1, 300.0, wrt=1)
    difference = (inverse.pressure(0.1, 300.01) - inverse.pressure(0.1, 299.99)) / 0.02
    assert slope == pytest.approx(difference, rel=1e-5)


def test_what_cannot_be_inverted_is_refused():
    with pytest.raises(
        ParameterError, match=r"has no closed form\. Approximate it first: as_force_law"
    ):
        StaticInverse(untraceable())
    spring = dataclasses.replace(
        MUSCLES[0], series=SeriesSpring(2e5), damper=am.LinearDamper(200.0)
    )
    with pytest.raises(ParameterError, match="has a series spring, whose stretch"):
        StaticInverse(spring)
    with pytest.raises(ParameterError, match="min_pressure 700000 must be less than max_pressure"):
        StaticInverse(MUSCLES[0], min_pressure=7e5)


def untraceable() -> ForceLaw:
    class Opaque(ForceLaw):
        traceable = False

        def force(self, pressure, contraction):
            return pressure

    return Opaque()


@given(st.floats(-0.5, 0.5), st.floats(1.0e5, 4e5), st.floats(1.0e5, 4e5))
def test_torque_and_stiffness_of_two_pressures_give_these_pressures(angle, first, second):
    torque, stiffness = (
        float(getattr(INVERSE, name)(first, second, angle)) for name in ("torque", "stiffness")
    )
    found = INVERSE.pressures(angle, torque, stiffness)
    assert found == pytest.approx((first, second), rel=1e-8)


def test_beyond_the_range_of_stiffness_the_torque_remains():
    reached = float(INVERSE.stiffness(5e5, 5e5, 0.1))
    first, second = INVERSE.pressures(0.1, 1.0, 3.0 * reached)
    assert max(first, second) == pytest.approx(5e5)
    assert INVERSE.torque(first, second, 0.1) == pytest.approx(1.0, rel=1e-6)
    assert INVERSE.stiffness(first, second, 0.1) < 1.01 * reached


def test_a_stiffness_that_would_slacken_a_muscle_keeps_both_at_the_minimum_tension():
    """Without this limit the unclamped force law answers with a pressure at which the muscle is
    slack.
    """
    inverse = dataclasses.replace(INVERSE, min_pressure=0.0)
    first, second = inverse.pressures(0.3, 0.5, 0.0)
    lowest = inverse.slack_limits(0.3)
    lengths = [muscle.geometry.resting_length for muscle in MUSCLES]
    contractions = MECHANISM.contractions({"angle": 0.3}, lengths)
    tensions = [
        m.static_force(p, c) for m, p, c in zip(MUSCLES, (first, second), contractions, strict=True)
    ]
    assert min(tensions) == pytest.approx(inverse.min_tension, rel=1e-6)
    assert first >= lowest[0]
    assert second >= lowest[1]
    assert inverse.torque(first, second, 0.3) == pytest.approx(0.5, rel=1e-6)


def test_the_torque_that_holds_the_joint_is_that_of_the_equilibrium():
    torque = float(MECHANISM.driving_force({"angle": 0.3}, {"angular_speed": 0.0}, 0.0))
    assert torque == pytest.approx(MECHANISM.weight_torque * np.sin(0.3), rel=1e-12)
    pressures = INVERSE.pressures(0.3, torque, 8.0)
    start = am.find_equilibrium(JOINT, pressure=tuple(pressures))
    assert start["angle"] == pytest.approx(0.3, abs=1e-6)

"""Friction models: hysteretic, opposed to the motion, and passive.

The rates of each model and its force along a path agree; Dahl and Bouc-Wen agree with their closed
forms, LuGre with its Stribeck curve; stop operators satisfy their definition, Masing's rules,
closure of inner loops and wiping out. For every path, the work done against friction from the
relaxed state is not negative. All but LuGre are rate-independent.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from airmuscle.core import evaluation, leaves, nodes
from airmuscle.errors import ParameterError
from airmuscle.physics import BoucWen, Dahl, LuGre, MaxwellSlip, NoFriction, PrandtlIshlinskii
from airmuscle.physics.muscle.friction.path import stop_operators

STIFFNESSES = (4e4, 2e4, 1e4)
LIMITS = (1e-4, 4e-4, 1e-3)
SLIP = MaxwellSlip(STIFFNESSES, LIMITS)
LOPSIDED = PrandtlIshlinskii(STIFFNESSES, LIMITS, (5.0, 12.0, -8.0), (0.8, -0.5, -0.6))
DAHL = Dahl(5e4, 20.0)
BOUC_WEN = BoucWen(5e4, 20.0, 1.7, 0.8)
LUGRE = LuGre(5e4, 15.0, 5.0, 0.01, 50.0, 20.0)
RATE_INDEPENDENT = [DAHL, BOUC_WEN, SLIP, LOPSIDED]
ALL = [*RATE_INDEPENDENT, LUGRE]
EXACT_STOPS = [SLIP, LOPSIDED]
turns = st.lists(st.floats(-3e-3, 3e-3), min_size=1, max_size=8)


def name(law):
    return type(law).__name__


def path_through(ends, rows=40):
    """A path from 0 through turning points, linear between them."""
    legs = [np.linspace(a, b, rows, endpoint=False) for a, b in itertools.pairwise((0.0, *ends))]
    return np.concatenate([*legs, [ends[-1]]])


def integrated(law, ends, speed=1e-3):
    """Force and bristles at the end of a path at constant speed, by integration of the rates."""
    values = np.zeros(len(law.states))
    names = [s.name for s in law.states]
    v = 0.0
    for a, b in itertools.pairwise((0.0, *ends)):
        if a == b:
            continue
        v = speed * np.sign(b - a)

        def rates(_, z, v=v):
            return list(law.rates(dict(zip(names, z, strict=True)), v).values())

        solved = solve_ivp(
            rates, (0.0, abs(b - a) / speed), values, method="LSODA", rtol=1e-9, atol=1e-13
        )
        values = solved.y[:, -1]
    bristles = dict(zip(names, values, strict=True))
    return law.force(bristles, v), bristles


@pytest.mark.parametrize("law", EXACT_STOPS, ids=name)
def test_the_force_of_stops_is_steady_from_the_presliding_distance_on(law):
    distance = law.presliding_distance
    before, at, beyond = law.force_along(np.array([0.0, 0.98, 1.0, 5.0]) * distance)[1:]
    assert before < at == pytest.approx(beyond, rel=1e-12)


@pytest.mark.parametrize("law", [DAHL, BOUC_WEN, LUGRE], ids=name)
def test_the_presliding_distance_of_a_smooth_law_is_that_of_its_initial_stiffness_to_its_limit(law):
    distance = law.presliding_distance
    slope = law.force_along(np.array([0.0, 1e-6 * distance]))[1] / (1e-6 * distance)
    limit = law.force_along(np.linspace(0.0, 60.0 * distance, 6001))[-1]
    assert slope * distance == pytest.approx(limit, rel=1e-5)


def yielded(law, ends):
    """Bristles at the end of a path, by integration of the rates, with steps within the smallest
    transition.
    """
    names, longest = [s.name for s in law.states], 0.5 * law.transition * min(law.limits)
    z = np.zeros(len(names))
    for a, b in itertools.pairwise((0.0, *ends)):
        count = int(np.ceil(abs(b - a) / longest))
        v = np.sign(b - a)

        def rates(z, v=v):
            return np.array(
                list(law.rates(dict(zip(names, z.tolist(), strict=True)), float(v)).values())
            )

        for _ in range(count):
            h = abs(b - a) / count
            z = z + h * rates(z + 0.5 * h * rates(z))
    return z


@pytest.mark.parametrize(
    "law", [DAHL, BOUC_WEN, replace(BOUC_WEN, sharpness=6.0, unloading=3.0)], ids=repr
)
def test_the_force_along_a_path_is_the_integral_of_the_rates(law):
    ends = (1e-3, -2e-4, 3e-4, 2e-4, 9e-4, -3e-3)
    for count in range(1, len(ends) + 1):
        assert law.force_along(path_through(ends[:count]))[-1] == pytest.approx(
            integrated(law, ends[:count])[0], abs=2e-5
        )


def test_the_force_of_lugre_over_time_is_the_integral_of_its_rates():
    ends = (1e-3, -2e-4, 3e-4)
    path = path_through(ends)
    time = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(path)))]) / 5e-3
    assert LUGRE.force_along(path, time)[-1] == pytest.approx(
        integrated(LUGRE, ends, 5e-3)[0], rel=1e-6
    )
    slow = LUGRE.force_along(path, time * 1e6)
    np.testing.assert_allclose(slow, LUGRE.force_along(path), atol=1e-3)


@pytest.mark.parametrize("transition", [0.3, 0.05])
@pytest.mark.parametrize("law", EXACT_STOPS, ids=name)
@settings(max_examples=8, deadline=None)
@given(ends=st.lists(st.floats(-2e-3, 2e-3), min_size=2, max_size=5))
def test_a_gradual_stop_differs_from_the_exact_one_by_its_transition_at_most(law, transition, ends):
    """|delta - exact| <= eta Delta: the form used in a plant converges to the exact one with
    eta.
    """
    bends = yielded(replace(law, transition=transition), ends)
    exact = stop_operators(np.array([0.0, *ends]), law.limits)[-1]
    assert (np.abs(bends - exact) <= transition * np.array(law.limits) + 1e-9).all()


def test_dahl_agrees_with_its_closed_form():
    x = np.linspace(0.0, 2e-3, 50)
    np.testing.assert_allclose(
        DAHL.force_along(x), 20.0 * (1.0 - np.exp(-5e4 * x / 20.0)), rtol=1e-12
    )


def test_bouc_wen_agrees_with_its_closed_forms():
    """n = 2, sigma = 1/2 is a hyperbolic tangent from rest; n = sigma = 1 is the Dahl model; large
    n is one stop.
    """
    x = np.linspace(0.0, 2e-3, 50)
    np.testing.assert_allclose(
        BoucWen(5e4, 20.0, 2.0, 0.5).force_along(x), 20.0 * np.tanh(5e4 * x / 20.0), atol=1e-6
    )
    ends = (1e-3, -2e-4, 3e-4, -1e-3)
    path = path_through(ends)
    np.testing.assert_allclose(
        BoucWen(5e4, 20.0, 1.0, 1.0).force_along(path), DAHL.force_along(path), atol=1e-6
    )
    stop = MaxwellSlip((5e4,), (4e-4,))
    assert (
        np.abs(BoucWen(5e4, 20.0, 20.0, 0.5).force_along(path) - stop.force_along(path)).max()
        < 0.05 * 20.0
    )
    assert (
        np.abs(BoucWen(5e4, 20.0, 2.0, 0.5).force_along(path) - stop.force_along(path)).max()
        > 0.05 * 20.0
    )


@pytest.mark.parametrize("bend", [-3e-4, -1e-4, 0.0, 2e-4, 3.9e-4])
@pytest.mark.parametrize("speed", [-0.02, 0.02])
def test_a_stop_with_full_transition_is_bouc_wen_with_n_1_and_sigma_a_half(bend, speed):
    smooth = BoucWen(5e4, 20.0, 1.0, 0.5)
    one = MaxwellSlip((5e4,), (4e-4,), 1.0)
    (expected,) = smooth.rates({"bristle": bend}, speed).values()
    assert one.rates({"bristle1": bend}, speed)["bristle1"] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("speed", [-0.1, -0.005, 0.002, 0.01, 0.3])
def test_lugre_slides_along_the_stribeck_curve(speed):
    law = LUGRE
    steady = np.sign(speed) * (15.0 + 5.0 * np.exp(-((speed / 0.01) ** 2))) + 20.0 * speed
    force, bristles = integrated(law, (np.sign(speed) * 0.05,), abs(speed))
    assert force == pytest.approx(steady, rel=1e-6)
    assert law.rates(bristles, speed)["bristle"] == pytest.approx(0.0, abs=1e-6 * abs(speed))


@pytest.mark.parametrize("law", ALL, ids=name)
@given(ends=turns)
def test_friction_is_passive(law, ends):
    """The work done against friction from rest is not negative; on a closed path it is dissipated
    or stored in bristles.
    """
    path = path_through((*ends, 0.0), 400)
    time = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(path)))]) / 0.02
    force = law.force_along(path, time)
    work = np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(path))
    assert work.min(initial=0.0) >= -1e-4 * 40.0 * 1e-3


@pytest.mark.parametrize("law", ALL, ids=name)
def test_a_repeated_loop_closes_and_dissipates_work(law):
    ends = (2e-3, -2e-3) * 6
    path = path_through(ends, 400)
    force = law.force_along(path)
    before = force[-1601:-800]
    last = force[-801:]
    np.testing.assert_allclose(last, before, atol=1e-6)
    assert np.sum(0.5 * (last[1:] + last[:-1]) * np.diff(path[-801:])) > 0.03


@pytest.mark.parametrize("law", RATE_INDEPENDENT, ids=name)
@given(bend=st.floats(-1.0, 1.0), speed=st.floats(-1.0, 1.0), factor=st.floats(0.01, 100.0))
def test_the_rates_are_proportional_to_speed(law, bend, speed, factor):
    bristles = {s.name: bend * s.nominal for s in law.states}
    slow = law.rates(bristles, speed)
    fast = law.rates(bristles, factor * speed)
    assert list(fast.values()) == pytest.approx(
        [factor * r for r in slow.values()], abs=1e-13 * factor
    )
    assert law.force(bristles, speed) == law.force(bristles, 0.0)


def test_lugre_is_rate_dependent_and_declares_it():
    assert not LUGRE.rate_independent
    assert abs(integrated(LUGRE, (0.01,), 0.1)[0] - integrated(LUGRE, (0.01,), 0.001)[0]) > 1.0


@pytest.mark.parametrize("law", RATE_INDEPENDENT, ids=name)
def test_rows_between_two_turning_points_have_no_effect(law):
    ends = (1e-3, -2e-4, 3e-4, -1e-3)
    assert law.force_along(path_through(ends, 300))[-1] == pytest.approx(
        law.force_along(np.array([0.0, *ends]))[-1], abs=1e-6
    )


@given(ends=turns)
def test_a_stop_operator_satisfies_its_definition(ends):
    """|z| <= r and (dx - dz)(z - phi) >= 0 for every |phi| <= r; with the play operator P, x = E +
    P.
    """
    path = np.array([0.0, *ends])
    bends = stop_operators(path, LIMITS)
    play = np.zeros(3)
    for i, (x, bend) in enumerate(zip(path, bends, strict=True)):
        assert (np.abs(bend) <= LIMITS).all()
        play = np.maximum(x - LIMITS, np.minimum(x + LIMITS, play))
        np.testing.assert_allclose(bend + play, x, atol=1e-15)
        if i:
            slid = (x - path[i - 1]) - (bend - bends[i - 1])
            for phi in (np.array(LIMITS), -np.array(LIMITS)):
                assert (slid * (bend - phi) >= -1e-18).all()


def test_masing_unloading_is_the_first_loading_scaled_by_two():
    first = SLIP.force_along(np.linspace(0.0, 1.5e-3, 301))
    path = path_through((1.5e-3, -1.5e-3), 600)
    unloading = SLIP.force_along(path)[600:]
    np.testing.assert_allclose(
        unloading[0] - unloading,
        2.0 * np.interp(np.linspace(0, 1.5e-3, 601), np.linspace(0, 1.5e-3, 301), first),
        atol=1e-9,
    )


@pytest.mark.parametrize("law", EXACT_STOPS, ids=name)
def test_an_inner_loop_closes_and_leaves_no_memory(law):
    """At the end of an inner loop the force is that at its beginning, and continues as without the
    loop.
    """
    outer = (1.5e-3, -1e-3, 4e-4)
    inner = (0.0, 2e-4, 1e-4, 4e-4)
    assert (
        law.force_along(np.array([0.0, *outer, *inner]))[-1]
        == law.force_along(np.array([0.0, *outer]))[-1]
    )
    going_on = (9e-4, -1.4e-3)
    with_it, without = (
        law.force_along(np.array([0.0, *outer, *x, *going_on])) for x in (inner, ())
    )
    np.testing.assert_allclose(with_it[-2:], without[-2:], atol=1e-12)


def test_a_single_bristle_does_not_close_inner_loops():
    outer = (1.5e-3, -1e-3, -8e-4)
    inner = (-9e-4, -8e-4)
    for law in (DAHL, BOUC_WEN):
        ends = (
            law.force_along(np.array([0.0, *outer, *inner]))[-1],
            law.force_along(np.array([0.0, *outer]))[-1],
        )
        assert abs(ends[0] - ends[1]) > 0.1


@given(ends=st.lists(st.floats(-3e-3, 3e-3), min_size=1, max_size=6), reach=st.floats(3e-3, 6e-3))
def test_a_larger_extremum_wipes_out_the_memory(ends, reach):
    for law in EXACT_STOPS:
        after = law.force_along(np.array([0.0, *ends, reach, 1e-3]))[-1]
        assert after == pytest.approx(law.force_along(np.array([0.0, reach, 1e-3]))[-1], abs=1e-9)


def test_prandtl_ishlinskii_without_dead_zones_is_maxwell_slip_and_with_them_asymmetric():
    path = path_through((1.5e-3, -1.5e-3, 1.5e-3))
    plain = PrandtlIshlinskii(STIFFNESSES, LIMITS)
    np.testing.assert_allclose(plain.force_along(path), SLIP.force_along(path), rtol=1e-12)
    assert plain.force_along(path).max() == pytest.approx(-plain.force_along(path).min())
    u = 4.0 + 8.0 + 10.0
    assert LOPSIDED.force_along(path).max() == pytest.approx(u + 0.8 * (u - 5.0) - 0.5 * (u - 12.0))
    assert LOPSIDED.force_along(path).min() == pytest.approx(-u + 0.6 * (u - 8.0))


@pytest.mark.parametrize("law", ALL, ids=name)
def test_a_traced_model_gives_the_numbers_of_the_numeric_one(law):
    symbols = {s.name: nodes.symbol(s.name) for s in law.states}
    v = nodes.symbol("v")
    outputs = nodes.as_nodes([*law.rates(symbols, v).values(), law.force(symbols, v)])
    function = evaluation.Recorded([[*symbols.values(), v]], [outputs])
    for share, speed in itertools.product((-1.0, -0.97, 0.0, 0.4, 1.0), (-0.2, 0.0, 0.1)):
        bristles = {s.name: share * s.nominal for s in law.states}
        expected = [*law.rates(bristles, speed).values(), law.force(bristles, speed)]
        (values,) = function.at_numbers([*bristles.values(), speed])
        assert values == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("law", ALL, ids=name)
def test_the_rates_are_continuous_in_the_speed_and_vanish_at_rest(law):
    bristles = {s.name: 0.98 * s.nominal for s in law.states}
    for speed in (-1e-12, 0.0, 1e-12):
        assert list(law.rates(bristles, speed).values()) == pytest.approx(
            [0.0] * len(bristles), abs=1e-11
        )


def test_no_friction_has_no_force_and_no_state():
    assert NoFriction().states == ()
    assert not list(leaves(NoFriction()))
    assert NoFriction().force_along(np.ones(3)).tolist() == [0.0, 0.0, 0.0]


def test_unequal_lengths_and_active_dead_zones_are_errors():
    with pytest.raises(
        ParameterError,
        match=(
            "MaxwellSlip: 2 stiffnesses and 1 limits; give one stiffness and one limit per element"
        ),
    ):
        MaxwellSlip((1.0, 2.0), (1e-3,))
    with pytest.raises(
        ParameterError,
        match=r"deflection limit of each element\) is 25 m; allowed range: 1e-09 to 1 m",
    ):
        MaxwellSlip((2e4,), (25.0,))
    with pytest.raises(ParameterError, match="PrandtlIshlinskii: 1 thresholds and 0 weights"):
        PrandtlIshlinskii((1.0,), (1e-3,), (5.0,))
    with pytest.raises(
        ParameterError,
        match=r"weight -0.9 at 12 N the force would decrease.*must not be less than -1",
    ):
        PrandtlIshlinskii((1.0,), (1e-3,), (5.0, 12.0), (-0.2, -0.9))
    PrandtlIshlinskii((1.0,), (1e-3,), (5.0, -12.0), (-0.2, -0.9))


def test_the_force_of_maxwell_slip_is_the_sum_of_its_springs():
    law = MaxwellSlip((2e4, 1e4), (3e-4, 1.2e-3))
    assert law.force({"bristle1": 3e-4, "bristle2": -1e-3}, 0.0) == pytest.approx(
        6.0 - 10.0, rel=1e-14
    )


@pytest.mark.parametrize("law", ALL, ids=name)
def test_a_path_without_rows_has_no_forces(law):
    none = np.array([])
    assert law.force_along(none).shape == law.force_along(none, none).shape == (0,)

"""Behind a series spring the contractile part rests where both pull alike: found by Newton's method
inside a bracket, it is what bisection finds, of numbers and of arrays, and after a few looks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joints import chosen_muscle

from airmuscle.core import autodiff, tree
from airmuscle.physics import (
    CubicSpring,
    EndStop,
    HuntCrossley,
    LinearSpring,
    SeriesSpring,
    VirtualWork,
)
from airmuscle.physics.muscle.series import find_largest_nonnegative

STOP = EndStop(0.1, HuntCrossley(1e9, 0.5))


def in_series(stiffness=2e5, **parts):
    return replace(chosen_muscle(), series=SeriesSpring(stiffness), **parts)


def bisected(muscle, p, contraction):
    """The greatest inner contractions at which the spring does not hold more than the contractile
    part pulls.
    """
    least, most = muscle.geometry.contraction_range
    length = muscle.geometry.resting_length
    here = muscle.internal_imbalance(p, contraction, contraction)
    high = np.minimum(
        np.maximum(most, contraction), contraction + here / (muscle.series.stiffness * length)
    )
    low = np.where(here < 0, np.minimum(least, contraction), contraction)
    high = np.where(here < 0, contraction, high)
    for _ in range(80):
        middle = 0.5 * (low + high)
        not_held = muscle.internal_imbalance(p, middle, contraction) >= 0
        low = np.where(not_held, middle, low)
        high = np.where(not_held, high, middle)
    return low


INSIDE = {
    "soft": in_series(2e4),
    "stiff": in_series(1e8),
    "with a stop": in_series(stop=STOP),
    "no parallel spring, a stop": in_series(spring=LinearSpring(0.0), stop=STOP),
    "a clamp that ends the pull": in_series(2e4, spring=CubicSpring(3000.0, 1e3)),
}


@pytest.mark.parametrize("muscle", INSIDE.values(), ids=INSIDE)
@pytest.mark.parametrize("p", [-2e4, 0.0, 5e4, 5e5])
def test_newtons_method_inside_finds_what_bisection_does(muscle, p):
    """Also where what is out of balance is zero on a stretch, of which the far end is meant: no
    pressure, no spring.
    """
    contractions = np.array([-0.09, -0.02, 0.0, 0.05, 0.1, 0.11, 0.25, 0.6])
    expected = bisected(muscle, p, contractions)
    together = muscle.steady_state(p, contractions)["inner_contraction"]
    np.testing.assert_allclose(together, expected, rtol=0.0, atol=1e-13)
    alone = [muscle.steady_state(p, float(c))["inner_contraction"] for c in contractions]
    assert all(isinstance(inner, float) for inner in alone)
    np.testing.assert_allclose(alone, expected, rtol=0.0, atol=1e-13)


def test_a_law_that_is_not_closed_form_settles_too():
    class Opaque(VirtualWork):
        traceable = False

    muscle = in_series(2e4)
    opaque = replace(muscle, contractile=Opaque(muscle.geometry))
    usual = replace(muscle, contractile=VirtualWork(muscle.geometry))
    for contraction in (-0.05, 0.1, 0.5):
        assert opaque.steady_state(2e5, contraction)["inner_contraction"] == pytest.approx(
            usual.steady_state(2e5, contraction)["inner_contraction"], abs=1e-14
        )


def test_inside_it_settles_in_a_few_looks(monkeypatch):
    """It took fifty, and a thousand where the spring is slack at no pressure."""
    looks = []
    traced = autodiff.value_and_derivative

    def counted(*given, **named):
        function = traced(*given, **named)
        return lambda *arguments: looks.append(1) or function(*arguments)

    monkeypatch.setattr("airmuscle.physics.muscle.muscle.autodiff.value_and_derivative", counted)
    for muscle in INSIDE.values():
        for p in (0.0, 2e5):
            for contraction in (-0.02, 0.0, 0.05, 0.2):
                looks.clear()
                muscle.steady_state(p, contraction)
                flat = (
                    muscle.spring == LinearSpring(0.0) and p == 0.0
                )  # no slope leads to the end of a stretch at zero
                assert len(looks) <= (70 if flat else 20)


def test_a_search_that_newtons_method_only_creeps_to_is_halved():
    """Of -(x - a)^9 every step of Newton's leaves eight ninths of the way, of which 300 would be
    needed.
    """
    looks = []

    def function(x):
        looks.append(1)
        return -((x - 0.3) ** 9), -9.0 * (x - 0.3) ** 8

    zero = np.array([0.0, -0.2])
    found = find_largest_nonnegative(function, zero, zero + 1.0, zero)
    np.testing.assert_allclose(found, 0.3, rtol=0.0, atol=1e-13)
    assert len(looks) < 120


def test_of_a_stretch_at_zero_the_far_end_is_meant():
    def function(x):
        return np.maximum(0.1 - x, 0.0) - np.maximum(x - 0.2, 0.0), -1.0 * ((x < 0.1) | (x > 0.2))

    for start in (0.0, 0.15, 0.5):
        found = find_largest_nonnegative(
            function, np.array([0.0]), np.array([0.5]), np.array([start])
        )
        np.testing.assert_allclose(found, 0.2, rtol=0.0, atol=1e-14)


def test_a_table_of_muscles_settles_as_each_of_them():
    """Parameters may be arrays, one number a muscle."""
    muscle = in_series(stop=STOP)
    values = tree.flatten(muscle)
    table = values * (1.0 + 0.03 * np.random.default_rng(2).uniform(-1, 1, (4, values.size)))
    columns = tree.unflatten(muscle, [column[:, None] for column in table.T])
    contractions = np.array([[0.0, 0.05, 0.2]])
    together = columns.steady_state(2e5, contractions + np.zeros((4, 1)))["inner_contraction"]
    for row, inner in zip(table, together, strict=True):
        one = tree.with_parameters(muscle, row.tolist())
        expected = [one.steady_state(2e5, c)["inner_contraction"] for c in contractions[0]]
        np.testing.assert_allclose(inner, expected, rtol=0.0, atol=1e-14)


def test_a_value_comes_with_its_exact_slope_for_numbers_arrays_and_tables_of_parameters():
    braid = chosen_muscle().geometry
    both = autodiff.value_and_derivative(braid, "volume", 1)
    x = np.linspace(0.0, 0.3, 7)
    value, slope = both(0.1)
    assert (value, slope) == pytest.approx(
        (braid.volume(0.1), braid.volume_derivative(0.1)), rel=1e-14
    )
    values, slopes = both(x.reshape(7, 1))
    assert values.shape == slopes.shape == (7, 1)
    np.testing.assert_allclose(values[:, 0], braid.volume(x), rtol=1e-14)
    np.testing.assert_allclose(
        slopes[:, 0], [braid.volume_derivative(float(c)) for c in x], rtol=1e-14
    )
    radii = np.array([[0.01], [0.02]])
    table = tree.unflatten(braid, [radii, *tree.flatten(braid)[1:].tolist()])
    values, slopes = autodiff.value_and_derivative(table, "volume", 1)(x)
    np.testing.assert_allclose(values, (radii / 0.01) ** 2 * braid.volume(x), rtol=1e-14)
    np.testing.assert_allclose(slopes, (radii / 0.01) ** 2 * braid.volume_derivative(x), rtol=1e-14)
    np.testing.assert_allclose(table.volume_derivative(x), slopes, rtol=1e-14)

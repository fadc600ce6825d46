"""Formulas of walls, cylinders and ratings against their definitions, and the search behind a
series spring.

The wall that swells follows its sigmoid from zero at ambient pressure; a cylindrical outline
encloses the volume of its geometry; the contraction behind a series spring is found in a few Newton
steps where the derivative is known, and to the resolution of a bisection where it is not.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from airmuscle.physics import Braid, Ratings, SwellingWall, TabulatedGeometry, Vessel
from airmuscle.physics.muscle.geometry import as_polynomial
from airmuscle.physics.muscle.series import find_largest_nonnegative

BRAID = Braid(0.01, 0.4363, 0.2)
POLYNOMIAL = as_polynomial(BRAID, 4, (-0.05, 0.3))
CYLINDERS = [
    BRAID,
    POLYNOMIAL,
    TabulatedGeometry((0.0, 0.1, 0.3), (6e-5, 9e-5, 1.2e-4), 0.2),
    Vessel(2e-4, 0.2),
]


@pytest.mark.parametrize("pressure", [-9e4, 0.0, 1.2e5, 2e5, 3.7e5, 5e6])
def test_a_swelling_wall_follows_a_sigmoid_that_is_zero_at_ambient_pressure(pressure: float):
    wall = SwellingWall(4e-5, 2e5, 3e4, 0.05)
    grown = 1.0 / (1.0 + math.exp(-(pressure - 2e5) / 3e4)) - 1.0 / (1.0 + math.exp(2e5 / 3e4))
    assert wall.steady_volume(pressure) == pytest.approx(4e-5 * grown, rel=1e-12, abs=1e-20)
    rate = wall.rates({"wall_volume": 1e-6}, pressure)["wall_volume"]
    assert rate == pytest.approx((4e-5 * grown - 1e-6) / 0.05)


def evaluations(function, high: float = 1.0) -> tuple[float, int]:
    """The largest x from 0 to `high` at which a function is not negative, and the number of its
    evaluations.
    """
    count = 0

    def counted(x):
        nonlocal count
        count += 1
        return function(x)

    zero = np.zeros(2)
    return float(find_largest_nonnegative(counted, zero, zero + high, zero)[0]), count


def test_the_search_behind_a_series_spring_converges_as_newtons_method():
    root, count = evaluations(lambda x: (np.cos(x) - x**3, -np.sin(x) - 3 * x**2))
    assert root == pytest.approx(0.8654740331016144, abs=2e-15)
    assert count <= 10


def test_the_search_is_safeguarded_where_newtons_method_overshoots():
    root, count = evaluations(
        lambda x: (-np.arctan(50 * (x - 0.3)), -50 / (1 + (50 * (x - 0.3)) ** 2))
    )
    assert root == pytest.approx(0.3, abs=2e-15)
    assert count <= 12


def test_the_search_without_a_derivative_halves_its_bracket():
    root, count = evaluations(lambda x: (np.cos(x) - x**3, np.full(np.shape(x), np.nan)))
    assert root == pytest.approx(0.8654740331016144, abs=2e-15)
    assert count <= 55


def test_the_search_ends_at_the_upper_end_of_a_plateau_at_zero():
    root, _ = evaluations(lambda x: (np.where(x > 0.4, 0.4 - x, 0.0), np.where(x > 0.4, -1.0, 0.0)))
    assert root == pytest.approx(0.4, abs=2e-15)


def test_a_rated_limit_allows_for_rounding_on_both_sides_and_has_no_negative_zero():
    rated = Ratings(min_length=0.04, max_length=9.0, max_contraction=0.25, max_prestretch=0.0)
    assert (
        rated.excesses(length=0.04 * (1 - 5e-10)) == rated.excesses(length=9.0 * (1 + 5e-10)) == ()
    )
    assert (
        len(rated.excesses(length=0.04 * (1 - 2e-9)))
        == len(rated.excesses(length=9.0 * (1 + 2e-9)))
        == 1
    )
    assert rated.excesses(contraction=0.3)[0].endswith("allowed range: 0 to 25 %")


@pytest.mark.parametrize("geometry", CYLINDERS, ids=lambda g: type(g).__name__)
@pytest.mark.parametrize("contraction", [0.0, 0.23])
def test_the_outline_of_a_cylinder_has_its_length_and_encloses_its_volume(
    geometry, contraction: float
):
    axial, radius = geometry.outline(contraction, 5)
    length = 0.2 * (1.0 - contraction)
    assert axial.tolist() == pytest.approx([-length / 2, -length / 4, 0.0, length / 4, length / 2])
    assert np.pi * radius**2 * length == pytest.approx(np.full(5, geometry.volume(contraction)))


def test_a_polynomial_volume_is_that_of_its_geometry_and_goes_on_along_its_tangents():
    inside = np.linspace(-0.05, 0.3, 8)
    assert POLYNOMIAL.volume(inside) == pytest.approx(BRAID.volume(inside), rel=1e-12)
    assert POLYNOMIAL.volume_derivative(inside[1:-1]) == pytest.approx(
        BRAID.volume_derivative(inside[1:-1]), rel=1e-10
    )
    for end, sign in ((-0.05, -1.0), (0.3, 1.0)):
        beyond = BRAID.volume(end) + sign * 0.02 * BRAID.volume_derivative(end)
        assert POLYNOMIAL.volume(end + sign * 0.02) == pytest.approx(beyond, rel=1e-10)


def test_a_braid_ends_with_straight_threads():
    assert BRAID.contraction_range == pytest.approx((1.0 - 1.0 / math.cos(0.4363), 1.0), rel=1e-12)
    assert BRAID.radius_at(BRAID.contraction_range[0] + 1e-12) < 1e-7
    assert BRAID.radius_at(1.0) == pytest.approx(0.01 / math.sin(0.4363))

"""Designs of experiments and distributions have their defining properties.

The quantiles of a distribution are monotonic and within its support. A grid contains each
combination once, a Latin hypercube each equiprobable interval once; a larger Monte Carlo or Sobol
design begins with the points of the smaller one; Saltelli's design exchanges one parameter at a
time. Equal seeds give equal points.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from airmuscle.design.study import (
    Grid,
    LatinHypercube,
    LevelSet,
    LogNormal,
    MonteCarlo,
    Normal,
    Range,
    Saltelli,
    Sobol,
    Triangular,
    Truncated,
    Uniform,
    Variation,
    read_difference,
    read_variation,
)
from airmuscle.errors import ParameterError
from airmuscle.files.library import Location

numbers = st.floats(-1e6, 1e6)
widths = st.floats(1e-3, 1e6)


@st.composite
def distributions(draw) -> Variation:
    low = draw(numbers)
    width = draw(widths)
    inner = draw(
        st.sampled_from(
            [
                Uniform(low, low + width),
                Normal(low, width),
                LogNormal(width, draw(st.floats(1e-3, 2.0))),
                Triangular(low, low + draw(st.floats(0, 1)) * width, low + width),
            ]
        )
    )
    middle = inner.ppf(np.array([0.2, 0.9]))
    return Truncated(inner, *middle.tolist()) if draw(st.booleans()) else inner


@settings(deadline=None)
@given(distributions(), st.lists(st.floats(1e-9, 1 - 1e-9), min_size=2, max_size=20))
def test_quantiles_are_monotonic_and_within_the_support(variation, probabilities):
    values = variation.ppf(np.sort(probabilities))
    low, high = variation.support
    assert (np.diff(values) >= 0).all()
    assert (values >= low - 1e-9 * abs(low)).all()
    assert (values <= high + 1e-9 * abs(high)).all()


@settings(deadline=None)
@given(distributions())
def test_a_truncated_distribution_keeps_the_shape_of_its_middle(variation):
    if isinstance(variation, Truncated):
        probability = variation.inner.cdf(variation.ppf(np.array([0.25, 0.5, 0.75])))
        assert (probability - 0.2) / 0.7 == pytest.approx([0.25, 0.5, 0.75], abs=1e-6)


@pytest.mark.parametrize(
    ("variation", "scipy"),
    [
        (Uniform(-2.0, 7.3), stats.uniform(-2.0, 9.3)),
        (Normal(3.0, 0.7), stats.norm(3.0, 0.7)),
        (LogNormal(2.1, 0.25), stats.lognorm(0.25, scale=2.1)),
        *(
            (Triangular(1.0, 1.0 + 5.1 * c, 6.1), stats.triang(5.1 * c / 5.1, 1.0, 5.1))
            for c in (0.0, 0.5, 1.0)
        ),
    ],
    ids=["uniform", "normal", "log-normal", "falling", "triangular", "rising"],
)
def test_distributions_are_those_of_scipy(variation, scipy):
    """Also at their ends and beyond, without a warning."""
    probabilities = np.linspace(0.0, 1.0, 99)
    values = np.linspace(-12.0, 12.0, 99)
    np.testing.assert_allclose(variation.ppf(probabilities), scipy.ppf(probabilities), rtol=4e-16)
    np.testing.assert_allclose(variation.cdf(values), scipy.cdf(values), rtol=4e-16)
    assert variation.support == scipy.support()


EVEN = (np.arange(100_000) + 0.5) / 100_000


@pytest.mark.parametrize(
    ("variation", "mean", "deviation"),
    [
        (Uniform(2.0, 8.0), 5.0, 6 / 12**0.5),
        (Normal(3.0, 0.5), 3.0, 0.5),
        (
            LogNormal(2.0, 0.25),
            2.0 * np.exp(0.25**2 / 2),
            2.0 * np.exp(0.25**2 / 2) * np.sqrt(np.expm1(0.25**2)),
        ),
        (Triangular(1.0, 2.0, 6.0), 3.0, np.sqrt((1 + 4 + 36 - 2 - 6 - 12) / 18)),
        (
            Truncated(Normal(0.0, 1.0), -1.0, 1.0),
            0.0,
            0.5395599,
        ),  # sqrt(1 - 2 phi(1) / (Phi(1) - Phi(-1)))
        (LevelSet((1.0, 2.0, 6.0)), 3.0, np.sqrt(14 / 3)),
    ],
)
def test_mean_and_standard_deviation_are_those_of_the_textbooks(variation, mean, deviation):
    values = variation.ppf(EVEN)
    assert values.mean() == pytest.approx(mean, abs=2e-4)
    assert values.std() == pytest.approx(deviation, rel=2e-3)


def test_values_have_units_and_standard_deviations_are_differences():
    place = Location("study.toml", "", None)
    found = read_variation({"model": "Normal", "mean": "6.5 bara", "std": "0.1 bara"}, "Pa", place)
    assert found.mean == pytest.approx(548675.0)
    assert found.std == pytest.approx(1e4)
    assert read_difference("5 degC", "K", "here") == pytest.approx(5.0)
    assert read_variation(["1 mm", 2e-3], "m", place) == LevelSet((0.001, 0.002))
    assert read_variation(
        {"model": "Range", "low": "0 kg", "high": "1 kg", "count": 5}, "kg", place
    ).values == (
        0.0,
        0.25,
        0.5,
        0.75,
        1.0,
    )


@settings(deadline=None)
@given(st.lists(st.integers(1, 5), min_size=1, max_size=4), st.floats(0.1, 10))
def test_a_grid_contains_each_combination_once_the_last_fastest(sizes, step):
    lists = [[step * (i + 7 * k) for i in range(size)] for k, size in enumerate(sizes)]
    values = Grid().values([LevelSet(tuple(each)) for each in lists])
    assert [tuple(row) for row in values] == list(itertools.product(*lists))


@settings(deadline=None)
@given(st.integers(1, 40), st.integers(1, 5), st.integers(0, 1000))
def test_a_latin_hypercube_contains_each_interval_once(count, variables, seed):
    values = LatinHypercube(count, seed).values([Uniform(0.0, 1.0)] * variables)
    parts = np.sort(np.floor(values * count), axis=0)
    assert (parts == np.arange(count)[:, None]).all()


@pytest.mark.parametrize("design", [MonteCarlo, Sobol])
def test_a_larger_design_begins_with_the_points_of_the_smaller_one(design):
    variations = [Normal(0.0, 1.0), Uniform(0.0, 1.0), LevelSet((1.0, 2.0))]
    assert np.array_equal(design(64, 5).values(variations)[:16], design(16, 5).values(variations))


@pytest.mark.parametrize("design", [MonteCarlo, Sobol, LatinHypercube, Saltelli])
def test_equal_seeds_give_equal_points(design):
    variations = [Uniform(0.0, 1.0)] * 2
    assert np.array_equal(design(8, 5).values(variations), design(8, 5).values(variations))
    assert not np.array_equal(design(8, 5).values(variations), design(8, 6).values(variations))


def test_sobol_points_are_balanced():
    values = Sobol(64, 1).values([Uniform(0.0, 1.0)] * 3)
    for column in values.T:
        assert sorted(np.floor(column * 64)) == list(range(64))


def test_saltelli_exchanges_one_variable_at_a_time():
    variations = [Uniform(0.0, 1.0)] * 3
    design = Saltelli(8, 2)
    table = design.values(variations).reshape(8, 5, 3)
    assert design.run_count(variations) == 40
    for a, *mixed, b in table:
        for i, row in enumerate(mixed):
            assert row[i] == b[i]
            assert np.array_equal(np.delete(row, i), np.delete(a, i))
        assert not (a == b).any()


def test_no_value_of_a_normal_distribution_is_infinite():
    assert np.isfinite(Sobol(2**12, 0).values([Normal(0.0, 1.0)] * 8)).all()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: LevelSet(()), "the list is empty"),
        (lambda: LevelSet((1.0, float("nan"))), "all values must be finite"),
        (lambda: Normal(float("inf"), 1.0), "all values must be finite"),
        (lambda: Normal(0.0, -1.0), "std is -1; it must be positive"),
        (lambda: Uniform(1.0, 1.0), "low is 1 and high is 1; low must be below high"),
        (lambda: Truncated(LevelSet((1.0,)), 0.0, 1.0), "is not a continuous distribution"),
        (lambda: Range(0.0, 0.0, 3), "two different ends"),
        (lambda: MonteCarlo(0), "count is 0; it must be at least 1"),
        (lambda: Sobol(100), "Use 64 or 128"),
        (lambda: Grid().values([LevelSet(tuple(range(2, 5000)))] * 3), "the maximum is 10000000"),
    ],
)
def test_an_invalid_design_or_distribution_is_rejected(make, message):
    with pytest.raises(ParameterError, match=message):
        make()

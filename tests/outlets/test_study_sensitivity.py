"""Sobol indices, compared with closed forms and with SciPy.

For Ishigami's function sin x1 + a sin^2 x2 + b x3^4 sin x1 on (-pi, pi)^3 they are known in closed
form (Ishigami, Homma 1990; Saltelli, Chan, Scott, Sensitivity Analysis, 2000), for a linear model
they are c_i^2 / sum c^2. The estimators agree with those of scipy.stats.sobol_indices up to
rounding.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from airmuscle.design.study import Normal, Saltelli, Uniform, sobol_indices

A = 7.0
B = 0.1
CUBE = [Uniform(-np.pi, np.pi)] * 3


def ishigami(x):
    return np.sin(x[:, 0]) + A * np.sin(x[:, 1]) ** 2 + B * x[:, 2] ** 4 * np.sin(x[:, 0])


def of_ishigami():
    """First order and total indices from the partial variances."""
    v1 = (1 + B * np.pi**4 / 5) ** 2 / 2
    v2 = A**2 / 8
    v13 = B**2 * np.pi**8 * (1 / 18 - 1 / 50)
    v = v1 + v2 + v13
    return np.array([v1, v2, 0.0]) / v, np.array([v1 + v13, v2, v13]) / v


def test_the_indices_of_ishigami():
    first, total = of_ishigami()
    found = sobol_indices(ishigami(Saltelli(2**14, 1).values(CUBE)), 3)
    assert found.first == pytest.approx(first, abs=0.002)
    assert found.total == pytest.approx(total, abs=0.002)
    assert (found.first_interval[0] < first).all()
    assert (found.first_interval[1] > first).all()
    assert (found.total_interval[0] < total).all()
    assert (found.total_interval[1] > total).all()
    assert (np.ptp(found.first_interval, axis=0) < 0.1).all()


@settings(max_examples=6)
@given(st.lists(st.floats(0.3, 3.0), min_size=2, max_size=5), st.floats(-1e6, 1e6))
def test_the_indices_of_a_linear_model(weights, offset):
    c = np.array(weights)
    x = Saltelli(1024, 3).values([Normal(0.0, 1.0)] * c.size)
    found = sobol_indices(x @ c + offset, c.size)
    assert found.first == pytest.approx(c**2 / (c**2).sum(), abs=0.04)
    assert found.total == pytest.approx(c**2 / (c**2).sum(), abs=0.04)


def test_the_estimators_agree_with_scipy():
    y = ishigami(Saltelli(256, 9).values(CUBE)) + 100.0
    table = y.reshape(-1, 5)
    runs = {"f_A": table[:, 0][None], "f_B": table[:, -1][None], "f_AB": table[:, 1:-1].T[:, None]}
    theirs = stats.sobol_indices(func=runs, n=256)
    ours = sobol_indices(y, 3)
    assert ours.first == pytest.approx(theirs.first_order, rel=1e-9, abs=1e-12)
    assert ours.total == pytest.approx(theirs.total_order, rel=1e-9)
    intervals = theirs.bootstrap(confidence_level=0.95, n_resamples=1000)
    assert np.ptp(ours.first_interval, axis=0) == pytest.approx(
        intervals.first_order.confidence_interval.high
        - intervals.first_order.confidence_interval.low,
        rel=0.2,
    )


@pytest.mark.slow
def test_the_indices_agree_with_an_independent_estimate_by_scipy():
    """For the same function, with the design and the random generator of SciPy."""
    cube = [stats.uniform(-np.pi, 2 * np.pi)] * 3
    theirs = stats.sobol_indices(func=lambda x: ishigami(x.T), n=2**13, dists=cube, random_state=7)
    ours = sobol_indices(ishigami(Saltelli(2**13, 7).values(CUBE)), 3, 7)
    assert ours.first == pytest.approx(theirs.first_order, abs=0.005)
    assert ours.total == pytest.approx(theirs.total_order, abs=0.005)


@pytest.mark.slow
def test_the_intervals_have_their_nominal_coverage():
    """With random base points, which satisfy the independence assumption of the bootstrap."""
    first, _ = of_ishigami()
    generator = np.random.default_rng(4)
    covered = []
    for _ in range(60):
        a, b = generator.uniform(-np.pi, np.pi, (2, 300, 3))
        mixed = [np.where(np.arange(3) == i, b, a) for i in range(3)]
        y = np.column_stack([ishigami(x) for x in (a, *mixed, b)]).ravel()
        low, high = sobol_indices(y, 3).first_interval
        covered.append((low <= first) & (first <= high))
    assert 0.85 < np.mean(covered) < 1.0


def test_base_points_with_a_failed_run_are_excluded():
    y = ishigami(Saltelli(1024, 1).values(CUBE))
    y[[3, 4, 77]] = np.nan  # of base points 0 and 15
    found = sobol_indices(y, 3)
    assert (found.base_points, found.excluded_points) == (1022, 2)
    without = np.delete(y.reshape(-1, 5), [0, 15], axis=0).ravel()
    assert np.array_equal(found.first, sobol_indices(without, 3).first)


@pytest.mark.parametrize("value", [0.0, 5.1, np.nan])
def test_a_constant_metric_has_no_indices(value):
    found = sobol_indices(np.full(40, value), 3)
    assert np.isnan(found.first).all()
    assert np.isnan(found.total_interval).all()


def test_equal_seeds_give_equal_intervals():
    y = ishigami(Saltelli(64, 1).values(CUBE))
    assert np.array_equal(
        sobol_indices(y, 3, 1).first_interval, sobol_indices(y, 3, 1).first_interval
    )
    assert not np.array_equal(
        sobol_indices(y, 3, 1).first_interval, sobol_indices(y, 3, 2).first_interval
    )

"""Levenberg-Marquardt within bounds ends where the sum of squares has no slope that a bound does
not hold: where SciPy's trf ends too. Starts found by Newton's method meet their conditions exactly.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from airmuscle.bench.estimation import (
    Evaluations,
    LevenbergMarquardt,
    Linearisation,
    bounded_step,
)

FREE = np.full(2, -np.inf), np.full(2, np.inf)


class OfFunction(Evaluations):
    """The sum of the squares of a function that returns residuals and Jacobian, or None."""

    def __init__(self, function):
        self.function = function

    def cost(self, x):
        self.last = self.function(x)
        with np.errstate(all="ignore"):
            return np.inf if self.last is None else float(self.last[0] @ self.last[0])

    def linearise(self):
        return Linearisation(*self.last)


def minimise(residuals, start, low, high, evaluations):
    """Unknowns, sum of squares, and whether the search has ended."""
    search = LevenbergMarquardt(OfFunction(residuals), start, low, high).run(evaluations)
    return search.x, search.cost, search.finished


def rosenbrock(x):
    """Minimum 0 at (1, 1), at the end of a curved valley."""
    return np.array([10 * (x[1] - x[0] ** 2), 1 - x[0]]), np.array(
        [[-20 * x[0], 10.0], [-1.0, 0.0]]
    )


def decay(x, t=np.linspace(0, 3, 40)):
    """Two rates that are hard to tell apart, and noise: the sum of squares does not vanish."""
    noise = 1e-2 * np.random.default_rng(1).standard_normal(t.size)
    first = np.exp(-x[0] * t)
    second = np.exp(-x[1] * t)
    measured = np.exp(-t) + np.exp(-2.5 * t) + noise
    return first + second - measured, np.column_stack([-t * first, -t * second])


def valley(x):
    """Only the sum counts: every point of a line is as good."""
    return np.array([x[0] + x[1] - 3.0, 2 * (x[0] + x[1]) - 6.5]), np.array(
        [[1.0, 1.0], [2.0, 2.0]]
    )


@pytest.mark.parametrize("begin", [(-1.2, 1.0), (3.0, -2.0), (0.1, 0.1)])
def test_a_curved_valley_is_followed_to_its_end(begin):
    found, cost, _ = minimise(rosenbrock, np.array(begin), *FREE, 200)
    np.testing.assert_allclose(found, [1.0, 1.0], atol=1e-8)
    assert cost < 1e-16


@pytest.mark.parametrize(
    ("low", "high"),
    [(-np.inf, np.inf), (0.0, 2.0), (1.2, 2.0), (0.0, 0.8)],
    ids=["free", "one", "both", "other"],
)
def test_the_optimum_is_that_of_trf(low, high):
    """With no bound, one, or both unknowns on a bound."""
    begin = np.array([1.4, 1.5]).clip(low, high)
    ends = (np.full(2, low), np.full(2, high))
    asked = []

    def counted(x):
        asked.append(x)
        return decay(x)

    found, cost, ended = minimise(counted, begin, *ends, 200)
    assert ended
    assert len(asked) <= 12
    expected = least_squares(
        lambda x: decay(x)[0],
        begin,
        lambda x: decay(x)[1],
        ends,
        ftol=1e-14,
        xtol=1e-14,
        gtol=1e-14,
    )
    np.testing.assert_allclose(found, expected.x, atol=3e-5)
    assert cost == pytest.approx(2 * expected.cost, rel=1e-8)


def test_what_is_not_determined_does_not_hinder():
    found, cost, _ = minimise(valley, np.array([5.0, -1.0]), *FREE, 100)
    assert found.sum() == pytest.approx(3.2)
    assert cost == pytest.approx(0.05)


def test_a_place_that_cannot_be_run_is_gone_round():
    """exp(x) = 1 from x = -2, where nothing beyond 0.01 can be run: a step leads to 0.017."""
    asked = []

    def residuals(x):
        asked.append(float(x[0]))
        return (np.exp(x) - 1, np.exp(x)[:, None]) if x[0] < 0.01 else None

    found, cost, _ = minimise(residuals, np.array([-2.0]), np.array([-9.0]), np.array([9.0]), 200)
    assert found[0] == pytest.approx(0.0, abs=1e-8)
    assert cost < 1e-16
    assert max(asked) > 0.01
    assert minimise(residuals, np.array([2.0]), np.array([-9.0]), np.array([9.0]), 200)[1] == np.inf


def test_no_more_is_asked_than_allowed():
    asked = []

    def counted(x):
        asked.append(x)
        return rosenbrock(x)

    assert not minimise(counted, np.array([-1.2, 1.0]), *FREE, 5)[2]
    assert len(asked) == 5


def test_what_hardly_matters_does_not_keep_the_others_from_going():
    """A step of a hundred times its size for the one unknown, of half its size for the others."""
    t = np.linspace(0.0, 1.0, 30)
    asked = []
    columns = np.column_stack([np.ones_like(t), t, 1e-4 * t**2])

    def residuals(x):
        asked.append(x)
        return columns @ (x - np.array([1.5, 0.5, 100.0])), columns

    found, _, ended = minimise(residuals, np.ones(3), np.zeros(3), np.full(3, np.inf), 60)
    assert ended
    np.testing.assert_allclose(asked[1][:2], [1.5, 0.5], atol=0.02)
    assert asked[1][2] <= 1.71
    np.testing.assert_allclose(found, [1.5, 0.5, 100.0], rtol=1e-4)


def _place(x, seed):
    """The same random numbers wherever the same place is asked again."""
    return np.random.default_rng([seed, *np.abs(x).view(np.uint64)])


@pytest.mark.parametrize("seed", range(12))
def test_jumps_of_the_sum_do_not_hinder_its_end(seed):
    """RunSplit of adaptive steps: the sum jumps by a millionth from place to place, while the
    slopes are right.
    """
    asked = []

    def jumping(x):
        errors, slopes = decay(x)
        asked.append(x)
        return errors * (1 + 1e-6 * _place(x, seed).uniform(-1, 1)), slopes

    found, _, ended = minimise(jumping, np.array([0.8, 3.0]), *FREE, 200)
    assert ended
    assert len(asked) <= 6
    np.testing.assert_allclose(
        found, minimise(decay, np.array([0.8, 3.0]), *FREE, 200)[0], atol=1e-8
    )


@pytest.mark.parametrize("seed", range(5))
def test_nor_do_jumps_of_the_place_where_it_is_least(seed):
    """Every step promises some 1e-9 of the sum, and none keeps it."""
    asked = []

    def jumping(x):
        errors, slopes = decay(x)
        asked.append(x)
        return errors + slopes @ (3e-6 * _place(x, seed).uniform(-1, 1, 2)), slopes

    assert minimise(jumping, np.array([0.8, 3.0]), *FREE, 200)[2]
    assert len(asked) <= 15


def test_a_place_much_worse_than_promised_is_not_taken_for_a_jump():
    """The last step of the search, which promises less than a millionth, finds twice the
    residuals.
    """
    asked = []

    def residuals(x):
        asked.append(x)
        errors, slopes = decay(x)
        return errors * (2 if len(asked) == 5 else 1), slopes

    found, cost, ended = minimise(residuals, np.array([0.8, 3.0]), *FREE, 200)
    assert ended
    assert len(asked) > 5
    assert cost == pytest.approx(float(decay(found)[0] @ decay(found)[0]), rel=1e-9)


def test_slopes_too_steep_to_be_squared_end_the_search():
    with np.errstate(all="ignore"):
        assert minimise(lambda x: (np.ones(2), np.full((2, 2), 1e200)), np.ones(2), *FREE, 50)[2]


def test_what_was_refused_is_not_asked_again():
    """Both unknowns stop at how far they may go, whatever the damping: a place that cannot be run
    is asked once.
    """
    asked = []

    def residuals(x):
        asked.append(tuple(x))
        return (x - 50.0, np.eye(2)) if (x < 1.6).all() else None

    assert not minimise(residuals, np.ones(2), *FREE, 12)[2]
    assert len(set(asked)) == len(asked) == 12


def test_a_step_onto_a_bound_is_the_best_within_it():
    """Of a quadratic of three unknowns: what a bound stops stands on it, and the others have no
    slope there.
    """
    rng = np.random.default_rng(3)
    a = rng.standard_normal((8, 3))
    normal = a.T @ a
    b = rng.standard_normal(8)
    gradient = a.T @ b
    orthogonal, triangle = np.linalg.qr(a)
    x = np.zeros(3)
    whole = np.linalg.solve(normal, -gradient)
    low = np.full(3, -9.0)
    high = np.full(3, 9.0)
    high[np.argmax(np.abs(whole))] = low[np.argmax(np.abs(whole))] = (
        0.3 * whole[np.argmax(np.abs(whole))]
    )
    low = np.where(whole < 0, low, -9.0)
    high = np.where(whole < 0, 9.0, high)
    found = bounded_step(triangle, orthogonal.T @ b, np.zeros(3), x, low, high)
    held = np.argmax(np.abs(whole))
    assert found[held] == pytest.approx(0.3 * whole[held])
    np.testing.assert_allclose(np.delete(gradient + normal @ found, held), 0.0, atol=1e-12)
    assert abs((gradient + normal @ found)[held]) > 0.1

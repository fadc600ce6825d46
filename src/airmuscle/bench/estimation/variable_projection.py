"""Censored least squares of a law linear in its parameters, and initial values by variable
projection.

For given values of the nonlinear parameters the linear ones follow by linear least squares. The
search therefore runs over the nonlinear parameters alone, from several initial guesses
(multi-start). The Jacobian of the projected residuals is that of the law in the nonlinear
parameters, projected onto the complement of the linear columns. References: Golub and Pereyra, SIAM
Journal on Numerical Analysis 10:413 (1973); Kaufman, BIT Numerical Mathematics 15:49 (1975).
"""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from ...core import Array
from .levenberg_marquardt import Accuracy, Evaluations, LevenbergMarquardt, Linearisation
from .problem import LeastSquaresProblem

RANK_TOLERANCE = 1e-10
"""Relative tolerance below which a singular value of the scaled design matrix counts as zero
(chosen): a parameter that is not determined within ten digits of the data is not determined."""
_INACTIVE_WEIGHT = 1e-4
"""Weight of an inactive censored row, where the uncensored rows alone do not determine all
parameters (chosen).
"""
_MAX_ITERATIONS = 200
"""Maximum number of Newton steps with censored rows; the iteration is finite and took fewer than 30
in all tests.
"""
_RCOND = 1e-13


def solve_censored_least_squares(
    problem: LeastSquaresProblem,
    jacobian: Array,
    constant: Array,
    active: npt.NDArray[np.bool_] | None = None,
) -> Array:
    """The parameters x that minimise the weighted residuals of `jacobian` (N, P) @ x + `constant`
    (N,).

    A censored row contributes only where the law violates its bound. The one-sided squares form a
    convex sum; each iteration is a Newton step, halved until the sum does not increase. Where the
    uncensored rows alone do not determine all parameters, the minimum is not unique: of all equally
    good solutions the one closest to the bounds is returned. `active` (N,) is the mask of the rows
    that count in the first step, by default all.
    """
    norms = np.linalg.norm(jacobian, axis=0)
    norms[norms == 0] = 1.0
    matrix = problem.weights[:, None] * (jacobian / norms)
    target = problem.weights * (problem.target - constant)
    if not problem.censoring.any():
        return np.asarray(np.linalg.lstsq(matrix, target, rcond=_RCOND)[0] / norms)
    inactive = 0.0 if uncensored_rank(problem, jacobian) == jacobian.shape[1] else _INACTIVE_WEIGHT

    def row_weights(scaled: Array) -> Array:
        return np.where(problem.active_rows(jacobian @ (scaled / norms) + constant), 1.0, inactive)

    def sum_of_squares(scaled: Array) -> float:
        return float(np.sum((row_weights(scaled) * (matrix @ scaled - target)) ** 2))

    weights = np.ones(len(target)) if active is None else np.where(active, 1.0, inactive)
    x = np.zeros(len(norms))
    for iteration in range(_MAX_ITERATIONS):
        counted = slice(None) if weights.all() else weights > 0
        rows = weights[counted, None] * matrix[counted]
        right = weights[counted] * target[counted]
        step = np.linalg.lstsq(rows, right, rcond=_RCOND)[0] - x
        if iteration:
            step = shortened_step(sum_of_squares, x, step, sum_of_squares(x))
        x = x + step
        previous = weights
        weights = row_weights(x)
        if np.array_equal(weights, previous):
            break
    return np.asarray(x / norms)


def shortened_step(
    sum_of_squares: Callable[[Array], float],
    x: Array,
    step: Array,
    limit: float,
    halvings: int = 30,
) -> Array:
    """The step from x, halved until the sum of squares is at most `limit`; zero where no part of it
    is short enough.
    """
    parts = (factor * step for factor in 0.5 ** np.arange(halvings))
    return next((part for part in parts if sum_of_squares(x + part) <= limit), 0.0 * step)


def uncensored_rank(problem: LeastSquaresProblem, jacobian: Array) -> int:
    """Rank of the weighted design matrix of the uncensored rows."""
    matrix = (problem.weights[:, None] * jacobian)[problem.censoring == 0]
    norms = np.linalg.norm(matrix, axis=0)
    triangle = np.linalg.qr(
        matrix / np.where(norms > 0, norms, 1.0), mode="r"
    )  # with the same singular values
    return int(np.linalg.matrix_rank(triangle, rtol=RANK_TOLERANCE))


_GUESS_COUNT = 16
_SEARCH_COUNT = 2
"""Initial guesses, with the given one, at which projected residuals are evaluated; searches from
the best (chosen).
"""
_SPREAD_FACTOR = 4.0
"""Maximum factor between an initial guess and the given value (chosen)."""
_RANGE_FRACTION = 0.01
"""Additional shift as a fraction of the range between the bounds, so that a value of zero is varied
too (chosen).
"""
_MAX_ROWS = 2000
"""Rows of the multi-start search, drawn at random of more (chosen): one search over all rows
follows.
"""


_MAX_EVALUATIONS = 60
_ACCURACY = Accuracy(1e-8, 1e-10)
"""Maximum evaluations and accuracy of a search for initial values (chosen)."""


def find_initial_values(problem: LeastSquaresProblem, multi_start: bool = True) -> Array:
    """The best free parameters by variable projection, shape (P,); the given ones where none are
    better. Without `multi_start` there is one search, from the given parameters."""
    linear = problem.is_linear_parameter
    if linear.all() or not linear.any():
        return problem.initial_values
    projection = _Projection(problem, linear)
    thinned = problem
    count = problem.target.size
    if count > _MAX_ROWS:  # drawn, as a regular choice could miss levels
        thinned = problem.rows(np.sort(np.random.default_rng(1).permutation(count)[:_MAX_ROWS]))
    best = problem.initial_values[~linear]
    low, high = problem.bounds
    if multi_start:
        preview = projection if thinned is problem else _Projection(thinned, linear)
        # The given nonlinear parameters, and random guesses around them within the bounds, with a
        # constant seed.
        random = np.random.default_rng(1)
        guesses = [best]
        bottom, top = (bound[~linear] for bound in (low, high))
        width = np.where(np.isfinite(top - bottom), top - bottom, 0.0)
        for _ in range(_GUESS_COUNT - 1):
            factor = _SPREAD_FACTOR ** random.uniform(-1, 1, best.size)
            shift = random.uniform(-1, 1, best.size)
            guesses.append(np.clip(best * factor + _RANGE_FRACTION * width * shift, bottom, top))
        guesses = sorted(guesses, key=preview.sum_of_squares)[:_SEARCH_COUNT]
        best = min((preview.search(guess) for guess in guesses), key=preview.sum_of_squares)
    if not multi_start or thinned is not problem:
        best = projection.search(best)
    values = np.clip(projection.solve(best)[0], low, high)
    after, before = (
        _sum_of_squares(problem.residuals(problem.predict(v)))
        for v in (values, problem.initial_values)
    )
    return values if after < before else problem.initial_values


class _Projection(Evaluations):
    """The sum of squares of a problem as a function of its nonlinear parameters alone."""

    def __init__(self, problem: LeastSquaresProblem, linear: npt.NDArray[np.bool_]) -> None:
        self._problem = problem
        self._linear = linear
        self._linear_indices = np.flatnonzero(linear).tolist()
        self._bounds = tuple(bound[~linear] for bound in problem.bounds)
        initial = problem.initial_values[~linear]
        self._scale = np.where(initial != 0, np.abs(initial), 1.0)
        self._last: tuple[bytes, tuple[Array, Array, Array]] | None = None
        self._active: npt.NDArray[np.bool_] | None = None
        self._x = initial

    def solve(self, nonlinear: Array) -> tuple[Array, Array, Array]:
        """All free parameters (P,), the fitted quantity (N,) and the columns of the linear
        parameters, which are NaN where the law is not finite; kept for the Jacobian at the same
        point."""
        key = nonlinear.tobytes()
        if self._last is None or self._last[0] != key:
            values = np.zeros(self._linear.size)
            values[~self._linear] = nonlinear
            constant = self._problem.predict(values)
            columns = self._problem.jacobian(values, self._linear_indices)
            finite = np.isfinite(columns).all() and np.isfinite(constant).all()
            values[self._linear] = (
                solve_censored_least_squares(self._problem, columns, constant, self._active)
                if finite
                else np.nan
            )
            modelled = columns @ values[self._linear] + constant
            self._active = self._problem.active_rows(modelled) if finite else None
            self._last = key, (values, modelled, columns)
        return self._last[1]

    def residuals(self, nonlinear: Array) -> Array:
        """Weighted residuals with the optimal linear parameters, shape (N,)."""
        return self._problem.residuals(self.solve(nonlinear)[1])

    def jacobian(self, nonlinear: Array) -> Array:
        """Derivatives of the residuals with respect to the nonlinear parameters, after Kaufman;
        shape (N, K).
        """
        values, modelled, columns = self.solve(nonlinear)
        row_weights = (self._problem.weights * self._problem.active_rows(modelled))[:, None]
        slopes = row_weights * self._problem.jacobian(
            values, np.flatnonzero(~self._linear).tolist()
        )
        if not np.isfinite(slopes).all():
            return slopes
        norms = np.linalg.norm(columns, axis=0)
        linear = row_weights * (columns / np.where(norms > 0, norms, 1.0))
        return np.asarray(slopes - linear @ np.linalg.lstsq(linear, slopes, rcond=None)[0])

    def sum_of_squares(self, nonlinear: Array) -> float:
        """Sum of the squared residuals; infinite where one is not finite."""
        return _sum_of_squares(self.residuals(nonlinear))

    def cost(self, x: Array) -> float:
        self._x = x * self._scale
        return self.sum_of_squares(self._x)

    def linearise(self) -> Linearisation:
        return Linearisation(self.residuals(self._x), self.jacobian(self._x) * self._scale)

    def search(self, start: Array) -> Array:
        """The minimum found from one initial guess, or the guess itself where the law is not
        finite.
        """
        low, high = (bound / self._scale for bound in self._bounds)
        search = LevenbergMarquardt(
            self, start / self._scale, low, high, name="initial values", accuracy=_ACCURACY
        )
        return np.asarray(search.run(_MAX_EVALUATIONS).x * self._scale)


def _sum_of_squares(residuals: Array) -> float:
    return float(residuals @ residuals) if np.isfinite(residuals).all() else np.inf

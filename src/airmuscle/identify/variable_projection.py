"""Where to start a law that is linear in some of its parameters: variable projection.

For given values of the others the linear parameters follow by least squares at once, so that the search runs over the
others alone, from several places. Reference: Golub and Pereyra, SIAM Journal on Numerical Analysis 10:413 (1973).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ..core.arrays import Array
from .censored_least_squares import solve_censored_least_squares
from .problem import FitProblem

_GUESS_COUNT = 16
"""Places at which the projected errors are looked at, the start among them (chosen)."""
_SEARCH_COUNT = 2
"""Searches, from the best of these (chosen)."""
_SPREAD_FACTOR = 4.0
"""Factor up and down by which the places lie around the start (chosen)."""
_RANGE_FRACTION = 0.01
"""Part of the range between its bounds by which a parameter is moved besides, so that a zero moves too (chosen)."""


def linear_fields(law: Any) -> tuple[str, ...]:
    """The fields, by their paths, in which a law says that it is linear."""
    named = getattr(law, "linear_in", ())
    return (named,) if isinstance(named, str) else tuple(named)


def is_linear_parameter(problem: FitProblem) -> npt.NDArray[np.bool_]:
    """Which of the free parameters stand in these fields."""
    fields = linear_fields(problem.law)
    return np.array([problem.leaves[i].path.partition("[")[0] in fields for i in problem.free], dtype=bool)


def find_initial_values(problem: FitProblem) -> Array:
    """The best free parameters by variable projection; the start itself where none is better."""
    linear = is_linear_parameter(problem)
    if linear.all() or not linear.any():
        return problem.initial_values
    projection = _Projection(problem, linear)
    places = sorted(_initial_guesses(problem, ~linear), key=projection.sum_of_squares)
    best = min((projection.search(place) for place in places[:_SEARCH_COUNT]), key=projection.sum_of_squares)
    low, high = problem.bounds
    values = np.clip(projection.complete(best), low, high)
    found, before = (_sum_of_squares(problem.residuals(problem.predict(v))) for v in (values, problem.initial_values))
    return values if found < before else problem.initial_values


class _Projection:
    """The errors of a problem as a function of its parameters that are not linear."""

    def __init__(self, problem: FitProblem, linear: npt.NDArray[np.bool_]) -> None:
        self._problem, self._linear = problem, linear
        self._bounds = tuple(bound[~linear] for bound in problem.bounds)
        self._scale = np.where(problem.initial_values[~linear] != 0, np.abs(problem.initial_values[~linear]), 1.0)

    def complete(self, others: Array) -> Array:
        """All free parameters: these, and the linear ones that go with them; NaN where the law is not finite."""
        values = np.zeros(self._linear.size)
        values[~self._linear] = others
        constant = self._problem.predict(values)
        slopes = self._problem.jacobian(values)[:, self._linear]
        finite = np.isfinite(slopes).all() and np.isfinite(constant).all()
        values[self._linear] = solve_censored_least_squares(self._problem, slopes, constant) if finite else np.nan
        return values

    def residuals(self, others: Array) -> Array:
        return self._problem.residuals(self._problem.predict(self.complete(others)))

    def sum_of_squares(self, others: Array) -> float:
        return _sum_of_squares(self.residuals(others))

    def search(self, start: Array) -> Array:
        """The least from one place, or the place itself where the search fails."""
        from scipy.optimize import least_squares

        if not np.isfinite(self.sum_of_squares(start)):
            return start
        low, high = (bound / self._scale for bound in self._bounds)
        inside = np.clip(start / self._scale, low + 1e-9, high - 1e-9)
        try:
            found = least_squares(
                lambda x: self.residuals(x * self._scale), inside, bounds=(low, high), x_scale="jac", max_nfev=60
            )
        except ValueError:  # it came where the law is not finite
            return start
        return np.asarray(found.x * self._scale)


def _initial_guesses(problem: FitProblem, chosen: npt.NDArray[np.bool_]) -> list[Array]:
    """The start and places around it, within the bounds, the same every time."""
    start = problem.initial_values[chosen]
    low, high = (bound[chosen] for bound in problem.bounds)
    random = np.random.default_rng(1)
    width = np.where(np.isfinite(high - low), high - low, 0.0)
    places = [start]
    for _ in range(_GUESS_COUNT - 1):
        factor, moved = _SPREAD_FACTOR ** random.uniform(-1, 1, start.size), random.uniform(-1, 1, start.size)
        places.append(np.clip(start * factor + _RANGE_FRACTION * width * moved, low, high))
    return places


def _sum_of_squares(errors: Array) -> float:
    return float(errors @ errors) if np.isfinite(errors).all() else np.inf

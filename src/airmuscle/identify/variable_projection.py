"""Where to start a law that is linear in some of its parameters: variable projection.

For given values of the others the linear parameters follow by least squares at once, so that the search runs over the
others alone, from several places. Reference: Golub and Pereyra, SIAM Journal on Numerical Analysis 10:413 (1973).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ..core.arrays import Array
from .censored_least_squares import least_squares_of
from .problem import FitProblem

_PLACES = 16
"""Places at which the projected errors are looked at, the start among them (chosen)."""
_SEARCHES = 2
"""Searches, from the best of these (chosen)."""
_SPREAD = 4.0
"""Factor up and down by which the places lie around the start (chosen)."""
_SHARE = 0.01
"""Part of the range between its bounds by which a parameter is moved besides, so that a zero moves too (chosen)."""


def linear_fields(law: Any) -> tuple[str, ...]:
    """The fields, by their paths, in which a law says that it is linear."""
    named = getattr(law, "linear_in", ())
    return (named,) if isinstance(named, str) else tuple(named)


def linear_leaves(problem: FitProblem) -> npt.NDArray[np.bool_]:
    """Which of the free parameters stand in these fields."""
    fields = linear_fields(problem.law)
    return np.array([problem.leaves[i].path.partition("[")[0] in fields for i in problem.free], dtype=bool)


def projected_start(problem: FitProblem) -> Array:
    """The best free parameters by variable projection; the start itself where none is better."""
    linear = linear_leaves(problem)
    if linear.all() or not linear.any():
        return problem.start
    projection = _Projection(problem, linear)
    places = sorted(_places(problem, ~linear), key=projection.squares)
    best = min((projection.searched(place) for place in places[:_SEARCHES]), key=projection.squares)
    low, high = problem.bounds
    values = np.clip(projection.completed(best), low, high)
    found, before = (_squares(problem.errors(problem.modelled(v))) for v in (values, problem.start))
    return values if found < before else problem.start


class _Projection:
    """The errors of a problem as a function of its parameters that are not linear."""

    def __init__(self, problem: FitProblem, linear: npt.NDArray[np.bool_]) -> None:
        self._problem, self._linear = problem, linear
        self._bounds = tuple(bound[~linear] for bound in problem.bounds)
        self._scale = np.where(problem.start[~linear] != 0, np.abs(problem.start[~linear]), 1.0)

    def completed(self, others: Array) -> Array:
        """All free parameters: these, and the linear ones that go with them; NaN where the law is not finite."""
        values = np.zeros(self._linear.size)
        values[~self._linear] = others
        constant = self._problem.modelled(values)
        slopes = self._problem.slopes(values)[:, self._linear]
        finite = np.isfinite(slopes).all() and np.isfinite(constant).all()
        values[self._linear] = least_squares_of(self._problem, slopes, constant) if finite else np.nan
        return values

    def errors(self, others: Array) -> Array:
        return self._problem.errors(self._problem.modelled(self.completed(others)))

    def squares(self, others: Array) -> float:
        return _squares(self.errors(others))

    def searched(self, start: Array) -> Array:
        """The least from one place, or the place itself where the search fails."""
        from scipy.optimize import least_squares

        if not np.isfinite(self.squares(start)):
            return start
        low, high = (bound / self._scale for bound in self._bounds)
        inside = np.clip(start / self._scale, low + 1e-9, high - 1e-9)
        try:
            found = least_squares(
                lambda x: self.errors(x * self._scale), inside, bounds=(low, high), x_scale="jac", max_nfev=60
            )
        except ValueError:  # it came where the law is not finite
            return start
        return np.asarray(found.x * self._scale)


def _places(problem: FitProblem, chosen: npt.NDArray[np.bool_]) -> list[Array]:
    """The start and places around it, within the bounds, the same every time."""
    start = problem.start[chosen]
    low, high = (bound[chosen] for bound in problem.bounds)
    random = np.random.default_rng(1)
    width = np.where(np.isfinite(high - low), high - low, 0.0)
    places = [start]
    for _ in range(_PLACES - 1):
        factor, moved = _SPREAD ** random.uniform(-1, 1, start.size), random.uniform(-1, 1, start.size)
        places.append(np.clip(start * factor + _SHARE * width * moved, low, high))
    return places


def _squares(errors: Array) -> float:
    return float(errors @ errors) if np.isfinite(errors).all() else np.inf

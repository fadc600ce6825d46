"""Trust-region least squares of SciPy as a watched search: it reports its evaluations and ends with
the budget.

Reference: Branch, Coleman and Li, SIAM Journal on Scientific Computing 21:1 (1999).
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from ...core import Array
from .search import goes_on

MAX_EVALUATIONS = 100
"""Evaluations for each parameter, of which a search that is not limited may use all (that of
SciPy)."""


class _BudgetSpentError(Exception):
    """Ends a search from within an evaluation."""


class _WatchedResiduals:
    """Residuals that count their evaluations and keep the values with the least sum of squares."""

    def __init__(self, name: str, residuals: Callable[..., Array], most: int) -> None:
        self._name = name
        self._residuals = residuals
        self._most = most
        self._evaluations = 0
        self._least = np.inf
        self.best: Array | None = None

    def __call__(self, values: Array, *arguments: Any) -> Array:
        if self.best is not None and not goes_on(self._name, self._evaluations / self._most):
            raise _BudgetSpentError
        self._evaluations += 1
        residuals = self._residuals(values, *arguments)
        cost = float(np.sum(np.square(residuals)))
        if self.best is None or cost < self._least:
            self._least = cost
            self.best = np.array(values, dtype=float)
        return residuals


def search_trust_region(
    name: str,
    residuals: Callable[..., Array],
    start: Any,
    **options: Any,
) -> Any:
    """The result of `scipy.optimize.least_squares` with these options; where the budget ends the
    search, that at the values with the least sum of squares.

    name  of the search, for its progress
    """
    from scipy.optimize import least_squares

    count = np.size(start)
    watched = _WatchedResiduals(name, residuals, options.get("max_nfev") or MAX_EVALUATIONS * count)
    if goes_on(name, 0.0):
        try:
            return least_squares(watched, start, **options)
        except _BudgetSpentError:
            pass
    reached = np.asarray(start, dtype=float) if watched.best is None else watched.best
    return least_squares(residuals, reached, **{**options, "max_nfev": 1})

"""How far one parameter can go if all others follow: the interval that a standard deviation only guesses at."""

from __future__ import annotations

import dataclasses

import numpy as np

from ..core.errors import IdentificationError
from .loss import LeastSquares
from .problem import FitProblem
from .result import Fit
from .solver import is_linear, solve

_HIGH_CORRELATION = 0.99
"""Correlation from which two parameters count as tied (chosen)."""
_HIGH_RELATIVE_ERROR = 0.5
"""Standard deviation, over the value, from which a parameter counts as loose (chosen)."""
_MAX_DOUBLINGS = 12
"""Steps outwards, each twice the one before: 4096 standard deviations without an end are none."""
_BISECTIONS = 18


@dataclasses.dataclass(frozen=True)
class ProfileLikelihood:
    """A parameter's interval at a level; an end that the data do not set is infinite."""

    name: str
    unit: str
    value: float
    low: float
    high: float
    level: float

    def __str__(self) -> str:
        ends = [f"{end:.6g}" if np.isfinite(end) else "no end" for end in (self.low, self.high)]
        return f"{self.name} {self.value:.6g} {self.unit}, {self.level:.0%} within {ends[0]} to {ends[1]}"


def weakly_determined(fit: Fit) -> tuple[str, ...]:
    """Parameters whose standard deviation cannot be trusted: tied to another, or loose beside their own value."""
    tied = np.abs(np.nan_to_num(fit.correlations - np.eye(len(fit.estimates)))).max(axis=1, initial=0.0)
    curved = not is_linear(fit.problem)  # else a standard deviation is exact, however large
    return tuple(
        e.name
        for e, tie in zip(fit.estimates, tied, strict=True)
        if not e.on_bound and (tie > _HIGH_CORRELATION or (curved and e.stderr > _HIGH_RELATIVE_ERROR * abs(e.value)))
    )


def profile(fit: Fit, name: str, *, level: float = 0.95) -> ProfileLikelihood:
    """The interval of one parameter by its profile likelihood (Bates and Watts (1988), Nonlinear Regression, 6.1).

    All values at which the least sum of squares over the other parameters stays below S (1 + F/(N - P)), F Fisher's
    quantile with 1 and N - P degrees of freedom. Raises IdentificationError, also for a robust fit.
    """
    from scipy.special import stdtrit

    if not isinstance(fit.loss, LeastSquares):
        raise IdentificationError("a profile needs a fit by least squares; a robust loss is no likelihood of noise.")
    estimate = fit[name]
    spare = int(np.count_nonzero(fit.censoring == 0)) - len(fit.estimates)
    if spare <= 0 or not np.isfinite(estimate.stderr):
        raise IdentificationError(f"{name} stands on a bound, or no point is to spare: it has no profile.")
    index = fit.names.index(name)
    least = _sum_of_squares(fit.problem, fit.values)
    ceiling = least * (1 + float(stdtrit(spare, 0.5 + level / 2)) ** 2 / spare)
    low, high = (_find_limit(fit, index, sign * estimate.stderr, ceiling) for sign in (-1, 1))
    return ProfileLikelihood(name, estimate.unit, estimate.value, low, high, level)


def _sum_of_squares(problem: FitProblem, values: np.ndarray) -> float:
    return float(np.sum(problem.residuals(problem.predict(values)) ** 2))


def _find_limit(fit: Fit, index: int, step: float, ceiling: float) -> float:
    """Where the profile passes the ceiling on one side; infinite where it never does, or a bound comes first."""
    problem, estimate = fit.problem, fit.estimates[index]
    leaf = problem.free[index]
    low, high = problem.leaves[leaf].declared.bounds
    others = tuple(i for i in problem.free if i != leaf)
    inside, outside = estimate.value, estimate.value
    for doubling in range(_MAX_DOUBLINGS):
        inside, outside = outside, float(np.clip(estimate.value + step * 2.0**doubling, low, high))
        if inside == outside:  # at the bound, and still no worse
            return -np.inf if step < 0 else np.inf
        if _constrained_sum_of_squares(problem, others, leaf, outside) > ceiling:
            break
    else:
        return -np.inf if step < 0 else np.inf
    for _ in range(_BISECTIONS):
        middle = (inside + outside) / 2
        above = _constrained_sum_of_squares(problem, others, leaf, middle) > ceiling
        inside, outside = (inside, middle) if above else (middle, outside)
    return (inside + outside) / 2


def _constrained_sum_of_squares(problem: FitProblem, others: tuple[int, ...], leaf: int, value: float) -> float:
    """The least sum of squares with one leaf held at a value."""
    leaves = list(problem.leaves)
    leaves[leaf] = dataclasses.replace(leaves[leaf], value=value)
    held = dataclasses.replace(problem, leaves=tuple(leaves), free=others)
    return _sum_of_squares(held, solve(held, LeastSquares()).values if others else np.zeros(0))

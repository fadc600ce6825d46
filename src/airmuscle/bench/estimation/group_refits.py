"""Refits of a law to groups of its data with other multiplicities, and the band for a member that
was left out.

The Jacobian at the fit to all rows is evaluated once; the normal matrices of the groups in its
orthonormal basis give the refits of a law that is linear in its parameters, and the first
Gauss-Newton step of any other law.

The members are specimens of a type, or records of a plant. The error of a further member at a row
is taken as normal with a variance that is common to all members, and known only from the n members
that were left out; errors of one member have one sign over many rows, so that the rows do not
count. The band is therefore that of Student's t distribution with n - 1 degrees of freedom.

A law of muscles of several lengths is a regression of the specimens by ln L_0. The error of a
specimen that is left out, at an end of the range by extrapolation, has the variance s^2/(1 - h_i),
that of a further one s^2 (1 + h), with the leverages h of the regression (Cook and Weisberg,
Residuals and Influence in Regression (1982), section 2.2).
"""

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ...core import Array
from . import least_squares_descent as steps
from .model_evidence import LEVEL, student_quantile
from .problem import LeastSquaresProblem, LeastSquaresSolution
from .variable_projection import RANK_TOLERANCE

MIN_MEMBERS = 3
"""Minimum number of specimens from which a band for others is stated (chosen): of two, each
predicts the other.
"""


def root_mean_square(errors: Sequence[float]) -> float:
    """The root mean square of the rms errors of the members, each counted once."""
    return math.sqrt(sum(error**2 for error in errors) / len(errors))


def t_quantile(degrees_of_freedom: float) -> float:
    """The quantile of Student's t distribution that bounds 95 % on both sides; that of the normal
    one for infinity.
    """
    return float(student_quantile(degrees_of_freedom, LEVEL))


def degrees_of_freedom(left_out: float, within: float, members: int) -> float:
    """Effective degrees of freedom of the variance of a further member (Satterthwaite, Biometrics
    2:110 (1946)).

    left_out  rms error of the members that were left out
    within    rms noise of the rows, whose variance comes from many rows and counts as known
    members   number of members

    The excess of the squared error, which is the variance between the members, has `members` - 1
    degrees of freedom. Infinite where there is none.
    """
    between = left_out**2 - within**2
    return math.inf if between <= 0.0 else (members - 1) * (left_out**2 / between) ** 2


def leverages(lengths: Sequence[float], at: Sequence[float]) -> Array:
    """The leverages of resting lengths `at` [m] in a regression of a quantity by ln L_0 over
    `lengths` [m], one for each specimen; shape of `at`. Of lengths that are all equal, those of a
    mean."""
    x = np.log(np.asarray(lengths))
    x0 = np.log(np.asarray(at))
    square = float(np.sum((x - x.mean()) ** 2))
    slope = (x0 - x.mean()) ** 2 / square if square > 1e-12 else np.zeros(x0.shape)
    return np.asarray(1.0 / x.size + slope)


def widening(lengths: Sequence[float], length: float) -> float:
    """The ratio of the half width at a resting length [m] to that at the geometric mean of the
    measured ones [m].
    """
    (leverage,) = leverages(lengths, [length])
    return math.sqrt((1.0 + float(leverage)) / (1.0 + 1.0 / len(lengths)))


RowIndices = npt.NDArray[np.intp]
RELATIVE_STEP = 1e-6
"""Step, in standard deviations of the residuals, at which a refit ends (chosen)."""
_RANK_MARGIN = 10.0
"""Factor between the rank tolerance and the bound of a singular value below which the exact rank is
computed.
"""
_MAX_ITERATIONS = 30
"""Maximum changes of the set of violated bounds in a linear refit; it took fewer than 10 in all
tests.
"""


class KnownMinima:
    """Parameters found for other multiplicities of the groups, with the sum of squares of each
    group. The best of them for given multiplicities is close to the minimum where the minima lie
    far apart along a valley.
    """

    def __init__(
        self, problem: LeastSquaresProblem, values: Array, group: RowIndices, count: int
    ) -> None:
        self._problem = problem
        self._group = group
        self._count = count
        self._values: list[Array] = []
        self._squares: list[Array] = []
        self.add(values)

    def add(self, values: Array) -> None:
        """Keep these parameters (P,)."""
        residuals = self._problem.residuals(self._problem.predict(values))
        self._values.append(values)
        self._squares.append(
            np.asarray(np.bincount(self._group, residuals**2, self._count), dtype=float)
        )

    def best(self, counts: Array) -> Array | None:
        """The kept parameters with the least sum of squares for these multiplicities (G,); None for
        the first.
        """
        chosen = int(np.argmin(np.stack(self._squares) @ counts))
        return self._values[chosen] if chosen else None


class GroupRefits:
    """Least-squares refits of a law, started at its fit to all rows; `group` (N,) is the group of
    each row, from 0 to `count` - 1."""

    def __init__(
        self,
        problem: LeastSquaresProblem,
        solution: LeastSquaresSolution,
        group: RowIndices,
        count: int,
    ) -> None:
        self._problem = problem
        self._solution = solution
        self._group = group
        self._linear = problem.is_linear
        self._active = problem.active_rows(solution.modelled)
        weighted = problem.weights[:, None] * solution.jacobian
        residuals = problem.residuals(solution.modelled)
        free = ~steps.held_on_bounds(problem, solution.values, weighted.T @ residuals)
        basis = steps.orthonormal_basis(weighted[self._active], free)
        self._basis = basis
        if basis is not None:
            self._rows = weighted @ basis.directions
            masked = self._rows * self._active[:, None]
            uncensored = problem.censoring == 0
            groups = [group == i for i in range(count)]
            # By group, in the basis: normal matrices, those of the uncensored rows, gradients, and
            # sums of squares.
            self._normal = np.array([rows.T @ rows for rows in (masked[own] for own in groups)])
            self._uncensored = np.array(
                [rows.T @ rows for rows in (self._rows[own & uncensored] for own in groups)]
            )
            self._gradient = np.array([masked[own].T @ residuals[own] for own in groups])
            self._squares = np.array([float(residuals[own] @ residuals[own]) for own in groups])
            self._smallest = 1.0 / float(
                np.linalg.norm(
                    basis.directions * np.linalg.norm(weighted[self._active], axis=0)[:, None], 2
                )
            )

    def refit(self, counts: Array, start: Array | None = None) -> Array | None:
        """The parameters (P,) for these multiplicities of the groups (G,); None where the refit is
        not certain.

        start  of the iteration for a law that is not linear in its parameters; by default the fit
               to all rows
        """
        if self._basis is None:
            return None
        # A lower bound of the scaled singular values shows whether the uncensored rows determine
        # all parameters.
        lowest = float(np.linalg.eigvalsh(np.tensordot(counts, self._uncensored, 1))[0])
        if not (
            lowest > steps.MIN_EIGENVALUE
            and np.sqrt(lowest) * self._smallest > _RANK_MARGIN * RANK_TOLERANCE
        ):
            return None
        normal, gradient = (
            np.tensordot(counts, part, 1) for part in (self._normal, self._gradient)
        )
        step = steps.normal_step(normal, gradient)
        if step is None:
            return None
        if self._linear:
            return self._solve_linear(counts, step, normal, gradient)
        first = (
            steps.FirstStep(self._basis, step, float(counts @ self._squares))
            if start is None
            else None
        )
        start = self._solution.values if start is None else start
        drawn = self._problem.repeated(counts[self._group])
        solution = steps.gauss_newton(drawn, start, first, RELATIVE_STEP)
        return None if solution is None else solution.values

    def _solve_linear(
        self, counts: Array, step: Array, normal: Array, gradient: Array
    ) -> Array | None:
        """Newton steps of the one-sided squares: the rows whose bound is violated are those of the
        previous step. The normal equations of the rows that are active in the fit to all rows are
        corrected for those that change.
        """
        assert self._basis is not None
        problem = self._problem
        solution = self._solution
        directions = self._basis.directions
        if not problem.censoring.any():
            return np.asarray(solution.values + directions @ step)
        repeats = counts[self._group]
        previous = self._active
        difference = problem.weights * (solution.modelled - problem.target)
        for _ in range(_MAX_ITERATIONS):
            modelled = solution.modelled + (self._rows @ step) / problem.weights
            active = problem.active_rows(modelled)
            if np.array_equal(active[repeats > 0], previous[repeats > 0]):
                return np.asarray(solution.values + directions @ step)
            changed = np.flatnonzero(active != self._active)
            rows = self._rows[changed]
            added = rows * np.where(active[changed], repeats[changed], -repeats[changed])[:, None]
            next_step = steps.normal_step(
                normal + rows.T @ added, gradient + added.T @ difference[changed]
            )
            if next_step is None:
                return None
            step = next_step
            previous = active
        return None

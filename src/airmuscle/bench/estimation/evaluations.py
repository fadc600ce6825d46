"""The sum that the search of a least-squares problem minimises: weights, censored rows, loss and
priors.
"""

from typing import Self

import numpy as np

from ...core import AirmuscleError, Array, IdentificationError
from .levenberg_marquardt import Evaluations, LevenbergMarquardt, Linearisation
from .problem import LeastSquaresProblem
from .search import Checkpoint
from .weighting import LeastSquares, Loss

_MIN_CURVATURE = 1e-3
"""Least second derivative of the loss of a residual, relative to the first (chosen): that of Huber
is zero beyond its scale, where the steps of Newton's method are then unlimited."""


class ProblemEvaluations(Evaluations):
    """The loss of the residuals of a problem, by its parameters in their coordinates."""

    def __init__(self, problem: LeastSquaresProblem, loss: Loss) -> None:
        self._problem = problem
        self._loss = loss
        self._guard = problem.guard()
        self._priors = problem.priors
        self._is_censored = bool(problem.censoring.any())
        self._bounds = problem.bounds
        empty = np.zeros(0)
        self._values = self._modelled = self._residuals = empty
        self._jacobian: Array | None = None

    @property
    def memory(self) -> tuple[float, ...]:
        return () if self._guard is None else self._guard.memory

    @memory.setter
    def memory(self, known: tuple[float, ...]) -> None:
        if self._guard is not None:
            self._guard.restore(known)

    def values(self, x: Array) -> Array:
        """The parameters [SI] of unknowns (P,), within their bounds whatever the rounding."""
        low, high = self._bounds
        return np.minimum(np.maximum(self._problem.coordinates.values(x), low), high)

    def cost(self, x: Array) -> float:
        try:
            self._evaluate(x)
        except AirmuscleError:
            return np.inf
        with np.errstate(over="ignore", invalid="ignore"):
            cost = self._loss_of(self._residuals)
            if self._priors.indices.size:
                known = self._priors.residuals(self._values)
                cost = cost + float(known @ known)
        if self._guard is not None:
            self._guard.learn(cost)
        return cost

    def _evaluate(self, x: Array) -> None:
        problem = self._problem
        self._values = self.values(x)
        self._modelled, self._jacobian = problem.evaluate(self._values, self._guard)
        if self._is_censored:
            self._residuals = problem.residuals(self._modelled)
        else:
            self._residuals = problem.weights * (self._modelled - problem.target)

    def _loss_of(self, residuals: Array) -> float:
        if isinstance(self._loss, LeastSquares):
            return float(residuals @ residuals)
        scale = self._loss.scale
        return float(scale**2 * np.sum(self._loss.rho((residuals / scale) ** 2)[0]))

    def linearise(self) -> Linearisation:
        problem = self._problem
        jacobian = self._jacobian
        if jacobian is None:
            jacobian = problem.jacobian(self._values)
        slopes = problem.coordinates.slopes(self._values)
        residuals = self._residuals
        factors = problem.weights
        if self._is_censored:
            factors = factors * problem.active_rows(self._modelled)
        jacobian = factors[:, None] * jacobian * slopes
        norms = None
        if not isinstance(self._loss, LeastSquares):
            z = (residuals / self._loss.scale) ** 2
            _, first, second = self._loss.rho(z)
            roots = np.sqrt(np.maximum(first + 2 * z * second, _MIN_CURVATURE * first))
            norms = np.linalg.norm(np.sqrt(first)[:, None] * jacobian, axis=0)
            residuals = residuals * first / roots
            jacobian = roots[:, None] * jacobian
        if self._priors.indices.size:
            known = self._priors.residuals(self._values)
            residuals = np.concatenate([residuals, known])
            jacobian = np.concatenate([jacobian, self._priors.jacobian(self._values) * slopes])
        return Linearisation(residuals, jacobian, norms)


class ProblemSearch:
    """The search for the parameters of a problem from one initial guess (P,) [SI], which can be
    interrupted and continued; within a store of results it goes on after the end of its process.
    """

    def __init__(
        self, problem: LeastSquaresProblem, loss: Loss, start: Array, name: str = ""
    ) -> None:
        self._evaluations = ProblemEvaluations(problem, loss)
        coordinates = problem.coordinates
        low, high = problem.bounds
        inside = np.clip(start, low, high)
        self._problem = problem
        self._start = inside
        unknowns = [coordinates.of(values) for values in (inside, low, high)]
        label = name or problem.name
        checkpoint = Checkpoint(__name__, (problem, loss, inside))
        self._search = LevenbergMarquardt(
            self._evaluations,
            *unknowns,
            name=label,
            accuracy=problem.accuracy,
            checkpoint=checkpoint,
        )

    def check_start(self) -> Self:
        """The search. Raises IdentificationError, with the rows, where residuals are not finite at
        its initial guess, and what the evaluation raises there."""
        if not self.cost < np.inf:
            check_finite(self._problem, self._start)
        return self

    def run(self, max_evaluations: int) -> Self:
        """Search until convergence, or until the problem was evaluated `max_evaluations` times in
        total.
        """
        self._search.run(max_evaluations)
        return self

    @property
    def values(self) -> Array:
        """The parameters reached [SI], shape (P,)."""
        return self._evaluations.values(self._search.x)

    @property
    def cost(self) -> float:
        """The sum of squares, or of the loss, of the weighted residuals and priors; infinite where
        it cannot be computed at the initial guess."""
        return self._search.cost

    @property
    def is_finished(self) -> bool:
        """Whether the search has ended."""
        return self._search.finished


def check_finite(problem: LeastSquaresProblem, values: Array) -> None:
    """Raise IdentificationError where a measured value is not finite, or the fitted quantity with
    these parameters (P,)."""
    _check_rows(problem, problem.target, "is fitted to")
    _check_rows(problem, problem.predict(values), "gives")


def _check_rows(problem: LeastSquaresProblem, rows: Array, verb: str) -> None:
    bad = ~np.isfinite(rows)
    if bad.any():
        raise IdentificationError(
            f"{problem.origin}: with its initial values {problem.name} {verb} no finite"
            f" {problem.quantity} at {np.count_nonzero(bad)} of {len(rows)} points, the first"
            f" at {problem.describe_row(int(np.argmax(bad)))}. Give other initial values, or"
            " remove points outside the range of the law.",
            cause=f"it {verb} no finite {problem.quantity} with its initial values",
        )

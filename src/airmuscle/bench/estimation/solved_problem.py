"""Solution of a least-squares problem with its uncertainty: covariance, profiles, bootstrap and
identifiability, in the same way for every kind of fit.
"""

import dataclasses
import functools

import numpy as np

from ...core import Array, check_known, check_whole
from ...engine.processes import Workers
from .identifiability import Identifiability, analyse_identifiability
from .parameter_covariance import ParameterCovariance, Runs
from .problem import LeastSquaresProblem, LeastSquaresSolution
from .profile_likelihood import profile_limits
from .resampling import resampled_values
from .statistics import Estimate, fit_statistics
from .weighting import LeastSquares, Loss


@dataclasses.dataclass(frozen=True, eq=False)
class SolvedProblem:
    """A problem with its best parameters (P,) [SI] by a loss."""

    problem: LeastSquaresProblem
    values: Array
    loss: Loss = LeastSquares()
    runs: Runs | None = None
    """Groups of rows between which errors are independent; by default those of the problem."""

    @functools.cached_property
    def solution(self) -> LeastSquaresSolution:
        """The fitted quantity (N,) and its Jacobian (N, P) at these parameters."""
        return self.problem.solution(self.values)

    @functools.cached_property
    def _statistics(self) -> dict[str, object]:
        return fit_statistics(self.problem, self.solution, self.loss, self._runs)

    @property
    def _runs(self) -> Runs:
        return self.problem.runs if self.runs is None else self.runs

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """The parameters with their standard errors. Raises IdentificationError where the rows do
        not separate them."""
        estimates = self._statistics["estimates"]
        assert isinstance(estimates, tuple)
        return estimates

    @property
    def covariance(self) -> ParameterCovariance:
        """Covariance of the parameters by the errors of runs. Raises IdentificationError."""
        covariance = self._statistics["parameter_covariance"]
        assert isinstance(covariance, ParameterCovariance)
        return covariance

    def profile(self, name: str, *, level: float = 0.95) -> tuple[float, float]:
        """The interval of one parameter by its profile likelihood, whose other parameters are
        fitted again; infinite where the rows do not limit it. Raises IdentificationError."""
        check_known("the problem has no parameter", name, self.problem.names, "it has")
        index = self.problem.names.index(name)
        covariance = self.covariance
        ratio = covariance.error_ratio(index, level)
        stderr = self.estimates[index].stderr
        excess = ratio**2 / covariance.spare_rows
        return profile_limits(self.problem, self.values, index, stderr, excess)

    def bootstrap(self, refits: int, *, seed: int = 0, workers: Workers = 1) -> Array:
        """The parameters (R, P) of refits to runs that are drawn with replacement; NaN where these
        do not determine them."""
        check_whole("bootstrap", "refits", refits, 1)
        _, group = np.unique(self._runs.run, return_inverse=True)
        count = int(group.max()) + 1
        shares = np.full(count, 1.0 / count)
        random = np.random.default_rng(seed)
        draws = random.multinomial(count, shares, size=refits).astype(float)
        return resampled_values(self.problem, self.values, self.loss, group, draws, workers=workers)

    @functools.cached_property
    def identifiability(self) -> Identifiability:
        """The combinations of parameters that the rows do not determine."""
        problem = self.problem
        residuals = problem.residuals(self.solution.modelled)
        freedom = max(residuals.size - self.values.size, 1)
        spread = float(np.sqrt(np.sum(residuals**2) / freedom)) or 1e-12
        sensitivities = problem.weights[:, None] * self.solution.jacobian
        is_zero = self.values == 0.0
        magnitudes = np.where(is_zero, problem.coordinates.sizes, np.abs(self.values))
        return analyse_identifiability(sensitivities, problem.names, magnitudes, spread)

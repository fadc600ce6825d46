"""How well the data determine the parameters of a fit: rank, condition, standard deviations, correlations."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from ..core.arrays import Array
from ..core.errors import IdentificationError
from .censored_least_squares import RANK_TOLERANCE, uncensored_rank
from .loss import Loss
from .problem import FitProblem
from .solver import Solution


@dataclasses.dataclass(frozen=True, eq=False)
class FitStatistics:
    """What the design at the solution says; parameters on a bound have no deviation (NaN)."""

    rank: int
    uncensored_rank: int
    """Rank without the rows that are cut off."""
    condition: float
    """Greatest over least singular value of the design, its columns brought to length 1."""
    sigma: float
    """Standard deviation of the errors, in the unit of the fitted quantity; NaN without spare points."""
    standard_errors: Array
    correlations: Array
    on_bound: npt.NDArray[np.bool_]


def compute_statistics(problem: FitProblem, solution: Solution, loss: Loss) -> FitStatistics:
    """Statistics of a solution. Raises IdentificationError where parameters cannot be told apart."""
    values, modelled, slopes = solution
    on_bound = _on_bound(problem, values)
    counting = problem.active_rows(modelled)
    matrix = problem.weights[counting, None] * slopes[np.ix_(counting, ~on_bound)]
    errors = problem.residuals(modelled)[counting]
    norms = np.linalg.norm(matrix, axis=0)
    even = matrix / np.where(norms > 0, norms, 1.0)
    # R of the QR factors has the singular values and directions of the tall design, and is quicker to take apart
    triangle = np.linalg.qr(even, mode="r")
    _, singular, directions = np.linalg.svd(
        np.vstack([triangle, np.zeros((even.shape[1] - len(triangle), even.shape[1]))])
    )
    lost = singular <= RANK_TOLERANCE * singular[0] if singular.size else np.zeros(0, dtype=bool)
    if lost.any():
        shares = np.sqrt(np.sum(directions[lost] ** 2, axis=0))
        raise IdentificationError(_rank_deficiency_message(problem, ~on_bound, shares, int(np.count_nonzero(~lost))))
    scatter = _residual_std(errors, even.shape[1], loss)
    inverse = (directions.T / singular**2) @ directions
    lengths = np.sqrt(np.diag(inverse))
    deviations, correlations = np.full(values.size, np.nan), np.full((values.size, values.size), np.nan)
    deviations[~on_bound] = scatter * lengths / norms
    correlations[np.ix_(~on_bound, ~on_bound)] = inverse / np.outer(lengths, lengths)
    condition = float(singular[0] / singular[-1]) if singular.size else 1.0
    measured = uncensored_rank(problem, slopes[:, ~on_bound]) if problem.censoring.any() else singular.size
    return FitStatistics(singular.size, measured, condition, scatter, deviations, correlations, on_bound)


def _on_bound(problem: FitProblem, values: Array) -> npt.NDArray[np.bool_]:
    """Which parameters were stopped by a bound; the search keeps a hair's breadth away from it."""
    low, high = problem.bounds
    near = 1e-6 * np.maximum(np.abs(values), np.abs(problem.initial_values))
    return (values - low <= near) | (high - values <= near)


def _residual_std(errors: Array, parameters: int, loss: Loss) -> float:
    """The sigma that makes sigma^2 (J^T J)^-1 the covariance.

    For least squares it is sqrt(SSE/(N - P)); for a loss with influence psi(e) = e rho' it is
    sqrt(Sum psi^2/(N - P))/mean(psi'). Reference: Huber, Robust Statistics (1981), section 7.6.
    """
    spare = errors.size - parameters
    if spare <= 0:
        return float("nan")
    z = (errors / loss.scale) ** 2
    _, first, second = loss.rho(z)
    return float(np.sqrt(np.sum((errors * first) ** 2) / spare) / np.mean(first + 2 * z * second))


def _rank_deficiency_message(problem: FitProblem, kept: npt.NDArray[np.bool_], shares: Array, rank: int) -> str:
    labels = [label for label, keep in zip(problem.labels, kept, strict=True) if keep]
    names = [label for label, share in zip(labels, shares, strict=True) if share > 1e-3 * shares.max()]
    first, second = problem.fitted_quantity.arguments
    counts = [
        f"{count_levels(values)} of {name}" for name, values in zip((first, second), problem.arguments, strict=True)
    ]
    path = problem.leaves[problem.free[int(np.flatnonzero(kept)[int(np.argmax(shares))])]].path
    said = f"cannot tell apart {', '.join(names)}" if len(names) > 1 else f"do not act on {names[0]}"
    return (
        f"{problem.data.origin}: the points {said} of {type(problem.law).__name__} (rank {rank} of {len(labels)} "
        f"parameters). They lie at so many levels: {', '.join(counts)}. Measure at more levels, choose a lower degree "
        f"or a law with fewer parameters, or hold one fixed: fixed=('{path}',)."
    )


def count_levels(values: Array) -> int:
    """How many different values there are, to a millionth of their range."""
    span = float(np.ptp(values)) if values.size else 0.0
    return int(np.unique(np.round((values - values.min()) / span * 1e6)).size) if span > 0 else 1

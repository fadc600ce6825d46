"""Search for the parameters of a friction law in one run or in several runs together."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ....core import tree
from ....core.arrays import Array
from ....core.tree import Leaf
from ....physics.muscle.friction import Friction, PressureScaledFriction
from ..identifiability import UndeterminedCombination, analyse_identifiability
from ..model_evidence import effective_sample_size
from .limits import DataLimits, combine_limits
from .series import LoopSeries

JACOBIAN_TOLERANCE = 1e-4
"""Relative singular value that counts as zero; the derivatives are differences of forward evaluations (chosen)."""


def free_parameters(friction: Friction) -> int:
    """Number of the parameters of a friction law that a fit determines."""
    return sum(leaf.declared.fitted for leaf in tree.leaves(friction))


def search_parameters(
    friction: Friction, runs: Sequence[LoopSeries]
) -> tuple[Friction, tuple[UndeterminedCombination, ...]]:
    """The friction with the least squares of the residuals of all runs, and what the runs do not determine.

    Each run has its own static curve. Elements of a law with several of them are not judged one by one, because they
    replace each other: only their sum has a meaning.
    """
    if friction.linear_in:
        return _fit_stiffnesses(friction, runs), ()
    if isinstance(friction, PressureScaledFriction) and friction.inner.linear_in:
        return _fit_scaled_stiffnesses(friction, runs), ()
    return _fit_iteratively(friction, runs)


def _fit_stiffnesses(
    friction: Any, runs: Sequence[LoopSeries], factors: Sequence[Array | float] | None = None
) -> Friction:
    """Stiffnesses of elements with given limits, by bounded linear least squares; `factors` scale the forces.

    No element slides at a greater force than the largest one of the data.
    """
    from scipy.linalg import block_diag
    from scipy.optimize import lsq_linear

    blocks = []
    for run, factor in zip(runs, factors or [1.0] * len(runs), strict=True):
        elements = friction.element_deflections(run.path) * np.reshape(factor, (-1, 1))
        blocks.append(elements[run.fitted_rows])
    terms = np.vstack(blocks)
    norms = np.linalg.norm(terms, axis=0)
    norms = np.where(norms > 0, norms, 1.0)
    curves = block_diag(*(run.design_matrix[run.fitted_rows] for run in runs))
    matrix = np.hstack([curves, -terms / norms])
    declared = next(leaf.declared for leaf in tree.leaves(friction) if leaf.path.startswith(friction.linear_in))
    greatest = np.clip(max(run.limits.force for run in runs) / np.asarray(friction.limits), 1e-9, declared.bounds[1])
    lower = np.concatenate([np.full(curves.shape[1], -np.inf), np.zeros(terms.shape[1])])
    upper = np.concatenate([np.full(curves.shape[1], np.inf), greatest * norms])
    target = np.concatenate([run.target[run.fitted_rows] for run in runs])
    result = lsq_linear(matrix, target, (lower, upper), method="bvls")
    stiffnesses = np.clip(result.x[curves.shape[1] :] / norms, 0.0, greatest)
    fitted: Friction = dataclasses.replace(friction, **{friction.linear_in: tuple(stiffnesses)})
    return fitted


def _fit_scaled_stiffnesses(friction: PressureScaledFriction, runs: Sequence[LoopSeries]) -> Friction:
    """Stiffnesses and the force scale: the stiffnesses are solved for at every value of the ratio of the scale."""
    from scipy.optimize import minimize_scalar

    low, high = next(leaf for leaf in tree.leaves(friction) if leaf.path == "ambient_ratio").declared.bounds

    def fitted(ratio: float) -> PressureScaledFriction:
        scale = dataclasses.replace(friction, ambient_ratio=ratio)
        factors = [1.0 if run.pressure is None else np.asarray(scale.pressure_factor(run.pressure)) for run in runs]
        return dataclasses.replace(scale, inner=_fit_stiffnesses(friction.inner, runs, factors))

    def square(coordinate: float) -> float:
        residuals = _residuals(fitted(_ratio(coordinate)), runs)
        return float(residuals @ residuals)

    def _ratio(coordinate: float) -> float:
        return min(max(coordinate / (1.0 - coordinate), low), high)  # 0 to 1 covers all ratios evenly

    result = minimize_scalar(square, bounds=(0.0, high / (1.0 + high)), method="bounded", options={"xatol": 1e-4})
    return fitted(_ratio(float(result.x)))


def _residuals(friction: Friction, runs: Sequence[LoopSeries]) -> Array:
    return np.concatenate([run.fitted_residuals(friction) for run in runs])


def _fit_iteratively(
    friction: Friction, runs: Sequence[LoopSeries]
) -> tuple[Friction, tuple[UndeterminedCombination, ...]]:
    """Nonlinear least squares over the free parameters; the static curve is solved for at every evaluation."""
    from scipy.optimize import least_squares

    limits = combine_limits(tuple(run.limits for run in runs))
    all_leaves = list(tree.leaves(friction))
    free = [i for i, leaf in enumerate(all_leaves) if leaf.declared.fitted]
    coordinates = [_SearchCoordinate.from_leaf(all_leaves[i], limits) for i in free]

    def law(x: Sequence[float]) -> Friction:
        values = [leaf.value for leaf in all_leaves]
        for i, coordinate, value in zip(free, coordinates, x, strict=True):
            values[i] = coordinate.parameter_value(float(value))
        return tree.unflatten(friction, values)

    start = [c.start for c in coordinates]
    bounds = ([c.low for c in coordinates], [c.high for c in coordinates])
    result = least_squares(lambda x: _residuals(law(x), runs), start, bounds=bounds, x_scale=1.0, max_nfev=60)
    fitted = tree.with_parameters(friction, [leaf.value for leaf in tree.leaves(law(result.x))])
    names = [all_leaves[i].path for i in free]
    if any("[" in name for name in names):
        return fitted, ()
    return fitted, _undetermined(result.jac, result.fun, names)


def _undetermined(jacobian: Array, residuals: Array, names: Sequence[str]) -> tuple[UndeterminedCombination, ...]:
    """Combinations of parameters with a large relative standard error; correlated residuals count as fewer rows."""
    freedom = max(effective_sample_size(residuals) - len(names), 1.0)
    spread = float(np.sqrt(np.sum(residuals**2) / freedom)) or 1e-12
    scales = np.ones(len(names))
    return analyse_identifiability(jacobian, names, scales, spread, JACOBIAN_TOLERANCE).undetermined


@dataclasses.dataclass(frozen=True)
class _SearchCoordinate:
    """A parameter as a search coordinate: its logarithm if its lower bound is positive, else scaled by its size."""

    start: float
    low: float
    high: float
    size: float

    @classmethod
    def from_leaf(cls, leaf: Leaf, limits: DataLimits) -> _SearchCoordinate:
        low, high = limits.bounds(leaf)
        value = min(max(leaf.value, low), high)
        if low > 0:
            return cls(float(np.log(value)), float(np.log(low)), float(np.log(high)), 0.0)
        narrowed = high < leaf.declared.bounds[1]
        size = abs(value) or (0.1 * high if narrowed else 1.0)
        return cls(value / size, low / size, high / size, size)

    def parameter_value(self, coordinate: float) -> float:
        """The parameter for a value of the coordinate."""
        return coordinate * self.size if self.size else float(np.exp(coordinate))

"""Loop series of a run, and the search for the parameters of a friction law in those of one run or
of several.
"""

import dataclasses
import functools
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core import Array, IdentificationError, Leaf, tree
from ...physics.muscle.friction import Friction, PressureScaledFriction
from ...recording import Recording
from ..estimation import (
    EDGES,
    FreeParameter,
    LeastSquares,
    MeasuredProblem,
    Prior,
    Runs,
    SolvedProblem,
    UndeterminedCombination,
    analyse_identifiability,
    effective_sample_size,
    solve_iteratively,
)
from ..inspection import EDGE, Mask, estimate_noise, motion_direction
from . import loop_data as data
from .loop_data import MILLIMETRES, Axis, DataLimits, combine_limits

BIN_COUNT = 24
"""Bins along the path in which branches are compared (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False)
class BinnedDifference:
    """Differences of two branches in bins, shape (bins,), and their weights, inverse to the
    variance of the means.
    """

    values: Array
    weights: Array

    @property
    def rms(self) -> float:
        """Weighted root mean square of the differences; NaN without a common bin."""
        return (
            float(np.sqrt(np.average(self.values**2, weights=self.weights)))
            if self.values.size
            else float("nan")
        )


def binned_difference(
    path: Array, values: Array, other_path: Array, other_values: Array
) -> BinnedDifference:
    """Second minus first branch in the bins of the common path where both have n and m rows, with
    weight n m/(n + m). The values should be residuals from a common static curve: the slope of a
    force would appear as a difference.
    """
    low = max(path.min(initial=np.inf), other_path.min(initial=np.inf))
    high = min(path.max(initial=-np.inf), other_path.max(initial=-np.inf))
    if not low < high:
        return BinnedDifference(np.empty(0), np.empty(0))
    edges = np.linspace(low, high, BIN_COUNT + 1)
    first, n = _bin_means(path, values, edges)
    second, m = _bin_means(other_path, other_values, edges)
    common = (n > 0) & (m > 0)
    return BinnedDifference((second - first)[common], (n * m)[common] / (n + m)[common])


def _bin_means(path: Array, values: Array, edges: Array) -> tuple[Array, Array]:
    """Mean of the values in every bin, NaN in an empty bin; and the numbers of rows."""
    margin = EDGE * (edges[1] - edges[0])  # a row on an edge is above it, whatever the rounding
    bins = np.digitize(path, edges[1:-1] - margin)
    inside = (path >= edges[0] - margin) & (path <= edges[-1] + margin)
    bins = bins[inside]
    bin_count = edges.size - 1
    counts = np.bincount(bins, minlength=bin_count)
    sums = np.bincount(bins, values[inside], minlength=bin_count)
    empty = np.full(bin_count, np.nan)
    means = np.divide(sums, counts, out=empty, where=counts > 0)
    return means, np.asarray(counts, dtype=float)


def branch_gap(path: Array, values: Array, direction: Array) -> BinnedDifference:
    """The branch along which the path falls minus the other one, in bins along the path;
    `direction` is 1 where the path rises, -1 where it falls.
    """
    rising = direction > 0
    falling = direction < 0
    return binned_difference(path[rising], values[rising], path[falling], values[falling])


def repeat_difference(
    path: Array,
    values: Array,
    direction: Array,
    other_path: Array,
    other_values: Array,
    other_direction: Array,
) -> BinnedDifference:
    """Second run minus first run of the same loop, branch by branch, in bins along the path."""
    pairs = ((direction > 0, other_direction > 0), (direction < 0, other_direction < 0))
    both = [binned_difference(path[a], values[a], other_path[b], other_values[b]) for a, b in pairs]
    return BinnedDifference(
        np.concatenate([d.values for d in both]), np.concatenate([d.weights for d in both])
    )


@dataclasses.dataclass(frozen=True, eq=False)
class LoopSeries:
    """One run of a loop as a fit of friction uses it; N rows, C coefficients of the static
    curve.
    """

    origin: str
    path: Array
    """Displacement of the friction [m], shape (N,)."""
    time: Array | None
    """Time [s], shape (N,), if the recording has one."""
    target: Array
    """Force [N] to be explained by the static curve and the friction, shape (N,)."""
    design_matrix: Array
    """Columns of the static curve, shape (N, C)."""
    fitted_rows: Mask
    """Mask of the rows whose residuals are minimised."""
    direction: Array
    """1 where the path rises, -1 where it falls."""
    limits: DataLimits
    """Maximum force and range of the speed of the fitted rows."""
    pressure: Array | None = None
    """Gauge pressure [Pa], shape (N,), of a friction that depends on the pressure; None if it is
    not recorded.
    """
    axis: Axis = MILLIMETRES
    transient_rows: int = 0
    """Number of fitted rows in which the pressure changes quickly."""

    def fitted_curve(self, friction: Friction | None) -> tuple[Array, Array]:
        """Least-squares coefficients (C,) of the static curve with this friction, or without
        friction; and the residuals, measured - modelled force [N], at every row, shape (N,)."""
        force = 0.0 if friction is None else self.friction_force(friction)
        static = self.target + force
        coefficients = self._pseudoinverse @ static[self.fitted_rows]
        residuals = self.target - self.design_matrix @ coefficients + force
        return coefficients, residuals

    def fitted_residuals(self, friction: Friction | None) -> Array:
        """Residuals [N] at the fitted rows, with the least-squares coefficients of the static
        curve.
        """
        return self.fitted_curve(friction)[1][self.fitted_rows]

    def friction_force(self, friction: Friction) -> Array:
        """Friction force [N] at every row and its pressure, shape (N,)."""
        force = np.asarray(friction.force_along(self.path, self.time))
        return (
            force
            if self.pressure is None
            else np.asarray(friction.pressure_factor(self.pressure) * force)
        )

    @functools.cached_property
    def _pseudoinverse(self) -> Array:
        """Pseudoinverse of the design matrix at the fitted rows, shape (C, fitted rows)."""
        return np.asarray(np.linalg.pinv(self.design_matrix[self.fitted_rows]))


PRIOR = 10.0
"""Standard deviation of a parameter about its initial value in the search, as that of its
logarithm, or relative to its size (chosen): what the runs do not determine stays near it instead of
wherever a search stops, while a single row outweighs it.
"""
MAX_EVALUATIONS = 300
"""Maximum evaluations of a search (chosen: it converges in 10 to 110)."""
JACOBIAN_TOLERANCE = 1e-4
"""Relative singular value that counts as zero; the derivatives are differences of forward
evaluations (chosen).
"""


def make_loop_series(
    recording: Recording,
    static_curve: data.StaticCurve,
    friction_path: data.FrictionPath,
    fitted_rows: Mask | None,
) -> LoopSeries:
    """The arrays of a run for a fit of friction. Raises IdentificationError where a displacement is
    missing.
    """
    target = recording["force"] - static_curve.known_force(recording)
    matrix = static_curve.design_matrix(recording)
    finite = np.isfinite(target) & np.isfinite(matrix).all(axis=1)
    rows = finite if fitted_rows is None else np.asarray(fitted_rows, dtype=bool) & finite
    path = friction_path.displacement(recording)
    time = recording.columns.get("time")
    if (gaps := np.flatnonzero(~np.isfinite(path))).size:
        where = f"{recording.origin}, row {gaps[0] + 1}"
        raise IdentificationError(
            f"{where}: the displacement is missing, along which friction acts. Remove such rows."
        )
    limits = data.data_limits(recording["force"], path, time, rows)
    series = LoopSeries(
        recording.origin,
        path,
        time,
        target,
        matrix,
        rows,
        motion_direction(path, time),
        limits,
        recording.columns.get("pressure"),
        friction_path.axis,
    )
    stiffness = data.resolved_stiffness(path[rows], series.fitted_residuals(None))
    return dataclasses.replace(
        series, limits=dataclasses.replace(series.limits, stiffness=stiffness)
    )


def free_parameters(friction: Friction) -> int:
    """Number of the parameters of a friction law that a fit determines."""
    return sum(leaf.declared.fitted for leaf in tree.leaves(friction))


def search_parameters(
    friction: Friction, runs: Sequence[LoopSeries]
) -> tuple[Friction, tuple[UndeterminedCombination, ...]]:
    """The friction with the least squares of the residuals of all runs, and what the runs do not
    determine. Each run has its own static curve. Elements of a law with several of them are not
    judged one by one, because they replace each other: only their sum has a meaning."""
    if friction.linear_in:
        return _fit_stiffnesses(friction, runs), ()
    if isinstance(friction, PressureScaledFriction) and friction.inner.linear_in:
        return _fit_scaled_stiffnesses(friction, runs), ()
    return _fit_iteratively(friction, runs)


def _fit_stiffnesses(
    friction: Any, runs: Sequence[LoopSeries], factors: Sequence[Array | float] | None = None
) -> Friction:
    """Stiffnesses of elements with given limits, by bounded linear least squares; `factors` scale
    the forces, none of which is greater than the largest one of the data."""
    from scipy.linalg import block_diag
    from scipy.optimize import lsq_linear

    pairs = zip(runs, factors or [1.0] * len(runs), strict=True)
    deflections = [
        (run, friction.element_deflections(run.path) * np.reshape(factor, (-1, 1)))
        for run, factor in pairs
    ]
    terms = np.vstack([deflection[run.fitted_rows] for run, deflection in deflections])
    norms = np.linalg.norm(terms, axis=0)
    norms = np.where(norms > 0, norms, 1.0)
    curves = block_diag(*(run.design_matrix[run.fitted_rows] for run in runs))
    matrix = np.hstack([curves, -terms / norms])
    declared = next(
        leaf.declared for leaf in tree.leaves(friction) if leaf.path.startswith(friction.linear_in)
    )
    greatest = np.clip(
        max(run.limits.force for run in runs) / np.asarray(friction.limits),
        1e-9,
        declared.bounds[1],
    )
    free = np.full(curves.shape[1], np.inf)
    target = np.concatenate([run.target[run.fitted_rows] for run in runs])
    bounds = np.append(-free, np.zeros(terms.shape[1])), np.append(free, greatest * norms)
    result = lsq_linear(matrix, target, bounds, method="bvls")
    stiffnesses = np.clip(result.x[curves.shape[1] :] / norms, 0.0, greatest)
    fitted: Friction = dataclasses.replace(friction, **{friction.linear_in: tuple(stiffnesses)})
    return fitted


def _fit_scaled_stiffnesses(
    friction: PressureScaledFriction, runs: Sequence[LoopSeries]
) -> Friction:
    """Stiffnesses and the force scale: the stiffnesses are solved for at every value of the ratio
    of the scale.
    """
    from scipy.optimize import minimize_scalar

    low, high = next(
        leaf for leaf in tree.leaves(friction) if leaf.path == "ambient_ratio"
    ).declared.bounds

    def fitted(coordinate: float) -> PressureScaledFriction:
        ratio = min(
            max(coordinate / (1.0 - coordinate), low), high
        )  # 0 to 1 covers all ratios evenly
        scale = dataclasses.replace(friction, ambient_ratio=ratio)
        factors = [
            1.0 if run.pressure is None else np.asarray(scale.pressure_factor(run.pressure))
            for run in runs
        ]
        return dataclasses.replace(scale, inner=_fit_stiffnesses(friction.inner, runs, factors))

    def square(coordinate: float) -> float:
        residuals = _residuals(fitted(coordinate), runs)
        return float(residuals @ residuals)

    result = minimize_scalar(
        square, bounds=(0.0, high / (1.0 + high)), method="bounded", options={"xatol": 1e-4}
    )
    return fitted(float(result.x))


def _residuals(friction: Friction, runs: Sequence[LoopSeries]) -> Array:
    return np.concatenate([run.fitted_residuals(friction) for run in runs])


@dataclasses.dataclass(frozen=True, eq=False)
class FrictionProblem(MeasuredProblem):
    """The forces at the fitted rows of all runs, and the free parameters of a friction law; the
    static curve of each run is solved for at every evaluation.
    """

    friction: Friction
    """The law with its initial parameters."""
    series: tuple[LoopSeries, ...]
    # The forces have kinks.
    accuracy = EDGES

    @property
    def name(self) -> str:
        return type(self.friction).__name__

    @property
    def origin(self) -> str:
        return " + ".join(run.origin for run in self.series)

    quantity = "force"

    @functools.cached_property
    def _leaves(self) -> list[Leaf]:
        return list(tree.leaves(self.friction))

    @functools.cached_property
    def _free(self) -> list[int]:
        return [i for i, leaf in enumerate(self._leaves) if leaf.declared.fitted]

    @functools.cached_property
    def parameters(self) -> tuple[FreeParameter, ...]:
        limits = combine_limits(tuple(run.limits for run in self.series))
        deviation = PRIOR / _noise(self.series)
        return tuple(_parameter(self._leaves[i], limits, deviation) for i in self._free)

    @functools.cached_property
    def target(self) -> Array:  # type: ignore[override]
        return np.concatenate([run.target[run.fitted_rows] for run in self.series])

    @functools.cached_property
    def runs(self) -> Runs:
        counts = [int(np.count_nonzero(run.fitted_rows)) for run in self.series]
        run = np.repeat(np.arange(len(counts)), counts)
        return Runs(run, np.zeros(run.size, dtype=np.intp), in_time=True)

    def describe_row(self, row: int) -> str:
        every = [(run, i) for run in self.series for i in np.flatnonzero(run.fitted_rows)]
        run, place = every[row]
        return f"{run.origin}, row {place + 1}"

    def law(self, values: Array) -> Friction:
        """The law with these parameters, not validated."""
        every = [leaf.value for leaf in self._leaves]
        for i, value in zip(self._free, values.tolist(), strict=True):
            every[i] = value
        return tree.unflatten(self.friction, every)

    def predict(self, values: Array) -> Array:
        return self.target - _residuals(self.law(values), self.series)


def solved_friction(friction: Friction, runs: Sequence[LoopSeries]) -> SolvedProblem:
    """The problem of a fitted friction law: covariance by runs, profiles, bootstrap."""
    problem = FrictionProblem(friction, tuple(runs))
    return SolvedProblem(problem, problem.initial_values)


def _fit_iteratively(
    friction: Friction, runs: Sequence[LoopSeries]
) -> tuple[Friction, tuple[UndeterminedCombination, ...]]:
    """Nonlinear least squares over the free parameters."""
    problem = FrictionProblem(friction, tuple(runs))
    solution = solve_iteratively(problem, LeastSquares(), problem.initial_values, MAX_EVALUATIONS)
    law = problem.law(solution.values)
    fitted = tree.with_parameters(friction, [leaf.value for leaf in tree.leaves(law)])
    names = problem.names
    if any("[" in name for name in names):
        return fitted, ()
    residuals = problem.residuals(solution.modelled)
    freedom = max(
        effective_sample_size(residuals) - len(names), 1.0
    )  # correlated residuals count as fewer rows
    spread = float(np.sqrt(np.sum(residuals**2) / freedom)) or 1e-12
    jacobian = solution.jacobian * problem.coordinates.slopes(solution.values)
    analysis = analyse_identifiability(
        jacobian, names, np.ones(len(names)), spread, JACOBIAN_TOLERANCE
    )
    return fitted, analysis.undetermined


def _noise(runs: Sequence[LoopSeries]) -> float:
    """The noise of the forces [N], at least a thousandth of the hysteresis: a row with that error
    states as much as the prior knowledge of a parameter."""
    noises = [estimate_noise(run.target[run.fitted_rows]) for run in runs]
    amplitude = float(np.sqrt(np.mean(_residuals_without(runs) ** 2)))
    return max(*noises, 1e-3 * amplitude, 1e-12)


def _residuals_without(runs: Sequence[LoopSeries]) -> Array:
    return np.concatenate([run.fitted_residuals(None) for run in runs])


def _parameter(leaf: Leaf, limits: DataLimits, deviation: float) -> FreeParameter:
    """A parameter within the limits of the data; the logarithm of one with a positive lower bound
    is searched. `deviation` is that of its prior, relative to its size.
    """
    low, high = limits.bounds(leaf)
    value = min(max(leaf.value, low), high)
    declared = leaf.declared
    is_logarithmic = low > 0
    narrowed = high < declared.bounds[1]
    size = abs(value) or (0.1 * high if narrowed else 1.0)
    prior = Prior(value, deviation if is_logarithmic else size * deviation, is_logarithmic)
    return FreeParameter(
        leaf.path,
        declared.symbol,
        value,
        (low, high),
        declared.unit,
        declared.meaning,
        size=size,
        is_logarithmic=is_logarithmic,
        prior=prior,
    )

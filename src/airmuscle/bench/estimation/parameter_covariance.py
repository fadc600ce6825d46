"""Covariance of the estimates of a static fit, with the correlation of the errors within runs.

With independent errors the covariance is sigma^2 (J^T J)^-1. Errors that a whole run shares, such
as the zero or the gain of a sensor, and those of a slow ramp are correlated: their variances are
those of `run_errors`, beside what the law does not follow. Where one law is fitted to three or more
specimens, these scatter about it in every direction. The covariance is then computed from the
specimens as groups of rows, between which errors are independent: C = A (Sum_g s_g s_g^T) A, where
A = (J^T J)^-1 and s_g = J_g^T (I - H_g)^-1/2 e_g is the gradient of group g, H_g = J_g A J_g^T its
leverage (CR2). It has no bias where the errors of all rows are independent. The quantile of
Student's distribution of an interval has the degrees of freedom of the variance of this combination
of parameters under independent errors. References: Bell and McCaffrey (2002), "Bias reduction in
standard errors for linear regression with multi-stage samples", Survey Methodology 28(2), 169-181;
Cameron and Miller (2015), "A practitioner's guide to cluster-robust inference", Journal of Human
Resources 50(2), 317-372.
"""

import dataclasses
import functools
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import Array
from .. import estimation
from .model_evidence import lag_one_autocorrelation, student_quantile

ROWS = "rows"
PARTS = "parts"
RUNS = "runs"
SPECIMENS = "specimens"
"""What the errors are independent between."""
MIN_GROUPS = 3
"""Minimum number of runs or specimens from which their scatter is estimated (chosen)."""
MIN_DEGREES_OF_FREEDOM = 2.4
"""Minimum of the median of the parameters' degrees of freedom for groups of rows (chosen)."""
LEAST_DEGREES_OF_FREEDOM = 2.0
"""Least degrees of freedom of an interval by groups of rows (chosen: Student's distribution has no
variance below; 91 to 99 % of 95 % intervals of seven laboratories held, each of 400
experiments)."""
MIN_GROUP_ROWS = 3
"""Minimum number of rows of a part of a run (chosen)."""
SIGNIFICANCE = 3.0
"""Lag-1 autocorrelation, in its standard deviations 1/sqrt(N) for independent rows, that counts as
such (chosen).
"""
NORMAL_QUANTILE = 1.959963984540054
"""Half width of a 95 % interval of the normal distribution in standard deviations."""
_MAX_LEVERAGE = 1.0 - 1e-9
_CHUNK = 512

Indices = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]


@dataclasses.dataclass(frozen=True, eq=False)
class Runs:
    """The run and the specimen of every row, in ascending order, shape (N,) each."""

    run: Indices
    specimen: Indices
    in_time: bool
    """Whether the rows of a run follow each other in time."""
    place: Indices | None = None
    """The place of each row (N,) in its run, where the order of the rows has no meaning."""
    direction: Array | None = None
    """The direction of the motion of each row (N,): 1, -1, or 0 where it is not known."""
    arguments: tuple[Array, ...] = ()
    """The quantities (N,) that the rows are measured at, one or two."""

    def rows(self, selection: Mask | Indices) -> "Runs":
        """The runs of a selection of the rows, a mask (N,) or their indices."""
        place = None if self.place is None else self.place[selection]
        direction = None if self.direction is None else self.direction[selection]
        arguments = tuple(values[selection] for values in self.arguments)
        return Runs(
            self.run[selection],
            self.specimen[selection],
            self.in_time,
            place,
            direction,
            arguments,
        )

    def conditions(self, modelled: Array) -> "estimation.Conditions":
        """What the errors of the rows may follow, with the modelled quantity (N,)."""
        unknown = np.zeros(self.run.size)
        first, second = (*self.arguments, unknown, unknown)[:2]
        direction = unknown if self.direction is None else self.direction
        return estimation.Conditions.of(first, second, modelled, direction)

    @property
    def order(self) -> Indices:
        """The rows by run and place, as they are if they have no place."""
        places = np.arange(self.run.size) if self.place is None else self.place
        return np.lexsort((places, self.run))


class Groups(NamedTuple):
    """Adjusted gradients (G, P), leverages H and H (I - H)^-1/2 (G, P, P) of the groups, in the
    orthonormal basis of the Jacobian."""

    gradients: Array
    leverages: Array
    adjusted: Array


@dataclasses.dataclass(frozen=True, eq=False)
class ParameterCovariance:
    """Covariance of P parameters, and of any combination of them. These are all fitted parameters,
    or those that are not on a bound where the rows do not determine all."""

    parameters: Mask
    """Mask of the P parameters among all fitted ones, whose number is Q."""
    basis: Array
    """T with T T^T = (J^T J)^-1 of the weighted Jacobian, shape (P, P)."""
    sigma: float
    """Standard deviation of the residuals [SI]."""
    spare_rows: int
    """Number of rows minus that of the parameters that are not on a bound."""
    run_count: int
    specimen_count: int
    unit: str = ROWS
    """What the errors are independent between: ROWS, RUNS or SPECIMENS."""
    groups: Groups | None = None
    """The specimens, if they are the unit."""
    run_errors: "estimation.RunErrors | None" = None
    """The errors that the rows of a run share, if the runs are the unit."""

    @functools.cached_property
    def degrees_of_freedom(self) -> float:
        """The median of the degrees of freedom of the parameters."""
        freedoms = self.variances(np.eye(len(self.basis)))[1]
        return float(np.median(freedoms)) if freedoms.size else float(self.spare_rows)

    @functools.cached_property
    def _scatter(self) -> Array:
        """The covariance without the factor of Student's distribution, shape (P, P); with errors of
        runs its correlations alone have a meaning."""
        if self.run_errors is not None:
            return np.asarray(self.basis @ self.run_errors.matrix @ self.basis.T)
        if self.groups is None:
            return np.asarray(self.sigma**2 * self.basis @ self.basis.T)
        gradients = self.groups.gradients @ self.basis.T
        return np.asarray(gradients.T @ gradients)

    def of_parameters(self) -> tuple[Array, Array]:
        """Standard errors (Q,) and correlations (Q, Q) of all fitted parameters; NaN for those that
        are not contained. Where the errors of rows are correlated, the standard errors contain
        Student's quantile over that of the normal distribution, so that 1.96 of them are the half
        width of a 95 % interval (effective degrees of freedom, JCGM 100:2008, G.4).
        """
        count = self.parameters.size
        square = np.ix_(self.parameters, self.parameters)
        errors = np.full(count, np.nan)
        correlations = np.full((count, count), np.nan)
        errors[self.parameters] = self._parameter_errors
        correlations[square] = normalised(
            self.basis @ self.basis.T if self.unit == ROWS else self._scatter
        )
        return errors, correlations

    @functools.cached_property
    def _parameter_errors(self) -> Array:
        """The standard errors (P,) of the contained parameters."""
        if self.unit == ROWS:
            return np.sqrt(np.diag(self._scatter))
        return self._half_widths(np.eye(len(self.basis)), 0.95) / NORMAL_QUANTILE

    def greatest_correlations(self) -> Array:
        """The greatest magnitude of the correlations of each fitted parameter (Q,) with another for
        independent rows, which depends only on the points; 0 for those that are not contained."""
        greatest = np.zeros(self.parameters.size)
        between = np.abs(normalised(self.basis @ self.basis.T) - np.eye(len(self.basis)))
        greatest[self.parameters] = between.max(axis=1, initial=0.0)
        return greatest

    def error_ratio(self, index: int, level: float) -> float:
        """Half width of the interval of a fitted parameter over its standard error for independent
        rows.
        """
        position = int(np.count_nonzero(self.parameters[:index]))
        (half,) = self._half_widths(np.eye(len(self.basis))[[position]], level)
        return float(half / (self.sigma * np.linalg.norm(self.basis[position])))

    def half_widths(self, combinations: Array, level: float) -> Array:
        """Half widths (K,) of the intervals of combinations of the fitted parameters (K, Q) at a
        confidence level.
        """
        return self._half_widths(combinations[:, self.parameters], level)

    def _half_widths(self, combinations: Array, level: float) -> Array:
        """Half widths (K,) of combinations of the contained parameters (K, P)."""
        variances, freedoms = self.variances(combinations)
        least = 0.0 if self.unit == ROWS else LEAST_DEGREES_OF_FREEDOM
        quantile = student_quantile(np.maximum(freedoms, least), level)
        return np.asarray(quantile * np.sqrt(variances))

    def within_bounds(self, low: Mask, high: Mask, descent: Array) -> "ParameterCovariance":
        """The covariance where some of the parameters, masks (P,), are on their lower and upper
        bounds.

        descent  -J^T e (P,) of the weighted residuals e, which points outwards at a bound

        With normal errors the unconstrained estimate of such a parameter is d standard errors
        beyond its bound. Its true value lies inside: the error counts with the second moment about
        the bound of the normal distribution truncated there, 1 + d^2 - d phi(d)/Phi(-d) of its
        variance: the whole of it at d = 0, 2/d^2 far beyond. The errors of the others follow along
        their regression on it.
        """
        held = low | high
        beyond = (self.basis @ (self.basis.T @ descent))[held] * np.where(high, 1.0, -1.0)[held]
        distance = np.maximum(beyond, 0.0) / np.sqrt(
            self.variances(np.eye(len(self.basis)))[0][held]
        )
        covariance = self.basis @ self.basis.T
        slopes = np.linalg.solve(covariance[np.ix_(held, held)], covariance[np.ix_(held, ~held)]).T
        basis = self.basis.copy()
        own = np.sqrt(_truncated_square(distance))[:, None] * self.basis[held]
        basis[~held] -= slopes @ (self.basis[held] - own)
        basis[held] = own
        return dataclasses.replace(
            self, basis=basis, spare_rows=self.spare_rows + int(np.count_nonzero(held))
        )

    def variances(self, combinations: Array) -> tuple[Array, Array]:
        """Variance and degrees of freedom, shape (K,) each, of combinations of the parameters,
        shape (K, P).
        """
        rows = combinations @ self.basis
        if self.run_errors is not None:
            return self.run_errors.student(rows)
        if self.groups is None:
            return self.sigma**2 * np.sum(rows**2, axis=1), np.full(
                len(rows), float(self.spare_rows)
            )
        variances = np.sum((rows @ self.groups.gradients.T) ** 2, axis=1)
        chunks = (rows[start : start + _CHUNK] for start in range(0, max(len(rows), 1), _CHUNK))
        return variances, np.concatenate(
            [_degrees_of_freedom(self.groups, chunk) for chunk in chunks]
        )

    def describe(self) -> str:
        """What the standard errors are estimated from, and what they do not contain, as a
        phrase.
        """
        if not np.isfinite(self.sigma):
            return "unknown, because there are no more rows than parameters"
        if self.unit == ROWS:
            return "for independent rows" + (_RUNS_UNKNOWN if self.run_count > 1 else "")
        runs = "one run" if self.run_count == 1 else f"{self.run_count} runs"
        freedom = f"{self.degrees_of_freedom:.2g} degrees of freedom"
        if self.unit == SPECIMENS:
            return f"from the scatter of {self.specimen_count} specimens, {freedom}"
        if self.run_errors is None or not self.run_errors.knows_runs:
            return f"from the scatter within {runs}, {freedom}{_RUNS_UNKNOWN}"
        specimens = "; the scatter between specimens is not known"
        return f"from the scatter of {runs}, {freedom}{specimens * (self.specimen_count > 1)}"


_RUNS_UNKNOWN = "; the scatter between runs (zero and gain of the sensors) is not known"


def estimate_covariance(
    basis: Array,
    weighted: Array,
    residuals: Array,
    sigma: float,
    runs: Runs,
    modelled: Array,
    which: Mask,
) -> ParameterCovariance:
    """The covariance from the weighted Jacobian (N, P) and the residuals (N,) of the rows that
    determine the fit, for the parameters of the mask `which` (Q,).

    modelled  the weighted quantity (N,) that the law gives

    Three or more specimens are groups, where these determine the standard errors. Otherwise the
    rows of a run share errors, if they follow in time, are correlated in their order, or if the
    runs are enough to show them; if not, the rows are independent.
    """
    if runs.place is not None:
        order = runs.order
        weighted = weighted[order]
        residuals = residuals[order]
        modelled = modelled[order]
        runs = runs.rows(order)
    spare = len(residuals) - len(basis)
    specimens, count = (
        int(np.count_nonzero(np.bincount(number))) for number in (runs.specimen, runs.run)
    )
    independent = ParameterCovariance(which, basis, sigma, spare, count, specimens)
    if spare <= 0 or not len(basis) or not sigma > 0:
        return independent
    rows = weighted @ basis  # the Jacobian in its orthonormal basis
    if MIN_GROUPS <= specimens < count:
        groups = _by_groups(rows, residuals, runs.specimen)
        by_specimens = dataclasses.replace(independent, unit=SPECIMENS, groups=groups)
        if by_specimens.degrees_of_freedom >= MIN_DEGREES_OF_FREEDOM:
            return by_specimens
    in_order = runs.in_time or is_correlated(residuals, runs.run)
    if not in_order and count < MIN_GROUPS:
        return independent
    conditions = runs.conditions(modelled)
    errors = estimation.estimate_run_errors(
        rows, residuals, runs.run, conditions, in_order=in_order
    )
    if errors is None:
        return independent
    return dataclasses.replace(independent, unit=RUNS, run_errors=errors)


def _by_groups(rows: Array, residuals: Array, group: Indices) -> Groups:
    """The adjusted gradients and leverages of groups of rows (N,)."""
    leverages = []
    raw = []
    for part, errors in zip(_split(rows, group), _split(residuals, group), strict=True):
        leverages.append(part.T @ part)
        raw.append(part.T @ errors)
    values, vectors = np.linalg.eigh(np.array(leverages))
    values = np.clip(values, 0.0, _MAX_LEVERAGE)
    roots = np.sqrt(1.0 - values)
    scaled = vectors / roots[:, None, :]
    transposed = np.swapaxes(vectors, 1, 2)
    gradients = scaled @ transposed @ np.array(raw)[:, :, None]
    return Groups(
        gradients[:, :, 0], np.array(leverages), (scaled * values[:, None, :]) @ transposed
    )


def normalised(matrix: Array) -> Array:
    """The correlations of a covariance matrix."""
    deviations = np.sqrt(np.diag(matrix))
    return np.asarray(matrix / np.outer(deviations, deviations))


def _truncated_square(distance: Array) -> Array:
    """E[x^2] of a standard normal x - `distance` that is positive: 1 + d^2 - d phi(d)/Phi(-d)."""
    from scipy.special import erfcx

    hazard = np.sqrt(2.0 / np.pi) / erfcx(distance / np.sqrt(2.0))
    near = 1.0 + distance * (distance - hazard)
    return np.where(distance < 100.0, np.maximum(near, 0.0), 2.0 / np.maximum(distance, 100.0) ** 2)


def successive_parts(run: Indices, parts: int) -> Indices:
    """The group of each row, where each run is divided into this number of successive parts of
    equal size; (N,).
    """
    groups = np.empty(len(run), dtype=np.intp)
    for i in np.unique(run):
        rows = np.flatnonzero(run == i)
        groups[rows] = i * parts + np.arange(rows.size) * parts // rows.size
    return groups


def _split(rows: Array, group: Indices) -> list[Array]:
    """The rows of each group, in their order."""
    steps = np.diff(group)
    if (steps < 0).any():
        order = np.argsort(group, kind="stable")
        rows = rows[order]
        steps = np.diff(group[order])
    return np.split(rows, np.flatnonzero(steps) + 1)


def _degrees_of_freedom(groups: Groups, rows: Array) -> Array:
    """tr(M)^2/tr(M^2) of the quadratic forms M (G, G) in independent errors, for combinations (K,
    P): 1 to G. The upper bound is that of the rank of M, which rounding in tr(M^2) would exceed.
    With u_g = H_g (I - H_g)^-1/2 a and m_g = a^T H_g a it is M = diag(m_g + |u_g|^2) - U U^T."""
    projected = np.einsum("gij,kj->kgi", groups.adjusted, rows, optimize=True)
    shares = np.einsum("ki,gij,kj->kg", rows, groups.leverages, rows, optimize=True)
    products = np.swapaxes(projected, 1, 2) @ projected
    trace = np.sum(shares, axis=1)
    squares = np.sum(shares**2 - np.sum(projected**2, axis=2) ** 2, axis=1) + np.sum(
        products**2, axis=(1, 2)
    )
    at_rank = trace**2 / len(groups.leverages)
    known = np.maximum(squares, at_rank)
    return np.where(known > 0.0, np.maximum(trace**2 / np.where(known > 0.0, known, 1.0), 1.0), 1.0)


def is_correlated(residuals: Array, run: Indices) -> bool:
    """Whether successive residuals of the runs are more alike than those of independent rows."""
    return bool(
        lag_one_autocorrelation(_split(residuals, run)) > SIGNIFICANCE / np.sqrt(residuals.size)
    )

"""Covariance of the errors of population parameters and specimen effects, with the correlation of
the rows of a run.

The errors have two parts: the scatter of the specimens, and the errors of the rows. The latter are
correlated within a run; their covariance is that of the jackknife by run, (G - 1)/G Sum_g d_g
d_g^T, where d_g is the change of all estimates without run g, with the residuals of the pooled law
and the same ratio of variances (Bell and McCaffrey (2002), Survey Methodology 28(2), 169-181, for
the population parameters; here of the effects as well).
"""

import dataclasses
import functools
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import Array, as_slice
from . import parameter_covariance as rows_of
from .model_evidence import student_quantile

MIN_DEGREES_OF_FREEDOM = 1.6
"""Minimum of the median of the estimates' degrees of freedom for groups of rows (chosen)."""
_MIN_SHARE = 1e-6
"""Minimum share of the information on a combination of population parameters that remains without a
run (chosen).
"""


class Sums(NamedTuple):
    """Sums of products of the weighted rows: design matrix X (N, P) of the population, Z (N, S K)
    of the effects, and residuals r (N,) of the population law."""

    xx: Array
    xz: Array
    zz: Array
    xr: Array
    zr: Array
    rr: float
    rows: float

    @property
    def moments(self) -> Array:
        """The products of X and Z with each other, shape (P + S K, P + S K)."""
        return np.block([[self.xx, self.xz], [self.xz.T, self.zz]])

    def estimates(self, ratio: float) -> Array:
        """The population parameters and the effects (P + S K,) that residuals r of the pooled law
        add to them.
        """
        population = np.linalg.solve(self.xx, self.xr)
        left = self.zr - self.xz.T @ population
        return np.concatenate(
            [population, np.linalg.solve(self.zz + ratio * np.eye(len(self.zz)), left)]
        )

    def without(self, other: "Sums") -> "Sums":
        """The sums without these rows."""
        return Sums(*(whole - part for whole, part in zip(self, other, strict=True)))  # type: ignore[operator]

    def scaled(self, share: float) -> "Sums":
        """The sums for rows that count only as this share of independent ones."""
        return Sums(*(share * each for each in self))  # type: ignore[arg-type]


class EffectRows(NamedTuple):
    """The weighted rows of S specimens: design matrix (N, P) of the population, basis (N, K) of the
    effect of each specimen, residuals (N,) and specimen of each row (N,)."""

    matrix: Array
    basis: Array
    residuals: Array
    member: rows_of.Indices
    specimens: int

    def sums(self, rows: npt.NDArray[np.bool_] | None = None, number: float | None = None) -> Sums:
        """The sums of all rows or of a mask (N,); `number` is that of the rows that count, the
        others being zero.
        """
        chosen = slice(None) if rows is None else rows

        matrix = self.matrix[chosen]
        basis = self.basis[chosen]
        residuals = self.residuals[chosen]
        member = self.member[chosen]
        size = basis.shape[1]
        total = self.specimens * basis.shape[1]
        xz = np.zeros((matrix.shape[1], total))
        zz = np.zeros((total, total))
        zr = np.zeros(total)
        for i in range(self.specimens):
            part = as_slice(np.flatnonzero(member == i))
            own = slice(i * size, (i + 1) * size)
            xz[:, own] = matrix[part].T @ basis[part]
            zz[own, own] = basis[part].T @ basis[part]
            zr[own] = basis[part].T @ residuals[part]
        return Sums(
            matrix.T @ matrix,
            xz,
            zz,
            matrix.T @ residuals,
            zr,
            float(residuals @ residuals),
            len(residuals) if number is None else number,
        )


@dataclasses.dataclass(frozen=True, eq=False)
class PooledCovariance:
    """Covariance of the errors of the P population parameters and, after them, of the S K
    coefficients of the effects. T = P + S K; G groups of rows, between which the errors are
    independent."""

    by_effects: Array
    """Errors of the estimates for an effect of one standard deviation, shape (T, S K)."""
    freedom: float
    """Degrees of freedom of that standard deviation: the effective number of parameters of the
    effects.
    """
    by_rows: Array
    """Errors of the estimates for the products of the rows with their errors, shape (T, T)."""
    moments: Array
    """Products of the rows of each group, shape (G, T, T)."""
    shifts: Array
    """Changes of the estimates without each group, shape (G, T); for independent rows a root of
    their covariance.
    """
    unit: str
    """What the errors of rows are independent between: RUNS, PARTS of runs or ROWS."""
    run_count: int
    rows: int

    @functools.cached_property
    def matrix(self) -> Array:
        """The covariance, shape (T, T); an interval has the half width of `half_widths`."""
        return np.asarray(
            self.by_effects @ self.by_effects.T + self._factor * self.shifts.T @ self.shifts
        )

    @functools.cached_property
    def standard_errors(self) -> Array:
        """Standard errors (T,) of the estimates: 1.96 of them are the half width of a 95 %
        interval.
        """
        return self.half_widths(np.eye(len(self.by_rows)), 0.95) / rows_of.NORMAL_QUANTILE

    def half_widths(self, combinations: Array, level: float, scatter: Array | float = 0.0) -> Array:
        """Half widths (N,) of the intervals of combinations (N, T) of the estimates at a confidence
        level.

        scatter  further variance (N,) between specimens, that of a muscle which was not measured

        The degrees of freedom of the quantile of Student's distribution are those of Welch and
        Satterthwaite for the scatter of the specimens and that of the groups.
        """
        between = np.sum((combinations @ self.by_effects) ** 2, axis=1) + scatter
        within = self._factor * np.sum((combinations @ self.shifts.T) ** 2, axis=1)
        total = between + within
        freedoms = self.group_freedoms(combinations)
        parts = between**2 / max(self.freedom, 1.0) + within**2 / freedoms
        known = np.where(parts > 0, total**2 / np.where(parts > 0, parts, 1.0), freedoms)
        return np.asarray(
            student_quantile(np.maximum(known, rows_of.LEAST_DEGREES_OF_FREEDOM), level)
            * np.sqrt(total)
        )

    def group_freedoms(self, combinations: Array) -> Array:
        """Degrees of freedom (N,) of the scatter of the groups for combinations (N, T), 1 to G."""
        if self.unit == rows_of.ROWS:
            return np.full(len(combinations), float(self.rows))
        rows = combinations @ self.by_rows
        shares = np.einsum("ni,gij,nj->ng", rows, self.moments, rows, optimize=True)
        return np.asarray(
            np.sum(shares, axis=1) ** 2 / np.maximum(np.sum(shares**2, axis=1), 1e-300)
        )

    def describe(self) -> str:
        """What the errors are estimated from, and what they do not contain, as a phrase."""
        unknown = "; the scatter between runs (zero and gain of the sensors) is not known"
        within = {
            rows_of.RUNS: f"{self.run_count} runs",
            rows_of.PARTS: f"{len(self.shifts)} successive parts of the runs{unknown}",
            rows_of.ROWS: f"independent rows{unknown}",
        }
        return f"from the scatter of the specimens and of {within[self.unit]}"

    @property
    def _factor(self) -> float:
        return 1.0 if self.unit == rows_of.ROWS else (len(self.shifts) - 1) / len(self.shifts)


def estimate_pooled_covariance(
    rows: EffectRows, runs: rows_of.Runs, ratio: float, deviation: float, freedom: float
) -> PooledCovariance:
    """The covariance from the rows that are active and the residuals of the pooled law.

    ratio      of the residual variance of a row to that of the effects
    deviation  standard deviation of a coefficient of the effects between specimens, with its
               degrees of freedom

    The groups are the runs where each specimen has three or more. Otherwise they are successive
    parts of the runs, as few as determine the errors, if the rows follow in time or are correlated
    in their order; if not, the rows are independent, and count with their effective number.
    """
    counts = [np.unique(runs.run[rows.member == i]).size for i in range(rows.specimens)]
    run_count = int(np.unique(runs.run).size)
    total = rows.sums()
    population = np.linalg.inv(total.xx)
    shrunk = np.linalg.inv(total.zz + ratio * np.eye(len(total.zz)))
    projected = population @ total.xz  # effects of the rows that the population law takes up
    smoother = shrunk @ (total.zz - total.xz.T @ projected)
    by_rows = np.block([[population, np.zeros(projected.shape)], [-shrunk @ projected.T, shrunk]])
    values, vectors = np.linalg.eigh(by_rows @ total.moments @ by_rows.T)
    independent = PooledCovariance(
        by_effects=deviation * np.vstack([projected, smoother - np.eye(len(smoother))]),
        by_rows=by_rows,
        shifts=(vectors * np.sqrt(ratio * np.maximum(values, 0.0))).T * deviation,
        moments=total.moments[None],
        freedom=freedom,
        unit=rows_of.ROWS,
        run_count=run_count,
        rows=int(total.rows),
    )
    found = (
        _by_groups(independent, rows, ratio, runs.run, rows_of.RUNS)
        if min(counts) >= rows_of.MIN_GROUPS
        else None
    )
    parts = 2
    in_order = runs.in_time or rows_of.is_correlated(rows.residuals, runs.run)
    while (
        found is None
        and in_order
        and run_count * parts * rows_of.MIN_GROUP_ROWS <= len(rows.member)
    ):
        found = _by_groups(
            independent, rows, ratio, rows_of.successive_parts(runs.run, parts), rows_of.PARTS
        )
        parts += 1
    return found or independent


def _by_groups(
    independent: PooledCovariance, rows: EffectRows, ratio: float, group: rows_of.Indices, unit: str
) -> PooledCovariance | None:
    """The covariance by groups (N,); None where the others of a group do not determine the
    estimates.
    """
    sums = [rows.sums(group == i) for i in np.unique(group)]
    total = rows.sums()
    root = np.linalg.inv(np.linalg.cholesky(total.xx))
    if any(np.linalg.eigvalsh(root @ each.xx @ root.T)[-1] > 1 - _MIN_SHARE for each in sums):
        return None
    shifts = np.array([total.without(each).estimates(ratio) for each in sums]) - total.estimates(
        ratio
    )
    moments = np.array([each.moments for each in sums])
    found = dataclasses.replace(independent, shifts=shifts, unit=unit, moments=moments)
    freedoms = found.group_freedoms(np.eye(shifts.shape[1]))
    return found if float(np.median(freedoms)) >= MIN_DEGREES_OF_FREEDOM else None

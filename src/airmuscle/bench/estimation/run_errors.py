"""Errors that the rows of a run share, by variance components of restricted likelihood.

The residuals of a run have a part that is independent from row to row, an error that follows a
shape in the whole run (`Shape`: its zero, its gain), and a slow change, whose correlation decays
with the distance of the rows. The variances of shape and change, as multiples kappa and lambda of
that of a row, follow from the restricted likelihood of the residuals beside the parameters and the
terms of the form error (`form_terms`): what these take up is no evidence of scatter.

With few runs the likelihood determines neither the shape nor the variances. Each combination counts
with its restricted likelihood and a prior that is uniform in ln(1 + n kappa) and ln(1 + m lambda),
with the greatest eigenvalues n and m of their correlations; it makes the interval of a mean that of
Student. With A = (J^T J)^-1 the variance of a combination a of parameters is

    sigma^2 a^T A (J^T D J + kappa J^T S J + lambda J^T C J) A a,

S are the correlations of the shape, C those of the change, and D the variances of the cells over
their mean. The mean and the variance of its inverse give a scale and degrees of freedom of
Student's distribution.

Where every level of the held quantity was measured once, the form error and the offsets of the runs
cannot be told apart: then the changes within the runs alone count, and the scatter between them is
not known.

References: Harville (1977), "Maximum likelihood approaches to variance component estimation and to
related problems", Journal of the American Statistical Association 72, 320-338; Box and Tiao (1973),
"Bayesian inference in statistical analysis", chapter 5; Satterthwaite (1946), Biometrics 2, 110.
"""

import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...core import Array
from .form_terms import MIN_SPARE_RUNS, Cells, Conditions, FormTerms, Indices, form_terms

MAX_RUNS = 60
"""Number of runs that give the likelihood (chosen)."""
MAX_CELLS = 240
MAX_CELLS_OF_RUN = 20
MIN_CELLS_OF_RUN = 4
"""Number of cells of all runs, greatest and least number of one (chosen)."""
CELLS_A_PARAMETER = 4
"""Number of cells for each parameter (chosen)."""
SLOW_CHANGES = (0.1, 0.5)
"""Distances, in durations of a run, over which slow changes are correlated, where the scatter of
the runs is known (chosen)."""
SHORT_CHANGES = (0.05, 0.1, 0.3)
"""Such distances where it is not known: an offset of the runs has no evidence then (chosen)."""
EXPONENTS_OF_SHAPE = np.linspace(0.0, 14.0, 57)
EXPONENTS_OF_CHANGE = np.linspace(0.0, 12.0, 17)
"""Values of ln(1 + n kappa) and ln(1 + m lambda) (chosen)."""
LEAST_REST = 0.2
"""Least share of the variance of a cell that the parameters and terms leave (chosen)."""
_LEAST_WEIGHT = 1e-7
"""Weight of a combination that counts as zero (chosen)."""
_LEAST_SQUARES = 1e-12
"""Sum of squares, as a fraction of that without errors of runs, that counts as zero (chosen)."""
_ROUNDING = 1e-8
"""Variance beside the parameters and terms, as a fraction of the greatest, that counts as zero
(chosen)."""


class Pairs(NamedTuple):
    """Combinations of a shape, a slow change and their variances, shape (C,) each."""

    likelihood: Array
    """Logarithm of the restricted likelihood."""
    squares: Array
    """Sum of the squared residuals in the metric of the errors."""
    of_shape: Array
    """kappa"""
    of_change: Array
    """lambda"""
    shape: Indices
    change: Indices
    """Number of the shape and of the change."""


@dataclasses.dataclass(frozen=True, eq=False)
class RunErrors:
    """Covariance of P combinations of the parameters, in the orthonormal basis of the Jacobian, as
    a mixture of C combinations of variances."""

    weights: Array
    """Weights of the combinations (C,), whose sum is 1."""
    variances: Array
    """Variance of the independent part of a row (C,)."""
    pairs: Pairs
    independent: Array
    """J^T D J of the independent part (P, P)."""
    of_shapes: Array
    of_changes: Array
    """J^T S J of each shape and J^T C J of each change (number, P, P)."""
    spare: int
    """Degrees of freedom of the variances for given ratios."""
    knows_runs: bool
    """Whether the scatter between the runs is contained."""

    def student(self, rows: Array) -> tuple[Array, Array]:
        """Variance and degrees of freedom of Student's distribution, shape (K,) each, of
        combinations (K, P)."""
        lengths = np.linalg.norm(rows, axis=1)
        is_zero = lengths == 0.0
        units = rows / np.where(is_zero, 1.0, lengths)[:, None]
        units[is_zero, 0] = 1.0
        precisions = 1.0 / self._mixed(units)
        mean = self.weights @ precisions
        mean_square = self.weights @ precisions**2
        square = (1.0 + 2.0 / self.spare) * mean_square
        freedoms = 2.0 * mean**2 / (square - mean**2)
        return lengths**2 / mean, freedoms

    def _mixed(self, units: Array) -> Array:
        """The variances (C, K) of combinations (K, P)."""
        pairs = self.pairs
        independent = _quadratic(units, self.independent[None])
        shapes = _quadratic(units, self.of_shapes)[pairs.shape]
        changes = _quadratic(units, self.of_changes)[pairs.change]
        kappa = pairs.of_shape[:, None]
        lambdas = pairs.of_change[:, None]
        total = independent + kappa * shapes + lambdas * changes
        return np.asarray(self.variances[:, None] * total)

    @property
    def matrix(self) -> Array:
        """A covariance (P, P) of their correlations: the mean of all combinations, each with the
        inverse of its trace."""
        kappa = self.pairs.of_shape
        lambda_ = self.pairs.of_change
        totals = (
            np.trace(self.independent)
            + kappa * np.trace(self.of_shapes, axis1=1, axis2=2)[self.pairs.shape]
            + lambda_ * np.trace(self.of_changes, axis1=1, axis2=2)[self.pairs.change]
        )
        shares = self.weights / totals
        by_shape = np.bincount(self.pairs.shape, shares * kappa, len(self.of_shapes))
        by_change = np.bincount(self.pairs.change, shares * lambda_, len(self.of_changes))
        return np.asarray(
            np.sum(shares) * self.independent
            + np.tensordot(by_shape, self.of_shapes, 1)
            + np.tensordot(by_change, self.of_changes, 1)
        )


def _quadratic(units: Array, matrices: Array) -> Array:
    """u^T M u of vectors (K, P) and matrices (number, P, P), shape (number, K)."""
    return np.asarray(np.einsum("ki,cij,kj->ck", units, matrices, units, optimize=True))


def estimate_run_errors(
    design: Array, residuals: Array, run: Indices, conditions: Conditions, *, in_order: bool
) -> RunErrors | None:
    """The errors of the runs, from the design (N, P) of orthonormal columns and the residuals (N,);
    the rows of a run (N,) follow each other. None where neither the runs nor the order of their
    rows show which errors the rows share.

    in_order  whether the order of the rows of a run has a meaning

    Of more than `MAX_RUNS` runs an evenly spaced part gives the likelihood.
    """
    number = np.unique(run, return_inverse=True)[1]
    conditions = conditions.scaled()
    parts = -(-(int(number[-1]) + 1) // MAX_RUNS)
    blocks = [number % parts == part for part in range(parts)]
    cells = _cells(number[blocks[0]], design.shape[1])
    left, _, right = np.linalg.svd(cells.scaled(design[blocks[0]]), full_matrices=False)
    basis = left @ right
    terms = form_terms(cells, basis, conditions.rows(blocks[0]))
    kinds = _Kinds.of(terms, in_order=in_order)
    described = np.hstack([basis, terms.columns])
    spare = len(cells.count) - described.shape[1]
    scaled = cells.scaled(residuals[blocks[0]])
    rest = scaled - described @ (described.T @ scaled)
    if spare < MIN_SPARE_RUNS or not (kinds.shapes or kinds.changes) or not rest.any():
        return None
    errors = _Likelihood(cells, described, rest, kinds, conditions.rows(blocks[0]))
    pairs = errors.pairs()
    weights = np.exp(pairs.likelihood - np.max(pairs.likelihood))
    counted = weights > _LEAST_WEIGHT * np.sum(weights)
    products = [
        kinds.products(
            _cells(number[block], design.shape[1]), design[block], conditions.rows(block)
        )
        for block in blocks
    ]
    of_shapes, of_changes = (np.sum(part, axis=0) for part in zip(*products, strict=True))
    return RunErrors(
        weights[counted] / np.sum(weights[counted]),
        pairs.squares[counted] / spare,
        Pairs(*(values[counted] for values in pairs)),
        _independent_part(basis, described, rest),
        of_shapes,
        of_changes,
        spare,
        terms.knows_runs,
    )


def _independent_part(basis: Array, described: Array, rest: Array) -> Array:
    """J^T D J of errors with the variance of each cell over the mean one, D, from what the
    parameters and terms leave (M,), for the orthonormal columns of the design (M, P)."""
    leverage = np.sum(described**2, axis=1)
    left = np.maximum(1.0 - leverage, LEAST_REST)
    squares = rest**2 / left
    relative = squares / np.mean(squares)
    return np.asarray(basis.T @ (relative[:, None] * basis))


def _cells(run: Indices, parameters: int) -> Cells:
    """The cells of the runs (N,), enough for a number of parameters."""
    count = np.unique(run).size
    most = int(np.clip(MAX_CELLS // count, MIN_CELLS_OF_RUN, MAX_CELLS_OF_RUN))
    return Cells.of(run, max(most, -(-CELLS_A_PARAMETER * parameters // count)))


OFFSET = "offset"
GAIN = "gain"
TILT = "tilt"
STRETCH = "stretch"
"""Errors of a run that are constant, proportional to the modelled and to the swept quantity, and
those of a gain of the swept quantity."""


class _Kinds(NamedTuple):
    """The shapes of the errors of a run, each of one or two independent errors with one variance,
    and the distances of the slow changes."""

    shapes: Sequence[tuple[str, ...]]
    changes: Sequence[float]
    second_is_swept: bool
    forms: Sequence[Array] = ()
    """Columns of the cells (M, K) that are form in place of a shape, equal in every repeat."""

    @classmethod
    def of(cls, terms: FormTerms, *, in_order: bool) -> "_Kinds":
        """What the terms and the order of the rows leave open."""
        if not terms.knows_runs:
            return cls((), SHORT_CHANGES if in_order else (), terms.second_is_swept)
        shapes: list[tuple[str, ...]] = [(OFFSET,)]
        if terms.spare_gains >= MIN_SPARE_RUNS:
            shapes += [(GAIN,), (OFFSET, GAIN)]
        if terms.spare_tilts >= MIN_SPARE_RUNS:
            shapes += [(OFFSET, TILT)]
        if min(terms.spare_gains, terms.spare_stretches) >= MIN_SPARE_RUNS:
            shapes += [(GAIN, STRETCH)]
        changes = SLOW_CHANGES if in_order else ()
        return cls(shapes, changes, terms.second_is_swept, terms.further)

    def modes(self, cells: Cells, conditions: Conditions) -> list[Array]:
        """The means of each shape in each cell, (M, errors) for each shape."""
        stretch = conditions.gain_of_swept(second_is_swept=self.second_is_swept)
        quantities = {
            OFFSET: np.ones(len(cells.count)),
            GAIN: cells.sums(conditions.modelled) / cells.count,
            TILT: cells.sums(conditions[int(self.second_is_swept)]) / cells.count,
            STRETCH: cells.sums(stretch) / cells.count,
        }
        return [np.stack([quantities[name] for name in shape], axis=1) for shape in self.shapes]

    def products(self, cells: Cells, design: Array, conditions: Conditions) -> tuple[Array, Array]:
        """J^T S J of each shape and J^T C J of each change, of the rows of the cells, (number, P,
        P); one of zeros where there is none, and for each form, which is no scatter."""
        sums = cells.sums(design)
        parameters = design.shape[1]
        zero = np.zeros((parameters, parameters))
        numbers = np.arange(int(cells.run[-1]) + 1)
        members = cells.run[:, None] == numbers
        of_shapes = [zero] if not self.shapes else []
        for modes in self.modes(cells, conditions):
            product = zero
            for mode in modes.T:
                gradients = members.T @ (mode[:, None] * sums)
                product = product + gradients.T @ gradients
            of_shapes.append(product)
        of_shapes += [zero for _ in self.forms]
        of_changes = [zero] if not self.changes else []
        for distance in self.changes:
            product = zero
            for rows in runs_of(cells):
                correlation = _correlation(cells.place[rows], distance)
                product = product + sums[rows].T @ correlation @ sums[rows]
            of_changes.append(product)
        return np.array(of_shapes), np.array(of_changes)


def runs_of(cells: Cells) -> Iterator[slice]:
    """The cells of each run."""
    steps = np.diff(cells.run, prepend=-1, append=cells.run[-1] + 1)
    limits = np.flatnonzero(steps).tolist()
    for start, end in itertools.pairwise(limits):
        yield slice(start, end)


def _correlation(place: Array, distance: float) -> Array:
    """The correlations of a slow change between the cells of a run at these places (M,)."""
    apart = np.abs(place[:, None] - place)
    return np.asarray(np.exp(-apart / distance))


@dataclasses.dataclass(frozen=True, eq=False)
class _Likelihood:
    """The restricted likelihood of what the parameters and terms, orthonormal columns (M, K), leave
    of the residuals of the cells (M,)."""

    cells: Cells
    described: Array
    rest: Array
    kinds: _Kinds
    conditions: Conditions

    def pairs(self) -> Pairs:
        """All combinations of variances, shapes and changes."""
        changes = self.kinds.changes or (None,)
        found = [
            combination
            for number, distance in enumerate(changes)
            for combination in self._of_change(number, distance)
        ]
        return Pairs(*(np.concatenate(values) for values in zip(*found, strict=True)))

    def _of_change(self, number: int, distance: float | None) -> Iterator[Pairs]:
        """The combinations of a slow change with each of its variances; None is no change."""
        columns = np.hstack([self.described, self.rest[:, None]])
        parts = [columns, *self._modes()]
        variances = np.zeros(len(columns))
        exponents = np.zeros(1)
        if distance is not None:
            parts = [part.copy() for part in parts]
            variances = self._rotate(parts, distance)
            exponents = EXPONENTS_OF_CHANGE
        greatest = max(float(np.max(variances)), 1.0)
        for ratio in np.expm1(exponents) / greatest:
            deviations = np.sqrt(1.0 + ratio * variances)[:, None]
            metric = _Metric.of(parts[0] / deviations, self.spare, deviations)
            for shape, modes in enumerate(parts[1:]):
                kappa, squares, likelihood = metric.profile(modes / deviations)
                size = kappa.size
                yield Pairs(
                    likelihood=likelihood,
                    squares=squares,
                    of_shape=kappa,
                    of_change=np.full(size, ratio),
                    shape=np.full(size, shape),
                    change=np.full(size, number),
                )

    def _modes(self) -> list[Array]:
        """The columns of the errors of each shape (M, L); without columns if there is none."""
        members = self.cells.members
        shapes = []
        for modes in self.kinds.modes(self.cells, self.conditions):
            columns = [members * mode[:, None] for mode in modes.T]
            shapes.append(np.hstack(columns))
        shapes += self.kinds.forms
        return shapes or [members[:, :0]]

    def _rotate(self, parts: Sequence[Array], distance: float) -> Array:
        """Columns (M, ...) of the cells become those of the modes of a slow change, whose variances
        (M,) are returned."""
        cells = self.cells
        roots = np.sqrt(cells.count)
        variances = np.zeros(len(roots))
        for rows in runs_of(cells):
            correlation = _correlation(cells.place[rows], distance)
            values, vectors = np.linalg.eigh(roots[rows, None] * correlation * roots[rows])
            variances[rows] = np.maximum(values, 0.0)
            for part in parts:
                part[rows] = vectors.T @ part[rows]
        return variances

    @property
    def spare(self) -> int:
        """Degrees of freedom that parameters and terms leave."""
        rows, terms = self.described.shape
        return int(rows - terms)


class _Metric(NamedTuple):
    """Parameters, terms and residuals in the metric of independent errors and a slow change."""

    directions: Array
    """Orthonormal columns of parameters and terms (M, K)."""
    rest: Array
    """What they leave of the residuals (M,)."""
    spare: int
    likelihood: float
    """Logarithm of the restricted likelihood, but for the sum of squares."""

    @classmethod
    def of(cls, columns: Array, spare: int, deviations: Array) -> "_Metric":
        """The metric from the scaled columns (M, K + 1), and the deviations of the errors by which
        they were divided."""
        residuals = columns[:, -1]
        terms = columns[:, :-1]
        directions, triangle = np.linalg.qr(terms)
        modelled = directions @ (directions.T @ residuals)
        rest = residuals - modelled
        of_terms = np.sum(np.log(np.abs(np.diag(triangle))))
        of_errors = np.sum(np.log(deviations))
        return cls(directions, rest, spare, -float(of_terms + of_errors))

    def profile(self, modes: Array) -> tuple[Array, Array, Array]:
        """kappa, the sum of squares and the logarithm of the restricted likelihood for errors of
        these modes (M, L), shape (57,) each; of kappa 0 alone without modes."""
        total = float(self.rest @ self.rest)
        if not modes.shape[1]:
            of_total = 0.5 * self.spare * np.log(total)
            alone = self.likelihood - of_total
            return np.zeros(1), np.array([total]), np.array([alone])
        squares_of_modes = np.linalg.eigvalsh(modes.T @ modes)
        greatest = float(squares_of_modes[-1])
        eigenvalues, components = self._components(modes, _ROUNDING * greatest)
        kappa = np.expm1(EXPONENTS_OF_SHAPE) / greatest
        ratios = kappa[:, None]
        growth = 1.0 + ratios * eigenvalues
        shares = ratios / growth
        explained = np.sum(shares * components, axis=1)
        left = total - explained
        least = _LEAST_SQUARES * total
        squares = np.maximum(left, least)
        determinant = np.sum(np.log(growth), axis=1)
        of_squares = self.spare * np.log(squares)
        likelihood = self.likelihood - 0.5 * (determinant + of_squares)
        return kappa, squares, likelihood

    def _components(self, modes: Array, least: float) -> tuple[Array, Array]:
        """Of modes (M, L) beside the parameters and terms the variances above the least one, and
        the squares of the residuals along them, (K,) each."""
        directions = self.directions
        described = directions @ (directions.T @ modes)
        left = modes - described
        eigenvalues, vectors = np.linalg.eigh(left.T @ left)
        is_known = eigenvalues > least
        along = vectors[:, is_known]
        gradients = along.T @ (modes.T @ self.rest)
        return eigenvalues[is_known], gradients**2

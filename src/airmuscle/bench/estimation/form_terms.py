"""Terms of the form error of a law and of the loop of both branches, which all runs share.

They are polynomials of the two arguments of the law, and of the direction of the motion times such
polynomials. Only what they leave is the scatter of the runs. Within the runs they have no mean, so
that they take up no offset of a run. Where one quantity is held in each run, the force over the
other one is described as a polynomial of the held one, and so is the mean of a run, up to the
greatest degree that leaves `SPARE_RUNS` combinations of run offsets.
"""

import dataclasses
import functools
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import Array
from ..inspection import RELATIVE_BAND, level_intervals

FORM_DEGREE = 5
"""Degree of the form error along a run (chosen)."""
LOOP_DEGREE = 3
"""Degree of the width of the loop (chosen)."""
GREATEST_HELD_DEGREE = 6
"""Greatest degree of the form error in a quantity that is held in each run (chosen)."""
GAIN_DEGREE = 4
"""Degree of the polynomial that gives the changes for a relative change of an argument (chosen)."""
SPARE_RUNS = 4
"""Combinations of run offsets that the form error in the held quantity leaves, where there are as
many (chosen: 92 to 98 % of 95 % intervals of laboratories held)."""
FURTHER_DEGREES = 1
"""Greatest number of further degrees that may be form or scatter (chosen)."""
LEFT_RUNS = 2
"""Combinations of run offsets that these leave (chosen)."""
MIN_SPARE_RUNS = 3
"""Least number of combinations of run offsets by which their variance is estimated (chosen)."""
HELD = 0.1
"""Range of 80 % of the rows of a run, as a fraction of that of all rows, up to which a quantity is
held (chosen)."""
ROWS_A_TERM = 2.0
"""Least number of cells for each term and parameter (chosen)."""
_LEFT = 0.02
"""Square of the part of a unit vector that counts as not described (chosen)."""
_NEGLIGIBLE = 1e-5
"""Relative length of a column below which others describe it (chosen)."""

Indices = npt.NDArray[np.intp]


@dataclasses.dataclass(frozen=True, eq=False)
class Cells:
    """M cells of successive rows of R runs."""

    first: Indices
    """The first row of each cell (M,)."""
    count: Array
    """The number of rows (M,)."""
    run: Indices
    """The run (M,), from 0 to R - 1."""
    place: Array
    """The place in the run (M,), from 0 to 1."""

    @classmethod
    def of(cls, run: Indices, most: int) -> "Cells":
        """At most this number of cells of each run (N,), whose rows follow each other."""
        numbers, starts = np.unique(run, return_index=True)
        ends = np.append(starts[1:], run.size)
        first = []
        member = []
        place = []
        for number in range(numbers.size):
            start = int(starts[number])
            size = int(ends[number]) - start
            cells = min(size, most)
            within = np.arange(cells)
            first.append(start + -(-within * size // cells))
            member.append(np.full(cells, number))
            place.append((within + 0.5) / cells)
        begin = np.concatenate(first)
        limits = np.append(begin, run.size)
        count = np.diff(limits).astype(float)
        return cls(begin, count, np.concatenate(member), np.concatenate(place))

    def sums(self, rows: Array) -> Array:
        """The sums over the rows of each cell, (M, ...) of (N, ...)."""
        return np.asarray(np.add.reduceat(rows, self.first, axis=0))

    def scaled(self, rows: Array) -> Array:
        """The means of the cells times the root of their number of rows (M, ...), whose errors have
        the variance of a row where rows are independent."""
        roots = np.sqrt(self.count)
        return np.asarray((self.sums(rows).T / roots).T)

    @functools.cached_property
    def members(self) -> Array:
        """The column of each run, (M, R), with its offset as `scaled` has it."""
        number = np.arange(int(self.run[-1]) + 1)
        return np.asarray((self.run[:, None] == number) * np.sqrt(self.count)[:, None])

    def without_means(self, columns: Array) -> Array:
        """Scaled columns (M, K) less their mean in each run."""
        members = self.members
        return np.asarray(
            columns - members @ ((members.T @ columns) / np.sum(members**2, axis=0)[:, None])
        )


class Conditions(NamedTuple):
    """The two arguments of a law and the modelled quantity of each row, and the direction of the
    motion (1, -1, or 0 where it is not known); shape (N,) each, without units for `form_terms`."""

    first: Array
    second: Array
    modelled: Array
    direction: Array
    gain_of_first: Array
    gain_of_second: Array
    """Change of the modelled quantity for a relative change of each argument, x dF/dx."""

    @classmethod
    def of(cls, first: Array, second: Array, modelled: Array, direction: Array) -> "Conditions":
        """The conditions with the gains of both arguments, from a polynomial of the modelled
        quantity."""
        gains = _gains_of_arguments(first, second, modelled)
        return cls(first, second, modelled, direction, *gains)

    def rows(self, selection: npt.NDArray[np.bool_] | Indices) -> "Conditions":
        """The conditions of a selection of the rows, a mask (N,) or their indices."""
        return Conditions(*(values[selection] for values in self))

    def scaled(self) -> "Conditions":
        """With both arguments on a scale from -1 to 1, and the modelled quantity and its changes in
        its root mean square."""
        size = float(np.sqrt(np.mean(self.modelled**2)))
        unit = size if size > 0.0 else 1.0
        return Conditions(
            first=_scaled(self.first),
            second=_scaled(self.second),
            modelled=self.modelled / unit,
            direction=self.direction,
            gain_of_first=self.gain_of_first / unit,
            gain_of_second=self.gain_of_second / unit,
        )

    def gain_of_swept(self, *, second_is_swept: bool) -> Array:
        """The change for a relative change of the swept argument."""
        return self.gain_of_second if second_is_swept else self.gain_of_first


class FormTerms(NamedTuple):
    """Columns of the terms (M, K) of the cells, orthonormal and orthogonal to the parameters, and
    how many combinations of run offsets and of run gains are left."""

    columns: Array
    spare_offsets: int
    spare_gains: int
    spare_tilts: int
    """The same of what is proportional to the swept quantity in each run."""
    spare_stretches: int
    """The same of a relative change of the swept quantity in each run."""
    second_is_swept: bool
    """Whether the runs sweep the second argument, and hold the first."""
    further: tuple[Array, ...] = ()
    """Columns (M, K) of the means of the runs in the next degrees of the held quantity, which may
    be form or scatter."""

    @property
    def knows_runs(self) -> bool:
        """Whether the variance of run offsets can be estimated."""
        return self.spare_offsets >= MIN_SPARE_RUNS


def form_terms(cells: Cells, design: Array, conditions: Conditions) -> FormTerms:
    """The terms for a design of the parameters (M, P), whose columns are orthonormal."""
    for degree in range(FORM_DEGREE, -1, -1):
        terms = _Terms.of(cells, design, conditions, degree).chosen()
        if ROWS_A_TERM * (design.shape[1] + terms.columns.shape[1]) <= len(cells.count):
            break
    return terms


@dataclasses.dataclass(frozen=True, eq=False)
class _Terms:
    """The terms of one degree along the runs."""

    cells: Cells
    design: Array
    conditions: Conditions
    degree: int
    swept: Array
    """The quantity that the runs sweep (N,)."""
    other: Array
    levels: int
    """Levels of the other quantity, if it is held in each run, else 0."""
    second_is_swept: bool

    @classmethod
    def of(cls, cells: Cells, design: Array, conditions: Conditions, degree: int) -> "_Terms":
        first = conditions.first
        second = conditions.second
        of_first = _held_levels(first, cells)
        of_second = _held_levels(second, cells)
        second_is_swept = of_first > 0 and not of_second
        swept, other = (second, first) if second_is_swept else (first, second)
        return cls(
            cells=cells,
            design=design,
            conditions=conditions,
            degree=degree,
            swept=swept,
            other=other,
            levels=0 if of_first and of_second else of_first + of_second,
            second_is_swept=second_is_swept,
        )

    def chosen(self) -> FormTerms:
        """The terms that leave enough run offsets; where there are too few, those of a further law
        of half the degree that the levels determine, and every run offset."""
        terms = self.of_degree(0 if self.levels else self.degree)
        if not terms.knows_runs:
            return self.of_degree((self.levels - 1) // 2 if self.levels else self.degree, runs=True)
        spare = min(SPARE_RUNS, terms.spare_offsets, terms.spare_gains)
        for held in range(1, min(self.levels, GREATEST_HELD_DEGREE + 1)):
            further = self.of_degree(held)
            if min(further.spare_offsets, further.spare_gains) < spare:
                break
            terms = further
        return terms._replace(further=tuple(self._further(terms)))

    def _further(self, terms: FormTerms) -> Iterator[Array]:
        """The means of the runs of the next degrees in the held quantity, that neither the law nor
        the terms contain, of one degree and two, while offsets are left."""
        described = np.hstack([self.design, terms.columns])
        for held in range(1, self.levels - 1):
            means = self._means(held)
            count = _left_over(means, described)
            if count > min(FURTHER_DEGREES, terms.spare_offsets - LEFT_RUNS):
                break
            if count:
                yield _orthonormal(means, described)[:, -count:]

    def of_degree(self, held: int, *, runs: bool = False) -> FormTerms:
        """The terms of a degree in the other quantity; `runs` adds every run offset."""
        cells = self.cells
        members = cells.members
        powers = [self._along_runs[order] for order in range(held + 1)]
        within = cells.without_means(np.hstack(powers))
        offsets = [members] if runs else []
        columns = _orthonormal(np.hstack([within, *offsets, self._means(held)]), self.design)
        described = np.hstack([self.design, columns])
        conditions = self.conditions
        stretch = conditions.gain_of_swept(second_is_swept=self.second_is_swept)
        of_offsets, of_gains, of_tilts, of_stretches = (
            _left_over(self._in_runs(values), described)
            for values in (np.ones(len(self.swept)), conditions.modelled, self.swept, stretch)
        )
        return FormTerms(
            columns=columns,
            spare_offsets=of_offsets,
            spare_gains=of_gains,
            spare_tilts=of_tilts,
            spare_stretches=of_stretches,
            second_is_swept=self.second_is_swept,
        )

    def _in_runs(self, values: Array) -> Array:
        """A quantity (N,) in each run, less its mean there unless it is constant, (M, R)."""
        cells = self.cells
        columns = cells.members * (cells.scaled(values) / np.sqrt(cells.count))[:, None]
        return columns if float(np.ptp(values)) == 0.0 else cells.without_means(columns)

    @functools.cached_property
    def _along_runs(self) -> list[Array]:
        """The terms along the runs of each degree in the other quantity, (M, K) each."""
        most = self.degree
        if self.levels:
            most = min(self.levels - 1, GREATEST_HELD_DEGREE)
        loop_degree = min(LOOP_DEGREE, self.degree)
        along = np.polynomial.chebyshev.chebvander(self.swept, self.degree)
        across = np.polynomial.chebyshev.chebvander(self.other, most)
        direction = self.conditions.direction[:, None]
        terms = []
        for order in range(most + 1):
            power = across[:, [order]]
            # without a held quantity the degree is the total one
            less = 0 if self.levels else order
            orders = self.degree + 1 - less
            smooth = power * along[:, :orders]
            orders_of_loop = 0 if order > loop_degree else loop_degree + 1 - less
            loop = power * direction * along[:, :orders_of_loop]
            terms.append(self.cells.scaled(np.hstack([smooth, loop])))
        return terms

    def _means(self, held: int) -> Array:
        """The powers of the level of each run, (M, held)."""
        members = self.cells.members
        if not self.levels:
            return np.zeros((len(members), 0))
        rows = np.sum(members**2, axis=0)
        sums = members.T @ self.cells.scaled(self.other)
        powers = np.polynomial.chebyshev.chebvander(sums / rows, held)
        return np.asarray(members @ powers[:, 1:])


def _gains_of_arguments(first: Array, second: Array, modelled: Array) -> tuple[Array, Array]:
    """x dF/dx of both arguments (N,), from a polynomial of the modelled quantity over both."""
    scaled = (_scaled(first), _scaled(second))
    surface = _surface_of(*scaled, modelled)
    gains = []
    for axis, values in enumerate((first, second)):
        span = float(np.ptp(values))
        per_unit = 2.0 / span if span > 0.0 else 0.0
        derivative = np.polynomial.chebyshev.chebder(surface, axis=axis)
        slope = np.polynomial.chebyshev.chebval2d(*scaled, derivative)
        gains.append(slope * per_unit * values)
    return gains[0], gains[1]


def _surface_of(first: Array, second: Array, values: Array) -> Array:
    """The Chebyshev coefficients (K, K) of values (N,) over two scaled arguments, up to the total
    degree `GAIN_DEGREE`."""
    orders = np.arange(GAIN_DEGREE + 1)
    is_used = (orders[:, None] + orders) <= GAIN_DEGREE
    degrees = (GAIN_DEGREE, GAIN_DEGREE)
    columns = np.polynomial.chebyshev.chebvander2d(first, second, degrees)
    coefficients = np.zeros(is_used.shape)
    used_columns = columns[:, is_used.ravel()]
    coefficients[is_used] = np.linalg.lstsq(used_columns, values, rcond=1e-9)[0]
    return coefficients


def _scaled(values: Array) -> Array:
    """The values on a scale from -1 to 1."""
    span = float(np.ptp(values))
    if not span > 0.0:
        return np.zeros(values.size)
    return np.asarray(2.0 * (values - np.min(values)) / span - 1.0)


def _held_levels(values: Array, cells: Cells) -> int:
    """The number of levels of a quantity (N,) on a scale from -1 to 1 that is held in each
    run; 0 of one that is not, or is at one level."""
    is_first = np.diff(cells.run, prepend=-1) > 0
    starts = cells.first[is_first]
    runs = np.split(values, starts[1:])
    range_of_levels = 2.0 * HELD
    medians = []
    for run in runs:
        low, middle, high = np.quantile(run, [0.1, 0.5, 0.9])
        if high - low > range_of_levels:
            return 0
        medians.append(middle)
    levels = np.sort(medians)
    if np.ptp(levels) <= range_of_levels:
        return 0
    return sum(1 for _ in level_intervals(levels, 2.0 * RELATIVE_BAND))


def _orthonormal(columns: Array, design: Array) -> Array:
    """An orthonormal basis (M, K) of what columns (M, L) have beside a design (M, P) of orthonormal
    columns."""
    lengths = np.linalg.norm(columns, axis=0)
    greatest = float(np.max(lengths, initial=0.0))
    columns = columns[:, lengths > _NEGLIGIBLE * greatest]
    if not columns.shape[1]:
        return columns
    rest = columns / np.linalg.norm(columns, axis=0)
    for _ in range(2):  # the second time removes what rounding has left
        rest = rest - design @ (design.T @ rest)
    values, vectors = np.linalg.eigh(rest.T @ rest)
    is_new = values > _NEGLIGIBLE * values[-1]
    directions = vectors[:, is_new]
    deviations = np.sqrt(values[is_new])
    basis = rest @ (directions / deviations)
    in_design = design @ (design.T @ basis)
    return np.linalg.qr(basis - in_design)[0]


def _left_over(columns: Array, described: Array) -> int:
    """The number of combinations of columns (M, R) that orthonormal ones (M, K) do not describe."""
    lengths = np.linalg.norm(columns, axis=0)
    is_column = lengths > 0.0
    units = columns[:, is_column] / lengths[is_column]
    rest = units - described @ (described.T @ units)
    squares = np.linalg.eigvalsh(rest.T @ rest)
    return int(np.count_nonzero(squares > _LEFT))

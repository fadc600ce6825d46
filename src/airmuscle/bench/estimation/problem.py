"""LeastSquaresProblem: rows with measured values or bounds, and the named, bounded parameters of
what is fitted to them.
"""

import abc
from collections.abc import Sequence
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from ...core import Array, Hint, IdentificationError

BOUND_MARGIN = 1e-6
"""Relative distance from a bound within which a parameter is on it (chosen)."""
MAX_NAMES = 3
"""Maximum number of parameters that the cause of a rank deficiency lists (chosen)."""
_RELATIVE_STEP = float(np.cbrt(np.finfo(float).eps))
"""Step of a central difference, relative to the parameter."""


class FreeParameter(NamedTuple):
    """A parameter that is fitted: its path, a short label, its initial value, bounds and unit
    [SI].
    """

    name: str
    label: str
    initial: float
    bounds: tuple[float, float]
    unit: str
    meaning: str
    is_linear: bool = False
    """Whether the fitted quantity is linear in it."""


class LeastSquaresSolution(NamedTuple):
    """The optimal free parameters (P,), with the fitted quantity (N,) and its Jacobian (N, P)
    there.
    """

    values: Array
    modelled: Array
    jacobian: Array


class RankDeficiency(NamedTuple):
    """Parameters that the rows do not separate: the labels of those with a share in the null space,
    the index of the one with the greatest share, and the rank and number of all parameters."""

    labels: list[str]
    greatest: int
    rank: int
    parameters: int

    @property
    def listed(self) -> str:
        """The first of the labels, and the number of the others."""
        first = ", ".join(self.labels[:MAX_NAMES])
        further = len(self.labels) - MAX_NAMES
        return f"{first} and {further} other parameters" if further > 0 else first

    @property
    def cause(self) -> str:
        """The phrase that completes "the data"."""
        if len(self.labels) == 1:
            return f"do not depend on {self.labels[0]}"
        if len(self.labels) <= MAX_NAMES:
            return f"cannot separate {' and '.join(self.labels)}"
        return f"cannot separate {self.labels[0]} and {len(self.labels) - 1} other parameters"

    @property
    def statement(self) -> str:
        """The same with more of the labels."""
        return self.cause if len(self.labels) == 1 else f"cannot separate {self.listed}"


class LeastSquaresProblem(abc.ABC):
    """N rows and P free parameters. A kind of fit brings its parameters, the fitted quantity at
    every row with its Jacobian, and the selection of rows; solvers, covariance, intervals and
    refits know no more of it.
    """

    target: Array
    """Measured value, or the bound of a censored row, in the fitted quantity [SI]; shape (N,)."""
    censoring: Array
    """0 uncensored, 1 the model may lie below the target, -1 it may lie above; shape (N,)."""
    weights: Array
    """Factors of the residuals, with a root mean square of 1; shape (N,)."""

    @property
    @abc.abstractmethod
    def name(self) -> str:
        """What is fitted, for messages."""

    @property
    @abc.abstractmethod
    def origin(self) -> str:
        """The origin of the rows, for messages."""

    @property
    @abc.abstractmethod
    def quantity(self) -> str:
        """The name of the fitted quantity."""

    @property
    @abc.abstractmethod
    def parameters(self) -> tuple[FreeParameter, ...]:
        """The parameters that are fitted."""

    @abc.abstractmethod
    def predict(self, values: Array) -> Array:
        """The fitted quantity at every row with these parameters [SI]; shape (N,). It need not be
        finite.
        """

    @abc.abstractmethod
    def jacobian(self, values: Array, which: Sequence[int] | None = None) -> Array:
        """Derivatives of `predict` with respect to the free parameters, or to these ones, shape (N,
        P).
        """

    @abc.abstractmethod
    def rows(self, selection: npt.NDArray[Any]) -> Self:
        """The problem of these rows, a mask or indices."""

    @abc.abstractmethod
    def weighted(self, factors: Array) -> Self:
        """The problem with the weights multiplied by these factors (N,)."""

    @abc.abstractmethod
    def with_known(self, index: int, value: float) -> Self:
        """The problem in which the parameter of this index is not free but has a value."""

    def describe_row(self, row: int) -> str:
        """Where a row was measured, for messages."""
        return f"row {row + 1}"

    def rank_error(self, deficiency: RankDeficiency) -> IdentificationError:
        """The error for parameters that the rows do not separate."""
        ranks = f"rank {deficiency.rank} of {deficiency.parameters}"
        return IdentificationError(
            f"{self.origin}: the data {deficiency.statement} of {self.name} ({ranks} parameters)."
            " Give further data, or fit fewer parameters.",
            hint=Hint("To fix one parameter", "fixed", (self.names[deficiency.greatest],)),
            cause=f"the data {deficiency.cause} ({ranks})",
        )

    @property
    def names(self) -> list[str]:
        """The paths of the free parameters."""
        return [parameter.name for parameter in self.parameters]

    @property
    def initial_values(self) -> Array:
        """The free parameters at the start; shape (P,)."""
        return np.array([parameter.initial for parameter in self.parameters], dtype=float)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the free parameters; shape (P,) each."""
        pairs = np.array([parameter.bounds for parameter in self.parameters], dtype=float)
        low, high = pairs.reshape(-1, 2).T
        return low, high

    @property
    def is_linear_parameter(self) -> npt.NDArray[np.bool_]:
        """Mask of the free parameters in which the fitted quantity is linear, shape (P,)."""
        return np.array([parameter.is_linear for parameter in self.parameters], dtype=bool)

    @property
    def is_linear(self) -> bool:
        """Whether the fitted quantity is linear in all free parameters, and none of them is
        bounded.
        """
        low, high = self.bounds
        is_unbounded = bool(np.isneginf(low).all() and np.isposinf(high).all())
        return is_unbounded and bool(self.is_linear_parameter.all())

    def bounds_reached(self, values: Array) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
        """Masks (P,) of the parameters on their lower and on their upper bound, within a margin,
        because a search may stop strictly inside."""
        low, high = self.bounds
        margin = BOUND_MARGIN * np.maximum(np.abs(values), np.abs(self.initial_values))
        return values - low <= margin, high - values <= margin

    def repeated(self, counts: Array) -> Self:
        """The problem in which each row counts this many times (N,)."""
        drawn = counts > 0
        return self.rows(drawn).weighted(np.sqrt(counts[drawn]))

    def residuals(self, modelled: Array) -> Array:
        """Weighted residuals; that of a censored row is 0 unless the model violates its bound;
        shape (N,).
        """
        difference = modelled - self.target
        return self.weights * np.where(self.censoring * difference < 0, 0.0, difference)

    def active_rows(self, modelled: Array) -> npt.NDArray[np.bool_]:
        """Mask of the uncensored rows and of the censored rows whose bound the model violates;
        shape (N,).
        """
        return np.asarray((self.censoring == 0) | (self.censoring * (modelled - self.target) > 0))

    def solution(self, values: Array) -> LeastSquaresSolution:
        """The solution with these free parameters (P,)."""
        return LeastSquaresSolution(values, self.predict(values), self.jacobian(values))

    def design_matrix(self) -> tuple[Array, Array]:
        """Design matrix (N, P) and constant part (N,) of a problem that is linear in its free
        parameters.
        """
        initial = self.initial_values
        matrix = self.jacobian(initial)
        return matrix, self.predict(initial) - matrix @ initial

    def central_differences(self, values: Array, which: Sequence[int]) -> Array:
        """The Jacobian (N, P) by these parameters from differences of `predict` within the
        bounds.
        """
        low, high = self.bounds
        initial = self.initial_values
        columns = []
        for i in which:
            step = _RELATIVE_STEP * max(abs(values[i]), abs(initial[i]), 1e-8)
            above = values.copy()
            below = values.copy()
            above[i] = min(values[i] + step, high[i])
            below[i] = max(values[i] - step, low[i])
            difference = self.predict(above) - self.predict(below)
            columns.append(difference / (above[i] - below[i]))
        return np.column_stack(columns)

"""LeastSquaresProblem: rows with measured values or bounds, and the named, bounded parameters of
what is fitted to them.
"""

import abc
import dataclasses
import functools
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import Array, Hint, IdentificationError
from .levenberg_marquardt import EXACT, SIMULATED, Accuracy
from .parameter_covariance import Runs

BOUND_MARGIN = 1e-6
"""Relative distance from a bound within which a parameter is on it (chosen)."""
MAX_NAMES = 3
"""Maximum number of parameters that the cause of a rank deficiency lists (chosen)."""
MIN_RATIO = 1e-9
"""Least ratio of a parameter with a prior to its prior value (chosen): a bound may be zero."""
Mask = npt.NDArray[np.bool_]
_RELATIVE_STEP = float(np.cbrt(np.finfo(float).eps))
"""Step of a central difference, relative to the parameter."""


class Prior(NamedTuple):
    """What is known of a parameter before: its value, and the standard deviation of a further
    residual (value - known value), or of ln(value/known value), in the unit of the residuals.
    """

    value: float
    deviation: float
    is_logarithmic: bool = False


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
    size: float = 1.0
    """Its typical size [SI], in which a search counts it."""
    origin: float = 0.0
    """The value [SI] from which a search counts it."""
    is_logarithmic: bool = False
    """Whether a search counts its logarithm instead."""
    prior: Prior | None = None


class PriorRows(NamedTuple):
    """Priors (K,) of the parameters of these indices."""

    indices: npt.NDArray[np.intp]
    values: Array
    deviations: Array
    logarithmic: Mask

    @classmethod
    def of(cls, parameters: Sequence[FreeParameter]) -> "PriorRows":
        """Those of the parameters that have one."""
        indices = [i for i, parameter in enumerate(parameters) if parameter.prior is not None]
        priors = [parameter.prior for parameter in parameters if parameter.prior is not None]
        return cls(
            np.array(indices, dtype=np.intp),
            np.array([prior.value for prior in priors], dtype=float),
            np.array([prior.deviation for prior in priors], dtype=float),
            np.array([prior.is_logarithmic for prior in priors], dtype=bool),
        )

    def residuals(self, values: Array) -> Array:
        """The residuals (K,) at parameters (P,)."""
        chosen = values[self.indices]
        linear = (chosen - self.values) / self.deviations
        ratios = chosen / np.where(self.logarithmic, self.values, 1.0)
        logarithms = np.log(np.maximum(ratios, MIN_RATIO)) / self.deviations
        return np.where(self.logarithmic, logarithms, linear)

    def jacobian(self, values: Array) -> Array:
        """Derivatives (K, P) of the residuals."""
        chosen = values[self.indices]
        ratios = chosen / np.where(self.logarithmic, self.values, 1.0)
        known = np.where(self.logarithmic, np.maximum(ratios, MIN_RATIO) * self.values, 1.0)
        matrix = np.zeros((self.indices.size, values.size))
        matrix[np.arange(self.indices.size), self.indices] = 1.0 / (known * self.deviations)
        return matrix


class Coordinates(NamedTuple):
    """The unknowns (P,) of a search over parameters: (value - origin)/size, or ln(value/size)."""

    origins: Array
    sizes: Array
    logarithmic: Mask
    has_logarithms: bool

    def of(self, values: Array) -> Array:
        """The unknowns of values [SI], shape (..., P)."""
        linear = (values - self.origins) / self.sizes
        if not self.has_logarithms:
            return np.asarray(linear)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self.logarithmic, np.log(values / self.sizes), linear)

    def values(self, x: Array) -> Array:
        """The values [SI] of unknowns, shape (..., P)."""
        linear = self.origins + x * self.sizes
        if not self.has_logarithms:
            return np.asarray(linear)
        ratios = np.exp(np.where(self.logarithmic, x, 0.0))
        return np.where(self.logarithmic, ratios * self.sizes, linear)

    def slopes(self, values: Array) -> Array:
        """The derivatives of the values [SI] by the unknowns, shape (..., P)."""
        if not self.has_logarithms:
            return self.sizes
        return np.where(self.logarithmic, values, self.sizes)


class Modelled(NamedTuple):
    """The fitted quantity (N,) with its Jacobian (N, P), if the evaluation gives both at once."""

    modelled: Array
    jacobian: Array | None


class Guard(abc.ABC):
    """The limit of the cost of evaluations in one search, by those before."""

    @property
    @abc.abstractmethod
    def memory(self) -> tuple[float, ...]:
        """What it has learnt, numbers that a checkpoint keeps."""

    @abc.abstractmethod
    def restore(self, memory: tuple[float, ...]) -> None:
        """Go on with what another one has learnt."""

    @abc.abstractmethod
    def learn(self, cost: float) -> None:
        """Learn from the last evaluation, whose sum of squares is `cost`."""


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
    """N rows and P free parameters. A kind of fit brings its parameters and the fitted quantity at
    every row; its Jacobian, if differences are not enough. Search, covariance, intervals and refits
    know no more of it.
    """

    accuracy: Accuracy = EXACT
    """The digits of its residuals, and where a search ends."""

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

    def jacobian(self, values: Array, which: Sequence[int] | None = None) -> Array:
        """Derivatives of `predict` with respect to the free parameters, or to these ones, shape (N,
        P). By default central differences."""
        return self.central_differences(values, range(len(values)) if which is None else which)

    def evaluate(self, values: Array, guard: Guard | None = None) -> Modelled:
        """The fitted quantity with these parameters [SI], as `predict`; with its Jacobian where one
        computation gives both. Within a search a `guard` may limit its cost. Raises AirmuscleError
        where the quantity cannot be computed."""
        return Modelled(self.predict(values), None)

    def guard(self) -> Guard | None:
        """A limit of the cost of the evaluations of one search; None where they cost the same."""
        return None

    @property
    def runs(self) -> Runs:
        """The groups of rows between which errors are independent; by default one."""
        one = np.zeros(self.target.size, dtype=np.intp)
        return Runs(one, one, in_time=True)

    def rows(self, selection: npt.NDArray[Any]) -> "LeastSquaresProblem":
        """The problem of these rows, a mask or indices."""
        return PartialProblem.of(self).rows(selection)

    def weighted(self, factors: Array) -> "LeastSquaresProblem":
        """The problem with the weights multiplied by these factors (N,)."""
        return PartialProblem.of(self).weighted(factors)

    def with_known(self, index: int, value: float) -> "LeastSquaresProblem":
        """The problem in which the parameter of this index is not free but has a value."""
        return PartialProblem.of(self).with_known(index, value)

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

    @functools.cached_property
    def coordinates(self) -> Coordinates:
        """The unknowns of a search."""
        return Coordinates(
            np.array([parameter.origin for parameter in self.parameters], dtype=float),
            np.array([parameter.size for parameter in self.parameters], dtype=float),
            np.array([parameter.is_logarithmic for parameter in self.parameters], dtype=bool),
            any(parameter.is_logarithmic for parameter in self.parameters),
        )

    @functools.cached_property
    def priors(self) -> PriorRows:
        """The parameters with a prior."""
        return PriorRows.of(self.parameters)

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

    def repeated(self, counts: Array) -> "LeastSquaresProblem":
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
        modelled, jacobian = self.evaluate(values)
        if jacobian is None:
            jacobian = self.jacobian(values)
        return LeastSquaresSolution(values, modelled, jacobian)

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
        sizes = [abs(parameter.initial) or parameter.size for parameter in self.parameters]
        columns = [np.zeros((self.target.size, 0))]
        for i in which:
            step = _RELATIVE_STEP * max(abs(values[i]), sizes[i])
            above = values.copy()
            below = values.copy()
            above[i] = min(values[i] + step, high[i])
            below[i] = max(values[i] - step, low[i])
            difference = self.predict(above) - self.predict(below)
            columns.append(difference / (above[i] - below[i]))
        return np.column_stack(columns)


@dataclasses.dataclass(frozen=True, eq=False)
class PartialProblem(LeastSquaresProblem):
    """Some rows of a problem, with other weights and some parameters known."""

    whole: LeastSquaresProblem
    selection: npt.NDArray[np.intp]
    """Indices of the rows, shape (N,)."""
    weights: Array
    known: tuple[tuple[int, float], ...] = ()
    """Indices of the known parameters of the whole problem, with their values."""

    @classmethod
    def of(cls, problem: LeastSquaresProblem) -> "PartialProblem":
        """All rows and parameters of a problem."""
        return cls(problem, np.arange(problem.target.size), problem.weights)

    @property
    def name(self) -> str:
        return self.whole.name

    @property
    def origin(self) -> str:
        return self.whole.origin

    @property
    def quantity(self) -> str:
        return self.whole.quantity

    @functools.cached_property
    def free(self) -> list[int]:
        """Indices of the free parameters in the whole problem."""
        known = {index for index, _ in self.known}
        return [i for i in range(len(self.whole.parameters)) if i not in known]

    @functools.cached_property
    def parameters(self) -> tuple[FreeParameter, ...]:
        every = self.whole.parameters
        return tuple(every[i] for i in self.free)

    @functools.cached_property
    def target(self) -> Array:  # type: ignore[override]
        return np.asarray(self.whole.target[self.selection])

    @functools.cached_property
    def censoring(self) -> Array:  # type: ignore[override]
        return np.asarray(self.whole.censoring[self.selection])

    @property
    def accuracy(self) -> Accuracy:  # type: ignore[override]
        return self.whole.accuracy

    @property
    def runs(self) -> Runs:
        return self.whole.runs.rows(self.selection)

    def guard(self) -> Guard | None:
        return self.whole.guard()

    def describe_row(self, row: int) -> str:
        return self.whole.describe_row(int(self.selection[row]))

    def every_value(self, values: Array) -> Array:
        """The parameters of the whole problem, with these of the free ones."""
        whole = np.empty(len(self.whole.parameters))
        whole[self.free] = values
        for index, value in self.known:
            whole[index] = value
        return whole

    def predict(self, values: Array) -> Array:
        return np.asarray(self.whole.predict(self.every_value(values))[self.selection])

    def jacobian(self, values: Array, which: Sequence[int] | None = None) -> Array:
        chosen = self.free if which is None else [self.free[i] for i in which]
        return np.asarray(self.whole.jacobian(self.every_value(values), chosen)[self.selection])

    def evaluate(self, values: Array, guard: Guard | None = None) -> Modelled:
        modelled, jacobian = self.whole.evaluate(self.every_value(values), guard)
        columns = None if jacobian is None else jacobian[self.selection][:, self.free]
        return Modelled(modelled[self.selection], columns)

    def rows(self, selection: npt.NDArray[Any]) -> "PartialProblem":
        return dataclasses.replace(
            self, selection=self.selection[selection], weights=self.weights[selection]
        )

    def weighted(self, factors: Array) -> "PartialProblem":
        return dataclasses.replace(self, weights=self.weights * factors)

    def with_known(self, index: int, value: float) -> "PartialProblem":
        return dataclasses.replace(self, known=(*self.known, (self.free[index], value)))


class MeasuredProblem(LeastSquaresProblem):
    """A problem whose rows are all measured values of the same weight."""

    @functools.cached_property
    def censoring(self) -> Array:  # type: ignore[override]
        return np.zeros(self.target.size)

    @functools.cached_property
    def weights(self) -> Array:  # type: ignore[override]
        return np.ones(self.target.size)


class SimulatedProblem(MeasuredProblem):
    """A problem whose fitted quantity comes from a simulation, with its Jacobian."""

    accuracy = SIMULATED

    @abc.abstractmethod
    def evaluate(self, values: Array, guard: Guard | None = None) -> Modelled:
        """The fitted quantity with its Jacobian."""

    def predict(self, values: Array) -> Array:
        return self.evaluate(values).modelled

    def jacobian(self, values: Array, which: Sequence[int] | None = None) -> Array:
        jacobian = self.evaluate(values).jacobian
        assert jacobian is not None
        return jacobian if which is None else jacobian[:, list(which)]

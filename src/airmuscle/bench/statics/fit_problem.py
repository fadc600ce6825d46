"""FitProblem: law, free parameters, data points and the quantity in which residuals are taken."""

import dataclasses
import functools
import math
import string
from collections.abc import Collection, Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import (
    Array,
    Hint,
    IdentificationError,
    ParameterError,
    alternatives,
    as_slice,
    autodiff,
    parts_of,
    tree,
)
from ...physics.muscle.characteristic import (
    Characteristic,
    ContractileSurface,
    ContractionLaw,
    ForceLaw,
    PooledLengthLaw,
    PressureLaw,
)
from ...physics.muscle.characteristic.modes import formula_alone
from ...recording import Recording
from ...recording.columns import QUANTITIES
from ..estimation import UNCENSORED, Censoring, FreeParameter, LeastSquaresProblem, RankDeficiency
from ..inspection import RELATIVE_BAND, level_intervals

RESTING_LENGTH = "resting_length"
"""Column with the resting length [m] of every row, in data of several specimens."""
SPECIMEN = "specimen"
"""Column with the index of the specimen of every row, in data of a PooledLengthLaw."""
DEGREE_REMEDY = "For the greatest degree that the levels determine"


@dataclasses.dataclass(frozen=True)
class FittedQuantity:
    """The quantity that a law gives as a function of the other two: the method that computes it and
    its arguments.
    """

    method: str
    arguments: tuple[str, str]
    name: str

    @property
    def unit(self) -> str:
        """SI unit of the quantity."""
        return QUANTITIES[self.name].unit


FORCE = FittedQuantity("unclamped_force", ("pressure", "contraction"), "force")
CONTRACTION = FittedQuantity("contraction", ("pressure", "force"), "contraction")
PRESSURE = FittedQuantity("pressure", ("contraction", "force"), "pressure")


def rows_by_length(law: Any, data: Recording) -> list[tuple[float | None, npt.NDArray[np.intp]]]:
    """Each resting length in the data with the indices of its rows; once None, without rows or an
    effect of length.
    """
    if (
        RESTING_LENGTH not in data.columns
        or not hasattr(law, "with_resting_length")
        or not len(data)
    ):
        return [(None, np.arange(len(data)))]
    lengths = data[RESTING_LENGTH]
    return [(float(length), np.flatnonzero(lengths == length)) for length in np.unique(lengths)]


def with_length(law: Any, length: Any) -> Any:
    """The law of a muscle with this resting length [m], if it is known and the law depends on
    it.
    """
    return (
        law.with_resting_length(float(length))
        if length is not None and hasattr(law, "with_resting_length")
        else law
    )


def of_length(law: Any, length: float | None) -> Any:
    """As `law.with_resting_length`, but without validation, because a search may pass through
    invalid parameters.
    """
    if length is None:
        return law
    return tree.unflatten(
        law, [length if leaf.path == RESTING_LENGTH else leaf.value for leaf in tree.leaves(law)]
    )


def evaluate(law: Any, method: str, arguments: tuple[str, str], data: Recording) -> Array:
    """The values of `law.method(*arguments)` at every row, with the law of its specimen or resting
    length; (N,). They are those of the formula, also beyond the range of a law.
    """
    laws: list[tuple[Any, slice | npt.NDArray[np.intp]]]
    if isinstance(law, PooledLengthLaw) and SPECIMEN in data.columns:
        member = data[SPECIMEN].astype(int)
        laws = [
            (law.for_specimen(law.specimens[i]), np.flatnonzero(member == i))
            for i in np.unique(member).tolist()
        ]
    else:
        laws = [
            (of_length(law, length), as_slice(rows)) for length, rows in rows_by_length(law, data)
        ]
    values = np.zeros(len(data))
    with formula_alone():
        for single, rows in laws:
            values[rows] = getattr(single, method)(*(data[name][rows] for name in arguments))
    return values


def fitted_quantity_of(law: Characteristic) -> FittedQuantity:
    """The quantity that a law gives, in which residuals are taken. Raises IdentificationError."""
    for kind, quantity in (
        (ForceLaw, FORCE),
        (ContractionLaw, CONTRACTION),
        (PressureLaw, PRESSURE),
    ):
        if isinstance(law, kind):
            return quantity
    raise IdentificationError(
        f"{type(law).__name__} cannot be fitted, because it gives neither force nor contraction nor"
        " pressure."
    )


@dataclasses.dataclass(frozen=True, eq=False)
class FitProblem(LeastSquaresProblem):
    """N data points and the P free parameters of a law."""

    law: Any
    fitted_quantity: FittedQuantity
    data: Recording
    target: Array
    """Measured value, or the bound of a censored row, in the fitted quantity [SI]; shape (N,)."""
    censoring: Array
    """0 uncensored, 1 the law may lie below the target, -1 the law may lie above it; shape (N,)."""
    weights: Array
    """Factors of the residuals, with a root mean square of 1; shape (N,)."""
    leaves: tuple[tree.Leaf, ...]
    free: tuple[int, ...]
    """Indices of the leaves that are fitted."""

    @property
    def arguments(self) -> tuple[Array, Array]:
        """The arguments of the law at every row [SI]; shape (N,) each."""
        first, second = self.fitted_quantity.arguments
        return self.data[first], self.data[second]

    @property
    def name(self) -> str:
        return type(self.law).__name__

    @property
    def origin(self) -> str:
        return self.data.origin

    @property
    def quantity(self) -> str:
        return self.fitted_quantity.name

    @property
    def free_leaves(self) -> list[tree.Leaf]:
        """The leaves that are fitted."""
        return [self.leaves[i] for i in self.free]

    @functools.cached_property
    def parameters(self) -> tuple[FreeParameter, ...]:
        linear = linear_fields(self.law)
        return tuple(
            FreeParameter(
                leaf.path,
                label,
                float(leaf.value),
                leaf.declared.bounds,
                leaf.declared.unit,
                leaf.declared.meaning,
                leaf.path.partition("[")[0] in linear,
            )
            for leaf, label in zip(self.free_leaves, self._labels(), strict=True)
        )

    def _labels(self) -> tuple[str, ...]:
        """A short label for each free parameter: its term in a polynomial, else its symbol, else
        its path.
        """
        texts = _term_labels(self.law, [leaf.path for leaf in self.leaves])
        symbols = [leaf.declared.symbol for leaf in self.free_leaves]
        paths = [leaf.path for leaf in self.free_leaves]
        names = (
            s if symbols.count(s) == 1 else path for s, path in zip(symbols, paths, strict=True)
        )
        return tuple(texts.get(path, name) for path, name in zip(paths, names, strict=True))

    def leaf_values(self, values: Sequence[float] | Array) -> list[float]:
        """All leaves of the law with these values of the free parameters."""
        leaf_values = [leaf.value for leaf in self.leaves]
        for i, value in zip(self.free, values, strict=True):
            leaf_values[i] = float(value)
        return leaf_values

    def rows(self, selection: npt.NDArray[Any]) -> "FitProblem":
        """The problem of these rows, a mask or indices."""
        chosen: dict[str, Any] = {
            name: getattr(self, name)[selection] for name in ("target", "censoring", "weights")
        }
        return dataclasses.replace(self, data=self.data.rows(selection), **chosen)

    def weighted(self, factors: Array) -> "FitProblem":
        return dataclasses.replace(self, weights=self.weights * factors)

    def with_known(self, index: int, value: float) -> "FitProblem":
        leaf = self.free[index]
        leaves = list(self.leaves)
        leaves[leaf] = dataclasses.replace(leaves[leaf], value=value)
        free = tuple(i for i in self.free if i != leaf)
        return dataclasses.replace(self, leaves=tuple(leaves), free=free)

    def describe_row(self, row: int) -> str:
        names = self.fitted_quantity.arguments
        values = (float(argument[row]) for argument in self.arguments)
        texts = [f"{name} {value:.4g}" for name, value in zip(names, values, strict=True)]
        return f"{' and '.join(texts)} (SI)"

    def rank_error(self, deficiency: RankDeficiency) -> IdentificationError:
        levels = [count_levels(values) for values in self.arguments]
        counts = [
            f"{count} of {name}"
            for count, name in zip(levels, self.fitted_quantity.arguments, strict=True)
        ]
        ranks = f"rank {deficiency.rank} of {deficiency.parameters}"
        text = ""
        hint = Hint("To fix one parameter", "fixed", (self.names[deficiency.greatest],))
        if isinstance(self.law, ContractileSurface):
            text = (
                "a(x^i q^j) is the coefficient of the powers i of the contraction and j of the"
                " pressure, each scaled to -1..1; powers up to n need n + 1 levels. "
            )
            degree = min(levels) - 1  # the greatest for the pure powers of each quantity
            if 0 < degree < self.law.degree:
                hint = Hint(
                    DEGREE_REMEDY, "degree", degree, "characteristic.ContractileSurface.blank"
                )
        return IdentificationError(
            f"{self.origin}: the data {deficiency.statement} of {self.name} ({ranks} parameters)."
            f" Number of levels: {', '.join(counts)}. {text}Measure at more levels, or choose a"
            " lower degree or a law with fewer parameters.",
            hint=hint,
            cause=f"the data {deficiency.cause} ({ranks})",
        )

    def design_matrix(self) -> tuple[Array, Array]:
        basis = getattr(self.law, "basis", None)
        if basis is not None and len(self.free) == len(self.law.term_labels):
            return np.array(basis(*self.arguments)).T, np.zeros(len(self.data))
        return super().design_matrix()

    def predict(self, values: Array) -> Array:
        """The fitted quantity at every row with these parameters [SI]; shape (N,). It is that of
        the formula: the range of a law follows from its fit.
        """
        method = self.fitted_quantity.method
        # Non-finite values raise an error at the start; later the search backtracks.
        with np.errstate(all="ignore"), formula_alone():
            return self._join([getattr(law, method)(*x) for law, x in self._laws(values)])

    def _laws(self, values: Array) -> Iterator[tuple[Any, tuple[Array, ...]]]:
        """The law of each resting length with these parameters, not validated, and the arguments of
        its rows.
        """
        leaf_values = self.leaf_values(values)
        which = [i for i, leaf in enumerate(self.leaves) if leaf.path == RESTING_LENGTH]
        for length, _, arguments in self._points:
            if length is not None:
                for i in which:
                    leaf_values[i] = length
            yield tree.unflatten(self.law, leaf_values), arguments

    @functools.cached_property
    def _points(self) -> list[tuple[float | None, slice | npt.NDArray[np.intp], tuple[Array, ...]]]:
        """Each resting length with its rows and their arguments."""
        groups = [(length, as_slice(rows)) for length, rows in rows_by_length(self.law, self.data)]
        return [(length, rows, tuple(x[rows] for x in self.arguments)) for length, rows in groups]

    def _join(self, parts: Sequence[Any]) -> Array:
        """Values by resting length in the order of the rows, shape (N, ...)."""
        first = np.asarray(parts[0])
        values = np.empty((len(self.data), *first.shape[1:]))
        for (_, rows, _), part in zip(self._points, parts, strict=True):
            values[rows] = part
        return values

    def jacobian(self, values: Array, which: Sequence[int] | None = None) -> Array:
        """Derivatives of `predict` with respect to the free parameters, or to these ones, shape (N,
        P). Exact if the law is traceable, otherwise by central differences."""
        which = range(len(self.free)) if which is None else which
        if all(autodiff.is_traceable(type(part)) for _, part in parts_of(self.law)):
            leaves = [self.free[i] for i in which]
            method = self.fitted_quantity.method
            return self._join(
                [
                    autodiff.parameter_derivatives(law, method, x, leaves)
                    for law, x in self._laws(values)
                ]
            )
        return self.central_differences(values, which)


def linear_fields(law: Any) -> tuple[str, ...]:
    """The paths of the fields in which a law declares itself linear."""
    declared = getattr(law, "linear_in", ())
    return (declared,) if isinstance(declared, str) else tuple(declared)


def count_levels(values: Array) -> int:
    """The number of levels: of groups of values that differ by at most the band of a constant
    quantity.
    """
    band = RELATIVE_BAND * float(np.max(np.abs(values), initial=0.0))
    return sum(1 for _ in level_intervals(np.sort(values), band))


def default_censoring(law: Characteristic) -> Censoring:
    """The range of force to which a force law is clamped, from zero if it has no clamp. Laws that
    give contraction or pressure are measured with suspended loads, of which zero is an ordinary
    value: no row is censored.
    """
    if not isinstance(law, ForceLaw):
        return UNCENSORED
    return Censoring(getattr(law, "min_force", 0.0), getattr(law, "max_force", math.inf))


def make_problem(
    law: Characteristic,
    data: Recording,
    censoring: Censoring,
    weights: Array,
    fixed: Collection[str],
) -> FitProblem:
    """The problem of fitting a law to data points; `fixed` names parameters that are not fitted.
    Raises IdentificationError where there are too few rows, ParameterError for an unknown name."""
    quantity = fitted_quantity_of(law)
    signs = censoring.signs(data["force"])
    target = data[quantity.name]
    if quantity == FORCE:
        target = np.where(
            signs > 0, censoring.min_force, np.where(signs < 0, censoring.max_force, target)
        )
    elif quantity == PRESSURE:
        # a smaller force at the same pressure means that the stated force needs a higher pressure
        signs = -signs
    leaves = tuple(tree.leaves(law))
    fields = list(dict.fromkeys(leaf.path.partition("[")[0] for leaf in leaves))
    for name in fixed:
        if name not in fields and name not in (leaf.path for leaf in leaves):
            raise ParameterError(
                f"{type(law).__name__} has no parameter '{name}' to be fixed"
                f"{alternatives(name, fields, 'its parameters are')}"
            )
    kept = {
        leaf.path
        for leaf in leaves
        if fixed and {leaf.path, leaf.path.partition("[")[0]} & set(fixed)
    }
    free = tuple(
        i for i, leaf in enumerate(leaves) if leaf.declared.fitted and leaf.path not in kept
    )
    _check_row_count(law, data, len(free), int(np.count_nonzero(signs == 0)))
    return FitProblem(law, quantity, data, target, signs, weights, leaves, free)


def _check_row_count(law: Characteristic, data: Recording, free: int, measured: int) -> None:
    name = f"{data.origin}: {type(law).__name__}"
    if free == 0:
        raise IdentificationError(f"{name} has no free parameter. Fix fewer parameters.")
    censored = len(data) - measured
    if len(data) and not measured:
        raise IdentificationError(
            f"{name}: all {censored} rows are censored (at zero force, or at the limit of the force"
            " range), so there is no measured value. Give rows with a positive force.",
            hint=Hint(
                "To treat them as measured values", "censoring", UNCENSORED, constant="UNCENSORED"
            ),
        )
    if measured < free:
        also = f" ({censored} further rows are censored and give bounds only)" if censored else ""
        raise IdentificationError(
            f"{name} has {free} free parameters, but only {measured} rows are measured"
            f" values{also}. Measure more points, or choose a law with fewer parameters or a lower"
            " degree.",
            hint=Hint("To fix parameters", "fixed"),
            cause=f"{free} parameters, but {measured} measured values",
        )


def _term_labels(law: Any, paths: Sequence[str]) -> dict[str, str]:
    """Labels of the coefficients of all polynomials in a law by their paths: a(term) of the first
    one, b(term) of the second, and so on.
    """
    labels = dict[str, str]()
    letters = iter(string.ascii_lowercase)
    for owner in dict.fromkeys(path.rpartition(".")[0] for path in paths):
        part = functools.reduce(getattr, owner.split("."), law) if _is_plain(owner) else None
        part = part if owner else law
        terms = getattr(part, "term_labels", ())
        for field in getattr(part, "linear_in", ()) if terms else ():
            letter = next(letters)
            prefix = f"{owner}.{field}" if owner else field
            labels |= {f"{prefix}[{i}]": f"{letter}({term})" for i, term in enumerate(terms)}
    return labels


def _is_plain(path: str) -> bool:
    """Whether a path consists of fields alone, without the index of a sequence."""
    return bool(path) and "[" not in path


def population_of(law: Any) -> Any:
    """The population law of a pooled law; any other law unchanged."""
    return law.population if isinstance(law, PooledLengthLaw) else law

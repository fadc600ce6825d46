"""What a fit is to do: the law, its free parameters, and the points in the direction that the law gives."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ..characteristic.base import Characteristic, ContractionLaw, ForceLaw, PressureLaw
from ..core import autodiff, tree
from ..core.arrays import Array
from ..core.errors import IdentificationError, ParameterError, suggestion
from ..core.tree import Leaf
from ..recording import Recording
from ..recording.columns import QUANTITIES
from .censoring import Censoring

RESTING_LENGTH = "resting_length"
"""Column of the length of muscle by row, in data of several specimens."""


@dataclasses.dataclass(frozen=True)
class FittedQuantity:
    """Which of the three a law gives: the method that a fit compares, its arguments and its answer."""

    method: str
    arguments: tuple[str, str]
    name: str

    @property
    def unit(self) -> str:
        return QUANTITIES[self.name].unit


FORCE = FittedQuantity("unclamped", ("pressure", "contraction"), "force")
CONTRACTION = FittedQuantity("contraction", ("pressure", "force"), "contraction")
PRESSURE = FittedQuantity("pressure", ("contraction", "force"), "pressure")


def split_by_length(law: Any, data: Recording) -> list[tuple[Any, npt.NDArray[np.intp]]]:
    """The law of each length of muscle in the data, and its rows: one law for all where it knows of no lengths."""
    if RESTING_LENGTH not in data.columns or not hasattr(law, "of_length"):
        return [(law, np.arange(len(data)))]
    lengths = data[RESTING_LENGTH]
    return [(_with_length(law, float(length)), np.flatnonzero(lengths == length)) for length in np.unique(lengths)]


def _with_length(law: Any, length: float) -> Any:
    """As `law.of_length`, but unchecked: a search may pass where the law has no meaning."""
    leaves = tree.leaves(law)
    return tree.unflatten(law, [length if leaf.path == RESTING_LENGTH else leaf.value for leaf in leaves])


def evaluate(law: Any, method: str, arguments: tuple[str, str], data: Recording) -> Array:
    """What a law, or that of each length, gives at every row; shape (N,)."""
    found = np.zeros(len(data))
    for specimen, rows in split_by_length(law, data):
        found[rows] = getattr(specimen, method)(*(data[name][rows] for name in arguments))
    return found


def fitted_quantity_of(law: Characteristic) -> FittedQuantity:
    """The direction in which a law is given, where its errors are compared."""
    for kind, direction in ((ForceLaw, FORCE), (ContractionLaw, CONTRACTION), (PressureLaw, PRESSURE)):
        if isinstance(law, kind):
            return direction
    raise IdentificationError(f"{type(law).__name__} is no law in force, contraction or pressure; it cannot be fitted.")


@dataclasses.dataclass(frozen=True, eq=False)
class FitProblem:
    """N points and the P parameters to be found from them."""

    law: Any
    fitted_quantity: FittedQuantity
    data: Recording
    target: Array
    """Measured values, or the bound of a row that was cut off, in the law's direction; shape (N,)."""
    censoring: Array
    """0 where the law shall meet the goal, 1 where it may lie below, -1 where it may lie above; shape (N,)."""
    weights: Array
    """By which the errors are multiplied, 1 in the mean; shape (N,)."""
    leaves: tuple[Leaf, ...]
    free: tuple[int, ...]
    """Which of the leaves are to be found."""

    @property
    def arguments(self) -> tuple[Array, Array]:
        first, second = self.fitted_quantity.arguments
        return self.data[first], self.data[second]

    @property
    def initial_values(self) -> Array:
        return np.array([self.leaves[i].value for i in self.free], dtype=float)

    @property
    def bounds(self) -> tuple[Array, Array]:
        pairs = np.array([self.leaves[i].declared.bounds for i in self.free], dtype=float)
        return pairs[:, 0], pairs[:, 1]

    @property
    def labels(self) -> tuple[str, ...]:
        """A short name for each free parameter: its term in a sum, else its symbol."""
        terms = getattr(self.law, "terms", ())
        field = getattr(self.law, "linear_in", None)
        texts = {f"{field}[{i}]": f"a({term})" for i, term in enumerate(terms)}
        symbols = [self.leaves[i].declared.symbol for i in self.free]
        paths = [self.leaves[i].path for i in self.free]
        names = (s if symbols.count(s) == 1 else path for s, path in zip(symbols, paths, strict=True))
        return tuple(texts.get(path, name) for path, name in zip(paths, names, strict=True))

    def leaf_values(self, values: Sequence[float] | Array) -> list[float]:
        """All leaves of the law, with these values of the free ones."""
        found = [leaf.value for leaf in self.leaves]
        for i, value in zip(self.free, values, strict=True):
            found[i] = float(value)
        return found

    def predict(self, values: Array) -> Array:
        """What the law gives with these parameters; shape (N,)."""
        law = tree.unflatten(self.law, self.leaf_values(values))
        with np.errstate(all="ignore"):  # what is not finite is refused, or the search steps back from it
            return evaluate(law, self.fitted_quantity.method, self.fitted_quantity.arguments, self.data)

    def residuals(self, modelled: Array) -> Array:
        """Weighted errors; a row that was cut off has one only where the law contradicts it."""
        difference = modelled - self.target
        return self.weights * np.where(self.censoring * difference < 0, 0.0, difference)

    def active_rows(self, modelled: Array) -> npt.NDArray[np.bool_]:
        """The rows that have a say: those measured, and those cut off that the law contradicts."""
        return np.asarray((self.censoring == 0) | (self.censoring * (modelled - self.target) > 0))

    def jacobian(self, values: Array) -> Array:
        """The derivatives of `modelled` by the free parameters, shape (N, P): exact where the law can be traced."""
        if _is_traceable(self.law):
            law = tree.unflatten(self.law, self.leaf_values(values))
            found = np.empty((len(self.data), len(self.leaves)))
            for specimen, rows in split_by_length(law, self.data):
                arguments = (values[rows] for values in self.arguments)
                found[rows] = autodiff.jacobian(specimen, self.fitted_quantity.method, *arguments)[1]
            return found[:, list(self.free)]
        return self._finite_differences(values)

    def _finite_differences(self, values: Array) -> Array:
        low, high = self.bounds
        columns = []
        for i, value in enumerate(values):
            step = np.cbrt(np.finfo(float).eps) * max(abs(value), abs(self.initial_values[i]), 1e-8)
            up, down = values.copy(), values.copy()
            up[i], down[i] = min(value + step, high[i]), max(value - step, low[i])
            columns.append((self.predict(up) - self.predict(down)) / (up[i] - down[i]))
        return np.column_stack(columns)


def _is_traceable(thing: Any) -> bool:
    """Whether a law and all models inside it are closed-form."""
    if isinstance(thing, tuple):
        return all(_is_traceable(item) for item in thing)
    kind: type[Any] = type(thing)
    if not dataclasses.is_dataclass(kind):
        return True
    inside = (getattr(thing, field.name) for field in dataclasses.fields(thing))
    return autodiff.is_traceable(kind) and all(_is_traceable(item) for item in inside)


def make_problem(
    law: Characteristic, data: Recording, censoring: Censoring, weights: Array, fixed: Collection[str]
) -> FitProblem:
    """The problem of fitting a law to points. Raises IdentificationError where it cannot be posed."""
    direction = fitted_quantity_of(law)
    sides = censoring.signs(data["force"])
    goal = data[direction.name]
    if direction is FORCE:
        goal = np.where(sides > 0, censoring.min_force, np.where(sides < 0, censoring.max_force, goal))
    elif direction is PRESSURE:
        sides = -sides  # where the force is less than stated, the pressure that would hold it is more
    leaves = tuple(tree.leaves(law))
    _check_known(law, leaves, fixed)
    free = tuple(i for i, leaf in enumerate(leaves) if leaf.declared.fitted and not _is_fixed(leaf, fixed))
    measured = int(np.count_nonzero(sides == 0))
    _check_row_count(law, data, len(free), measured)
    return FitProblem(law, direction, data, goal, sides, weights, leaves, free)


def _is_fixed(leaf: Leaf, fixed: Collection[str]) -> bool:
    return leaf.path in fixed or leaf.path.partition("[")[0] in fixed


def _check_known(law: Characteristic, leaves: Sequence[Leaf], fixed: Collection[str]) -> None:
    known = list(dict.fromkeys(name for leaf in leaves for name in (leaf.path.partition("[")[0], leaf.path)))
    for name in fixed:
        if name not in known:
            fields = list(dict.fromkeys(leaf.path.partition("[")[0] for leaf in leaves))
            raise ParameterError(
                f"{type(law).__name__} has no parameter '{name}' to hold fixed; there are {', '.join(fields)}."
                f"{suggestion(name, known)}"
            )


def _check_row_count(law: Characteristic, data: Recording, free: int, measured: int) -> None:
    name = f"{data.origin}: {type(law).__name__}"
    if free == 0:
        raise IdentificationError(f"{name} has no parameter left to be fitted. Hold fewer fixed.")
    cut_off = len(data) - measured
    if len(data) and not measured:
        raise IdentificationError(
            f"{name}: all {cut_off} rows are cut off at the ends of the range of force, so none was measured. Fit rows "
            "in which the muscle pulls, or give the range with censoring=."
        )
    if measured < free:
        also = f" ({cut_off} more are cut off at zero or full force and count as bounds only)" if cut_off else ""
        raise IdentificationError(
            f"{name} has {free} parameters to be found, but only {measured} points were measured{also}. Measure more, "
            "choose a law with fewer parameters or a lower degree, or hold some with fixed=."
        )

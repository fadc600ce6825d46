"""Automatic differentiation of models: recorded expressions, exact derivatives and Jacobians.

`derivative` differentiates a method with respect to one argument. It accepts numbers, arrays,
symbols (inside a trace) and JAX arrays. `jacobian` returns the derivatives with respect to all
parameters, as a fit requires.
"""

import functools
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from . import nodes, ops, slopes, tree
from .arrays import Array
from .errors import TraceError
from .evaluation import Recorded
from .nodes import Node


class RecordedMethod:
    """A method of models of one structure: its value and slopes as expressions, and as functions of
    numbers and arrays, each made when it is asked for."""

    def __init__(self, obj: Any, method: str, count: int) -> None:
        with nodes.recording():
            model, self.parameters = symbolic(obj)
            self.arguments = nodes.symbols("x", count)
            recorded = getattr(model, method)
            value = recorded(*self.arguments)
            self.value = nodes.as_node(value)
        check_finite([self.value], f"{type(obj).__name__}.{method}")
        self._functions: dict[Any, Recorded] = {}

    @functools.cached_property
    def by_argument(self) -> list[Node]:
        """The slope by each argument."""
        return [slopes.jacobian([self.value], [x])[0][0] for x in self.arguments]

    @functools.cached_property
    def by_parameter(self) -> list[Node]:
        """The slope by each parameter."""
        return slopes.gradient(self.value, self.parameters)

    def function(self, key: Any, outputs: Callable[[], Sequence[Sequence[Node]]]) -> Recorded:
        """The function of arguments and parameters that has these outputs, kept under a key."""
        if key not in self._functions:
            inputs = [self.arguments, self.parameters]
            self._functions[key] = Recorded(inputs, outputs())
        return self._functions[key]

    def value_and_slope(self, wrt: int) -> Recorded:
        """The value, and its slope by one argument."""
        return self.function(("value", wrt), lambda: [[self.value, self.by_argument[wrt]]])

    def value_and_slopes(self) -> Recorded:
        """The value and its slopes by the arguments, then its slopes by the parameters."""
        return self.function("slopes", lambda: [[self.value, *self.by_argument], self.by_parameter])

    def parameter_slopes(self, leaves: tuple[int, ...]) -> Recorded:
        """The slopes by the parameters of these numbers."""
        return self.function(leaves, lambda: [[self.by_parameter[i] for i in leaves]])


_recorded_methods: dict[Any, RecordedMethod] = {}


def symbolic(obj: Any) -> tuple[Any, list[Node]]:
    """Return the model with a symbol in place of every leaf, and the list of these symbols."""
    vector = nodes.symbols("p", sum(1 for _ in tree.leaves(obj)))
    return tree.unflatten(obj, vector), vector


def check_finite(expressions: Sequence[Node], owner: str) -> None:
    """Raise TraceError if recorded expressions contain NaN or infinity.

    math.sqrt or float() applied to a symbol produce such constants without an error.
    """
    if not all(map(math.isfinite, nodes.constants_of(expressions))):
        raise TraceError(
            f"{owner}: the traced expression contains a constant that is not finite. Use"
            " airmuscle.core.ops instead of math and numpy, and do not call float() on an"
            " argument."
        )


def _recorded(obj: Any, method: str, count: int) -> RecordedMethod:
    """The recorded method of models of this structure, with so many arguments."""
    key = (tree.structure(obj), method, count)
    if key not in _recorded_methods:
        _recorded_methods[key] = RecordedMethod(obj, method, count)
    return _recorded_methods[key]


def _at_points(
    function: Recorded, obj: Any, arguments: Sequence[Any]
) -> tuple[list[list[Array]], tuple[int, ...]]:
    """The results of a recorded method at numbers or arrays that broadcast, each an array of all
    points (N,), and the shape of the points. Parameters of the model may be arrays, too.
    """
    leaves = [leaf.value for leaf in tree.leaves(obj)]
    arrays = {
        i: leaf for i, leaf in enumerate(leaves) if isinstance(leaf, np.ndarray) and leaf.ndim
    }
    numeric = [np.asarray(x, dtype=float) for x in (*arguments, *arrays.values())]
    shape = numeric[0].shape
    if any(x.shape != shape for x in numeric):  # to broadcast takes as long as 20 operations
        numeric = list(np.broadcast_arrays(*numeric))
        shape = numeric[0].shape
    points = [np.ascontiguousarray(x).reshape(-1) for x in numeric]
    size = points[0].size
    at = points[: len(arguments)]
    columns = dict(zip(arrays, points[len(arguments) :], strict=True))
    if size == 1:  # numbers take a tenth of the time of arrays
        numbers = [column.item() for column in at]
        single = [
            columns[i].item() if i in columns else float(leaf) for i, leaf in enumerate(leaves)
        ]
        results: list[list[Any]] = function.at_numbers(numbers, single)
    else:
        parameters = [columns[i] if i in columns else float(leaf) for i, leaf in enumerate(leaves)]
        results = function.at_points(at, parameters)
    return [_columns(vector, size) for vector in results], shape


def _columns(values: Sequence[Any], size: int) -> list[Array]:
    return [_column(value, size) for value in values]


def _column(value: Any, size: int) -> Array:
    """The values at all points, also of a result that depends on no array."""
    if isinstance(value, np.ndarray) and value.ndim:
        return value
    return np.full(size, value, dtype=float)


def derivative(obj: Any, method: str, *arguments: Any, wrt: int = 0) -> Any:
    """Exact derivative of `obj.method(*arguments)` with respect to argument number `wrt`, shaped
    like the arguments.

    It is NaN where an argument is NaN. Raises TraceError if the method cannot be traced.
    """

    def partial(x: Any) -> Any:
        return getattr(obj, method)(*(x if i == wrt else a for i, a in enumerate(arguments)))

    if ops.is_symbol(*arguments):
        x = nodes.symbol("x")
        slope = slopes.jacobian([nodes.as_node(partial(x))], [x])[0]
        return nodes.replaced(slope, [x], [arguments[wrt]])[0]
    if _is_jax(*arguments):
        import jax  # type: ignore[import-not-found, unused-ignore]

        point = jax.numpy.asarray(arguments[wrt], dtype=float)
        return jax.jvp(partial, (point,), (jax.numpy.ones_like(point),))[1]
    recorded = _recorded(obj, method, len(arguments))
    results, shape = _at_points(recorded.value_and_slopes(), obj, arguments)
    value = results[0][1 + wrt].reshape(shape)
    missing = functools.reduce(
        np.logical_or, (np.isnan(np.asarray(x, dtype=float)) for x in arguments)
    )
    if missing.any():  # a traced comparison with NaN takes one of its branches
        value = np.where(missing, np.nan, value)
    return float(value) if value.ndim == 0 else value


def jvp(
    function: Callable[[Any], Sequence[Any]], point: Sequence[Any], direction: Sequence[Any]
) -> tuple[Any, ...]:
    """Jacobian-vector product J(point) direction of a vector function written over `ops`.

    `point` and `direction` hold numbers, symbols or JAX arrays; `function` takes the point
    as one sequence.
    """
    if _is_jax(*point, *direction):
        import jax  # type: ignore[import-not-found, unused-ignore]

        primals, tangents = (
            [jax.numpy.asarray(x, dtype=float) for x in values] for values in (point, direction)
        )
        return tuple(jax.jvp(lambda x: tuple(function(x)), (primals,), (tangents,))[1])
    return _symbolic_product(function, point, direction, False)


def vjp(
    function: Callable[[Any], Sequence[Any]], point: Sequence[Any], weights: Sequence[Any]
) -> tuple[Any, ...]:
    """Vector-Jacobian product J(point)^T weights of a vector function written over `ops`; arguments
    as for `jvp`.
    """
    if _is_jax(*point, *weights):
        import jax  # type: ignore[import-not-found, unused-ignore]

        primals = [jax.numpy.asarray(x, dtype=float) for x in point]
        gradient = jax.grad(lambda x: sum(w * y for w, y in zip(weights, function(x), strict=True)))
        return tuple(gradient(primals))
    return _symbolic_product(function, point, weights, True)


def value_and_derivative(
    obj: Any, method: str, count: int, wrt: int = 0
) -> Callable[..., tuple[Any, Any]]:
    """Return a function that evaluates `obj.method` and its exact derivative with respect to
    argument `wrt`.

    `count` is the number of arguments of the method. The returned function takes numbers or arrays
    that broadcast and returns (value, derivative) of their shape. The parameters of `obj` may be
    arrays as well. Raises TraceError if the method cannot be traced.
    """
    function = _recorded(obj, method, count).value_and_slope(wrt)
    parameters = [leaf.value for leaf in tree.leaves(obj)]
    several = any(isinstance(value, np.ndarray) for value in parameters)

    def evaluate(*arguments: Any) -> tuple[Any, Any]:
        if several or any(isinstance(x, np.ndarray) for x in arguments):
            [(values, slopes_at)], shape = _at_points(function, obj, arguments)
            return values.reshape(shape), slopes_at.reshape(shape)
        [(value, slope)] = function.at_numbers(arguments, parameters)
        return value, slope

    return evaluate


def _is_jax(*operands: Any) -> bool:
    return any(type(x).__module__.startswith("jax") for x in operands)


def _symbolic_product(
    function: Callable[[Any], Sequence[Any]],
    point: Sequence[Any],
    vector: Sequence[Any],
    transposed: bool,
) -> tuple[Any, ...]:
    """The Jacobian at a point, or its transpose, times a vector: floats unless one of the values is
    a symbol.
    """
    x = nodes.symbols("x", len(point))
    values = nodes.as_nodes(function(x))
    weights = nodes.as_nodes(vector)
    differentiated = slopes.weighted_gradient if transposed else slopes.tangents
    products = nodes.replaced(differentiated(values, x, weights), x, point)
    if ops.is_symbol(*point, *vector):
        return tuple(products)
    return tuple(map(float, products))


def jacobian(
    obj: Any, method: str, *arguments: Any
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Values of `obj.method` at N points, shape (N,), and derivatives with respect to its P leaves,
    shape (N, P).
    """
    recorded = _recorded(obj, method, len(arguments))
    (values, by_parameter), shape = _at_points(recorded.value_and_slopes(), obj, arguments)
    table = np.empty((math.prod(shape), len(by_parameter)))
    for k, column in enumerate(by_parameter):
        table[:, k] = column
    return values[0], table


def parameter_derivatives(
    obj: Any, method: str, arguments: Sequence[Any], leaves: Sequence[int]
) -> Any:
    """Derivatives of `obj.method` with respect to the leaves of these numbers at N points, shape
    (N, leaves).
    """
    points = [np.asarray(x, dtype=float).reshape(-1) for x in arguments]
    function = _recorded(obj, method, len(points)).parameter_slopes(tuple(leaves))
    (columns,), shape = _at_points(function, obj, points)
    table = np.empty((math.prod(shape), len(columns)), order="F")
    for k, column in enumerate(columns):
        table[:, k] = column
    return table


def is_traceable(cls: type[Any]) -> bool:
    """Return whether a class of models can be traced; a class that cannot declares `traceable =
    False`.
    """
    return bool(getattr(cls, "traceable", True))

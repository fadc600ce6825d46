"""Automatic differentiation of models: symbolic tracing with CasADi, exact derivatives and
Jacobians.

`derivative` differentiates a method with respect to one argument. It accepts numbers, arrays,
CasADi symbols (inside a trace) and JAX arrays. `jacobian` returns the derivatives with respect to
all parameters, as a fit requires.
"""

import functools
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from . import ops, tree
from .arrays import MIN_POINTS, make_program
from .errors import TraceError

_traced_functions: dict[Any, Any] = {}


def symbolic(obj: Any) -> tuple[Any, Any]:
    """Return the model with a CasADi symbol in place of every leaf, and the vector of these
    symbols.
    """
    import casadi

    count = sum(1 for _ in tree.leaves(obj))
    vector = casadi.SX.sym("p", count)
    return tree.unflatten(obj, [vector[i] for i in range(count)]), vector


def check_finite(expression: Any, owner: str) -> None:
    """Raise TraceError if a traced expression contains NaN or infinity.

    math.sqrt, NumPy functions or float() applied to a symbol produce such constants without an
    error.
    """
    import casadi

    function = casadi.Function("probe", casadi.symvar(expression), [expression])
    for i in range(function.n_instructions()):
        if function.instruction_id(i) == casadi.OP_CONST and not math.isfinite(
            function.instruction_constant(i)
        ):
            raise TraceError(
                f"{owner}: the traced expression contains a constant that is not finite. Use"
                " airmuscle.core.ops instead of math and numpy, and do not call float() on an"
                " argument."
            )


def _traced(obj: Any, method: str, count: int, wrt: int | None = None) -> Any:
    """The cached CasADi function (arguments, parameters) -> value, d/d argument i for each, d/d
    parameters; with `wrt` only the derivative by this argument."""
    import casadi

    key = (tree.structure(obj), method, count, wrt)
    if key not in _traced_functions:
        model, parameters = symbolic(obj)
        arguments = [casadi.SX.sym(f"x{i}") for i in range(count)]
        value = casadi.densify(casadi.SX(getattr(model, method)(*arguments)))
        check_finite(value, f"{type(obj).__name__}.{method}")
        varied = [*arguments, parameters] if wrt is None else [arguments[wrt]]
        slopes = [casadi.densify(casadi.jacobian(value, x)) for x in varied]
        _traced_functions[key] = casadi.Function(
            "law", [*arguments, parameters], casadi.cse([value, *slopes])
        )
    return _traced_functions[key]


def _evaluate_traced(
    obj: Any, method: str, arguments: tuple[Any, ...]
) -> tuple[list[Any], tuple[int, ...]]:
    """The outputs of the traced function at the arguments, and their shape."""
    function = _traced(obj, method, len(arguments))
    return _call_traced(function, [leaf.value for leaf in tree.leaves(obj)], arguments)


def _call_traced(
    function: Any, parameters: Sequence[Any], arguments: Sequence[Any]
) -> tuple[list[Any], tuple[int, ...]]:
    """The outputs of a traced function at numbers or arrays, without structural zeros, point by
    point, and the shape of the points. Parameters may be arrays, too. With buffers a call takes
    half the time that it takes with matrices.
    """
    many = any(isinstance(value, np.ndarray) and value.size > 1 for value in parameters)
    broadcast = np.broadcast_arrays(
        *(np.asarray(x, dtype=float) for x in (*arguments, *(parameters if many else ())))
    )
    shape = broadcast[0].shape
    size = broadcast[0].size
    count = len(arguments)
    if not size:  # a map of no points is none
        return [np.zeros((function.numel_out(i), 0)) for i in range(function.n_out())], shape
    numbers = [
        value.item() if isinstance(value, np.ndarray) else value for value in parameters if not many
    ]
    vectors = [x.ravel() for x in broadcast]
    vectors[count:] = [
        (
            np.stack(vectors[count:], axis=-1).ravel()
            if many
            else np.tile(np.array(numbers, float), size)
        )
    ]
    mapped = function.map(size)
    results = [np.empty(mapped.nnz_out(i)) for i in range(mapped.n_out())]
    buffer, call = mapped.buffer()
    for place, vector in enumerate(vectors):
        buffer.set_arg(place, vector.data)
    for place, result in enumerate(results):
        buffer.set_res(place, result.data)
    call()
    return results, shape


def derivative(obj: Any, method: str, *arguments: Any, wrt: int = 0) -> Any:
    """Exact derivative of `obj.method(*arguments)` with respect to argument number `wrt`, shaped
    like the arguments.

    It is NaN where an argument is NaN. Raises TraceError if the method cannot be traced.
    """

    def partial(x: Any) -> Any:
        return getattr(obj, method)(*(x if i == wrt else a for i, a in enumerate(arguments)))

    if ops.is_symbol(*arguments):
        import casadi

        symbol = casadi.SX.sym("x")
        return casadi.substitute(
            casadi.jacobian(casadi.SX(partial(symbol)), symbol), symbol, arguments[wrt]
        )
    if _is_jax(*arguments):
        import jax  # type: ignore[import-not-found, unused-ignore]

        point = jax.numpy.asarray(arguments[wrt], dtype=float)
        return jax.jvp(partial, (point,), (jax.numpy.ones_like(point),))[1]
    results, shape = _evaluate_traced(obj, method, arguments)
    value = results[1 + wrt].reshape(shape)
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

    `point` and `direction` hold numbers, CasADi symbols or JAX arrays; `function` takes the point
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
    import casadi

    function, parameters = (
        _traced(obj, method, count, wrt),
        [leaf.value for leaf in tree.leaves(obj)],
    )
    if any(isinstance(value, np.ndarray) for value in parameters):
        return lambda *arguments: _evaluate_pair(function, parameters, arguments)
    vector = casadi.DM(np.array(parameters, dtype=float))

    def evaluate(*arguments: Any) -> tuple[Any, Any]:
        if any(isinstance(x, np.ndarray) for x in arguments):
            return _evaluate_pair(function, parameters, arguments)
        value, derivative = function(*arguments, vector)
        return float(value), float(derivative)

    return evaluate


def _evaluate_pair(
    function: Any, parameters: Sequence[Any], arguments: Sequence[Any]
) -> tuple[Any, Any]:
    (value, derivative), shape = _call_traced(function, parameters, arguments)
    return value.reshape(shape), derivative.reshape(shape)


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
    import casadi

    x = casadi.SX.sym("x", len(point))
    values = casadi.vertcat(*(casadi.SX(v) for v in function([x[i] for i in range(len(point))])))
    product = casadi.jtimes(values, x, casadi.vertcat(*vector), transposed)
    result = casadi.substitute(product, x, casadi.vertcat(*point))
    components = tuple(result[i] for i in range(result.numel()))
    return components if ops.is_symbol(*point, *vector) else tuple(map(float, components))


def jacobian(
    obj: Any, method: str, *arguments: Any
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Values of `obj.method` at N points, shape (N,), and derivatives with respect to its P leaves,
    shape (N, P).
    """
    results, shape = _evaluate_traced(obj, method, arguments)
    return results[0].reshape(-1), results[-1].reshape(
        math.prod(shape), sum(1 for _ in tree.leaves(obj))
    )


def parameter_derivatives(
    obj: Any, method: str, arguments: Sequence[Any], leaves: Sequence[int]
) -> Any:
    """Derivatives of `obj.method` with respect to the leaves of these numbers at N points, shape
    (N, leaves).
    """
    points = np.broadcast_arrays(*(np.asarray(x, dtype=float).reshape(-1) for x in arguments))
    if points[0].size >= MIN_POINTS:
        key = (tree.structure(obj), method, len(points), tuple(leaves), "program")
        if key not in _traced_functions:
            function = _traced(obj, method, len(points))
            _traced_functions[key] = make_program(function, function.n_out() - 1, list(leaves))
        program = _traced_functions[key]
        if program is not None:
            return program.columns(points, tree.flatten(obj).tolist(), len(leaves))
    return jacobian(obj, method, *points)[1][:, list(leaves)]


def is_traceable(cls: type[Any]) -> bool:
    """Return whether a class of models can be traced; a class that cannot declares `traceable =
    False`.
    """
    return bool(getattr(cls, "traceable", True))

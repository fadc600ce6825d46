"""A law becomes symbols, and symbols give exact derivatives.

`slope` differentiates a law by one of its arguments wherever it is called: on numbers and arrays, inside a
trace, or on JAX arrays. `jacobian` adds the derivatives by every parameter, which is what a fit needs.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from . import ops, tree
from .errors import TraceError

_traced_functions: dict[Any, Any] = {}


def symbolic(thing: Any) -> tuple[Any, Any]:
    """The model with a CasADi symbol in place of every leaf, and the vector of these symbols."""
    import casadi

    count = sum(1 for _ in tree.leaves(thing))
    vector = casadi.SX.sym("p", count)
    return tree.unflatten(thing, [vector[i] for i in range(count)]), vector


def check_finite(expression: Any, owner: str) -> None:
    """Raise TraceError where a trace holds NaN or infinity: math.sqrt or float() of a symbol makes them silently."""
    import casadi

    function = casadi.Function("probe", casadi.symvar(expression), [expression])
    for i in range(function.n_instructions()):
        if function.instruction_id(i) == casadi.OP_CONST and not math.isfinite(function.instruction_constant(i)):
            raise TraceError(
                f"{owner} traced to a constant that is not finite. Use airmuscle.core.ops instead of math and numpy, "
                "and no float() of an argument."
            )


def _trace_with_derivatives(thing: Any, method: str, count: int) -> Any:
    """The CasADi function (arguments, parameters) -> (value, by each argument, by parameters), traced once."""
    import casadi

    key = (tree.structure(thing), method, count)
    if key not in _traced_functions:
        model, parameters = symbolic(thing)
        arguments = [casadi.SX.sym(f"x{i}") for i in range(count)]
        value = casadi.SX(getattr(model, method)(*arguments))
        check_finite(value, f"{type(thing).__name__}.{method}")
        outputs = [value, *(casadi.jacobian(value, x) for x in arguments), casadi.jacobian(value, parameters)]
        _traced_functions[key] = casadi.Function("law", [*arguments, parameters], casadi.cse(outputs))
    return _traced_functions[key]


def _evaluate_traced(thing: Any, method: str, arguments: tuple[Any, ...]) -> tuple[list[Any], tuple[int, ...], int]:
    function = _trace_with_derivatives(thing, method, len(arguments))
    results, shape = _call_traced(function, [leaf.value for leaf in tree.leaves(thing)], arguments)
    return results, shape, math.prod(shape)


def _call_traced(function: Any, parameters: Sequence[Any], arguments: Sequence[Any]) -> tuple[list[Any], tuple[int, ...]]:
    """What a traced function gives at numbers or arrays, and their shape; parameters may be arrays too, as of many."""
    many = any(isinstance(value, np.ndarray) and value.size > 1 for value in parameters)
    broadcast = np.broadcast_arrays(*(np.asarray(x, dtype=float) for x in (*arguments, *(parameters if many else ()))))
    rows = [x.reshape(1, -1) for x in broadcast]
    count = len(arguments)
    numbers = [value.item() if isinstance(value, np.ndarray) else value for value in parameters if not many]
    vector = np.vstack(rows[count:]) if many else np.array(numbers, dtype=float)
    return [r.full() for r in function(*rows[:count], vector)], broadcast[0].shape


def derivative(thing: Any, method: str, *arguments: Any, wrt: int = 0) -> Any:
    """The exact derivative of `thing.method(*arguments)` by argument number `wrt`, shaped like the arguments."""
    if ops.is_symbol(*arguments):
        return _symbolic_derivative(thing, method, arguments, wrt)
    if _is_jax(*arguments):
        return _jax_derivative(thing, method, arguments, wrt)
    results, shape, _ = _evaluate_traced(thing, method, arguments)
    found = results[1 + wrt].reshape(shape)
    return float(found) if found.ndim == 0 else found


def _symbolic_derivative(thing: Any, method: str, arguments: tuple[Any, ...], wrt: int) -> Any:
    import casadi

    symbol = casadi.SX.sym("x")
    inner = [symbol if i == wrt else x for i, x in enumerate(arguments)]
    derivative = casadi.jacobian(casadi.SX(getattr(thing, method)(*inner)), symbol)
    return casadi.substitute(derivative, symbol, arguments[wrt])


def _jax_derivative(thing: Any, method: str, arguments: tuple[Any, ...], wrt: int) -> Any:
    import jax  # type: ignore[import-not-found, unused-ignore]

    def along(x: Any) -> Any:
        return getattr(thing, method)(*(x if i == wrt else a for i, a in enumerate(arguments)))

    at = jax.numpy.asarray(arguments[wrt], dtype=float)
    return jax.jvp(along, (at,), (jax.numpy.ones_like(at),))[1]


def jvp(function: Callable[[Any], Sequence[Any]], at: Sequence[Any], along: Sequence[Any]) -> tuple[Any, ...]:
    """The exact derivative of a vector function over `ops` at a point, along a direction: J(at) along.

    `at` and `along` hold numbers, CasADi symbols or JAX arrays; `function` takes the point as one sequence.
    """
    if _is_jax(*at, *along):
        import jax  # type: ignore[import-not-found, unused-ignore]

        point, direction = ([jax.numpy.asarray(x, dtype=float) for x in given] for given in (at, along))
        return tuple(jax.jvp(lambda x: tuple(function(x)), (point,), (direction,))[1])
    import casadi

    x, values = _symbolic_values(function, len(at))
    return _substitute(casadi.jtimes(values, x, casadi.vertcat(*along)), x, at, ops.is_symbol(*at, *along))


def vjp(function: Callable[[Any], Sequence[Any]], at: Sequence[Any], weights: Sequence[Any]) -> tuple[Any, ...]:
    """The exact gradient of the weighted sum of a vector function over `ops`: J(at)^T weights, as `directional`."""
    if _is_jax(*at, *weights):
        import jax  # type: ignore[import-not-found, unused-ignore]

        point = [jax.numpy.asarray(x, dtype=float) for x in at]
        gradient = jax.grad(lambda x: sum(w * y for w, y in zip(weights, function(x), strict=True)))
        return tuple(gradient(point))
    import casadi

    x, values = _symbolic_values(function, len(at))
    return _substitute(casadi.jtimes(values, x, casadi.vertcat(*weights), True), x, at, ops.is_symbol(*at, *weights))


def value_and_derivative(thing: Any, method: str, count: int, wrt: int = 0) -> Callable[..., tuple[Any, Any]]:
    """`thing.method` of `count` arguments together with its exact derivative by number `wrt`, for a search.

    The function takes numbers, or arrays that broadcast, and gives numbers or arrays of their shape. The parameters of
    `thing` may be arrays too.
    """
    import casadi

    key = (tree.structure(thing), method, count, wrt)
    if key not in _traced_functions:
        model, symbols = symbolic(thing)
        x = [casadi.SX.sym(f"x{i}") for i in range(count)]
        value = casadi.SX(getattr(model, method)(*x))
        check_finite(value, f"{type(thing).__name__}.{method}")
        _traced_functions[key] = casadi.Function("law", [*x, symbols], casadi.cse([value, casadi.jacobian(value, x[wrt])]))
    function, parameters = _traced_functions[key], [leaf.value for leaf in tree.leaves(thing)]
    if any(isinstance(value, np.ndarray) for value in parameters):
        return lambda *arguments: _evaluate_pair(function, parameters, arguments)
    vector = casadi.DM(np.array(parameters, dtype=float))

    def both(*arguments: Any) -> tuple[Any, Any]:
        if any(isinstance(x, np.ndarray) for x in arguments):
            return _evaluate_pair(function, parameters, arguments)
        value, derivative = function(*arguments, vector)
        return float(value), float(derivative)

    return both


def _evaluate_pair(function: Any, parameters: Sequence[Any], arguments: Sequence[Any]) -> tuple[Any, Any]:
    (value, derivative), shape = _call_traced(function, parameters, arguments)
    return value.reshape(shape), derivative.reshape(shape)


def _is_jax(*operands: Any) -> bool:
    return any(type(x).__module__.startswith("jax") for x in operands)


def _symbolic_values(function: Callable[[Any], Sequence[Any]], count: int) -> tuple[Any, Any]:
    import casadi

    x = casadi.SX.sym("x", count)
    return x, casadi.vertcat(*(casadi.SX(v) for v in function([x[i] for i in range(count)])))


def _substitute(derivative: Any, x: Any, at: Sequence[Any], symbolic: bool) -> tuple[Any, ...]:
    import casadi

    found = casadi.substitute(derivative, x, casadi.vertcat(*at))
    parts = tuple(found[i] for i in range(found.numel()))
    return parts if symbolic else tuple(float(part) for part in parts)


def jacobian(thing: Any, method: str, *arguments: Any) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Values (N,) of `thing.method` at N points, and their derivatives (N, P) by the P leaves of `thing`."""
    results, _, count = _evaluate_traced(thing, method, arguments)
    size = results[-1].size // max(count, 1)
    return results[0].reshape(-1), results[-1].reshape(count, size)


@functools.cache
def is_traceable(cls: type[Any]) -> bool:
    """Whether a class of laws can be traced; a law that cannot says so in `traceable = False`."""
    return bool(getattr(cls, "traceable", True))

"""Mathematical functions over floats, NumPy arrays, symbols, JAX arrays and CasADi expressions.

Each function selects the library by the type of its operands: floats and NumPy arrays are evaluated
at once, symbols are recorded (`nodes`), JAX arrays are passed to jax.numpy and expressions of
CasADi to casadi. Models are written with these functions and + - * / **. The functions have the
names of NumPy; `absolute_value`, `both` and `either` are those of `abs`, `logical_and` and
`logical_or`. `dir(ops)` lists them.
"""

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from . import nodes
from .errors import ParameterError, suggestion

Value = Any
"""A float, a NumPy array, a symbol, a JAX array or an expression of CasADi."""
Values = Mapping[str, Value]
"""Values by name, such as states, inputs, coordinates or forces."""

pi = math.pi
_PLAIN = frozenset({float, int, bool})
"""Types of plain numbers, which need no library; a controller calls these functions dozens of times
for each sample.
"""


_SMALLEST = sys.float_info.min
_LARGEST = sys.float_info.max
_DOMAINS = {
    **dict.fromkeys(
        ("sin", "cos", "tan", "arctan", "arcsinh", "tanh", "floor", "ceil", "sign"),
        (-_LARGEST, _LARGEST),
    ),
    **dict.fromkeys(("exp", "expm1", "sinh", "cosh"), (-700.0, 700.0)),
    **dict.fromkeys(("arcsin", "arccos"), (-1.0, 1.0)),
    "sqrt": (0.0, _LARGEST),
    **dict.fromkeys(("log", "log2", "log10"), (_SMALLEST, _LARGEST)),
    "arccosh": (1.0, _LARGEST),
    "arctanh": (math.nextafter(-1.0, 0.0), math.nextafter(1.0, 0.0)),
    "log1p": (math.nextafter(-1.0, 0.0), _LARGEST),
}
"""Numbers for which a function is certain to have a finite value."""


def _library(*operands: Value) -> ModuleType | None:
    """Return the module that handles these operands; None for plain numbers."""
    library = None
    for operand in operands:
        if type(operand) in _PLAIN or isinstance(operand, float | int):
            continue
        if type(operand) is nodes.Node:
            return nodes
        root = type(operand).__module__.partition(".")[0]
        if root == "casadi":
            return sys.modules["casadi"]
        if root in ("jax", "jaxlib"):
            _check_double(operand)
            return sys.modules["jax.numpy"]
        library = np
    return library


def _check_double(array: Any) -> None:
    """Raise ParameterError for a JAX array in single or half precision."""
    dtype = np.dtype(array.dtype)
    if dtype.kind not in "biuf" or (dtype.kind == "f" and dtype.itemsize < 8):
        raise ParameterError(
            f"an equation received a JAX array of the type {dtype}; it must be float64, because"
            " pressures, lengths and rates are differences of nearly equal numbers. Write"
            ' jax.config.update("jax_enable_x64", True) before the first array is made, and omit'
            " dtype=float32."
        )


def is_symbol(*operands: Value) -> bool:
    """Return whether any operand is a symbol, that is, whether the model is being traced."""
    return any(type(x) is nodes.Node for x in operands)


def is_traced(*operands: Value) -> bool:
    """Return whether any operand has no numbers to look at: symbols, expressions of CasADi, JAX
    arrays.
    """
    return any(
        type(x) is nodes.Node or type(x).__module__.partition(".")[0] in ("casadi", "jax", "jaxlib")
        for x in operands
    )


def where(condition: Value, when_true: Value, when_false: Value) -> Value:
    """`when_true` where the condition is true, else `when_false`; arrays evaluate both."""
    if type(condition) in _PLAIN and type(when_true) in _PLAIN and type(when_false) in _PLAIN:
        return when_true if condition else when_false
    library = _library(condition, when_true, when_false)
    if library is None:
        return when_true if condition else when_false
    select = library.where if hasattr(library, "where") else library.if_else
    return select(condition, when_true, when_false)


def maximum(a: Value, b: Value) -> Value:
    """The larger of two values, or NaN; traced as a comparison whose derivative at equality is that
    of `a`.
    """
    if type(a) in _PLAIN and type(b) in _PLAIN:
        return b if b > a or b != b else a
    library = _library(a, b)
    if library is np:
        return np.maximum(a, b)
    return where(_or_nan(a >= b, a, library), a, b)


def minimum(a: Value, b: Value) -> Value:
    """The smaller of two values, or NaN; traced as a comparison whose derivative at equality is
    that of `b`.
    """
    if type(a) in _PLAIN and type(b) in _PLAIN:
        return b if a >= b or b != b else a
    library = _library(a, b)
    if library is np:
        return np.minimum(a, b)
    return where(_or_nan(a >= b, b, library), b, a)


def _or_nan(condition: Value, value: Value, library: ModuleType | None) -> Value:
    """A condition, which in JAX also holds where the value is NaN.

    Programs that are traced check their inputs before they evaluate equations; JAX cannot.
    """
    if library is None or library.__name__ != "jax.numpy":
        return condition
    return condition | (value != value)


def clip(x: Value, low: Value, high: Value) -> Value:
    """`x` limited to the interval from `low` to `high`."""
    return minimum(maximum(x, low), high)


def absolute_value(x: Value) -> Value:
    """Absolute value |x|."""
    return where(x >= 0, x, -x)


def both(a: Value, b: Value) -> Value:
    """Logical conjunction of two conditions."""
    library = _library(a, b)
    if library is None:
        return bool(a and b)
    return library.logical_and(a, b) if hasattr(library, "logical_and") else library.logic_and(a, b)


def either(a: Value, b: Value) -> Value:
    """Logical disjunction of two conditions."""
    library = _library(a, b)
    if library is None:
        return bool(a or b)
    return library.logical_or(a, b) if hasattr(library, "logical_or") else library.logic_or(a, b)


def negation(condition: Value) -> Value:
    """Logical negation of a condition."""
    library = _library(condition)
    if library is None:
        return not condition
    negate = library.logical_not if hasattr(library, "logical_not") else library.logic_not
    return negate(condition)


abs = absolute_value
logical_and = both
logical_or = either
logical_not = negation


def square(x: Value) -> Value:
    """x^2."""
    return x * x


def power(x: Value, exponent: Value) -> Value:
    """x raised to an exponent; NaN for a negative number and a fraction."""
    if _library(x, exponent) not in (None, np):
        return x**exponent
    with np.errstate(all="ignore"):
        value = np.power(np.asarray(x, dtype=float), exponent)
    return value if np.ndim(value) else float(value)


def arctan2(y: Value, x: Value) -> Value:
    """The angle of the point (x, y), from -pi to pi; 0 at the origin, whose sign of zero counts for
    numbers alone.
    """
    library = _library(y, x)
    if library is None:
        return math.atan2(y, x)
    if library is not nodes:
        return library.arctan2(y, x)
    is_flat = absolute_value(x) >= absolute_value(y)
    larger = where(is_flat, x, y)
    ratio = where(is_flat, y, x) / where(larger == 0.0, 1.0, larger)
    angle = arctan(ratio)
    behind = where(x < 0.0, where(y >= 0.0, pi, -pi), 0.0)
    return where(is_flat, angle + behind, where(y >= 0.0, 0.5 * pi, -0.5 * pi) - angle)


def hypot(x: Value, y: Value) -> Value:
    """Square root of x^2 + y^2; v/hypot(v, v_0) is a smooth sign of a speed v whose transition is
    v_0 wide.
    """
    return sqrt(x * x + y * y)


def polynomial(coefficients: Sequence[Value], x: Value) -> Value:
    """Sum of coefficients[i] x^i, by Horner's method."""
    total: Value = 0.0
    for coefficient in reversed(coefficients):
        total = total * x + coefficient
    return total


def _elementary(name: str, meaning: str) -> Callable[[Value], Value]:
    """A function of the library of its operand; of a number outside its domain NaN or infinity,
    without a warning.
    """
    low, high = _DOMAINS[name]
    of_number = getattr(np, name)

    def function(x: Value) -> Value:
        library = _library(x)
        if library is not None:
            return getattr(library, name)(x)
        if low <= x <= high:
            return float(of_number(x))
        with np.errstate(all="ignore"):  # takes several times as long as the function
            return float(of_number(x))

    function.__name__ = function.__qualname__ = name
    function.__doc__ = meaning
    return function


def sqrt(x: Value) -> Value:
    """Square root; NaN below zero."""
    if type(x) is float and x >= 0.0:
        return math.sqrt(x)
    return _general_sqrt(x)


_general_sqrt = _elementary("sqrt", "Square root of any operand.")
floor = _elementary("floor", "Greatest integer that is not above `x`; its derivative is 0.")
ceil = _elementary("ceil", "Least integer that is not below `x`; its derivative is 0.")
sign = _elementary("sign", "-1, 0 or 1; its derivative is 0.")
exp = _elementary("exp", "Exponential function.")
log = _elementary("log", "Natural logarithm; NaN below zero.")
log2 = _elementary("log2", "Logarithm to the base 2; NaN below zero.")
log10 = _elementary("log10", "Decimal logarithm; NaN below zero.")
expm1 = _elementary("expm1", "exp(x) - 1, accurate for small `x`.")
log1p = _elementary("log1p", "Natural logarithm of 1 + x, accurate for small `x`; NaN below -1.")
sin = _elementary("sin", "Sine of an angle in radians.")
cos = _elementary("cos", "Cosine of an angle in radians.")
tan = _elementary("tan", "Tangent of an angle in radians.")
sinh = _elementary("sinh", "Hyperbolic sine.")
cosh = _elementary("cosh", "Hyperbolic cosine.")
tanh = _elementary("tanh", "Hyperbolic tangent.")
arcsin = _elementary("arcsin", "Inverse sine, in radians; NaN outside of -1 to 1.")
arccos = _elementary("arccos", "Inverse cosine, in radians; NaN outside of -1 to 1.")
arctan = _elementary("arctan", "Inverse tangent, in radians.")
arcsinh = _elementary("arcsinh", "Inverse hyperbolic sine.")
arccosh = _elementary("arccosh", "Inverse hyperbolic cosine; NaN below 1.")
arctanh = _elementary("arctanh", "Inverse hyperbolic tangent; NaN outside of -1 to 1.")

__all__ = [
    "abs",
    "absolute_value",
    "arccos",
    "arccosh",
    "arcsin",
    "arcsinh",
    "arctan",
    "arctan2",
    "arctanh",
    "both",
    "ceil",
    "clip",
    "cos",
    "cosh",
    "either",
    "exp",
    "expm1",
    "floor",
    "hypot",
    "log",
    "log1p",
    "log2",
    "log10",
    "logical_and",
    "logical_not",
    "logical_or",
    "maximum",
    "minimum",
    "pi",
    "polynomial",
    "power",
    "sign",
    "sin",
    "sinh",
    "sqrt",
    "square",
    "tan",
    "tanh",
    "where",
]
_NAMES_ELSEWHERE = {
    **{name: f"arc{name[1:]}" for name in ("asin", "acos", "atan", "asinh", "acosh", "atanh")},
    "atan2": "arctan2",
    "ln": "log",
    "pow": "power",
    **dict.fromkeys(("absolute", "fabs"), "abs"),
    **dict.fromkeys(("max", "fmax", "amax"), "maximum"),
    **dict.fromkeys(("min", "fmin", "amin"), "minimum"),
    **dict.fromkeys(("if_else", "select", "piecewise"), "where"),
    "polyval": "polynomial",
}
"""Names that other libraries give to these functions."""


def __dir__() -> list[str]:
    return list(__all__)


if not TYPE_CHECKING:  # a type checker itself names an attribute that is missing

    def __getattr__(name: str) -> Any:
        known = _NAMES_ELSEWHERE.get(name)
        hint = f" Did you mean '{known}'?" if known else suggestion(name, __all__)
        raise AttributeError(
            f"module '{__name__}' has no operation '{name}'; dir(ops) lists them.{hint}"
        )

"""The few mathematical functions that laws are written in.

Each looks at its operands and answers with the library they belong to: floats and NumPy arrays are
computed at once, CasADi symbols are traced, JAX arrays go to jax.numpy. Laws use these and + - * / **.
"""

from __future__ import annotations

import math
import sys
from types import ModuleType
from typing import Any

import numpy as np

Value = Any
"""A float, a NumPy array, a CasADi symbol or a JAX array."""

pi = math.pi


def _library(*operands: Value) -> ModuleType | None:
    """The module that computes with these operands; None for plain numbers."""
    found = None
    for operand in operands:
        if isinstance(operand, float | int):
            continue
        root = type(operand).__module__.partition(".")[0]
        if root == "casadi":
            return sys.modules["casadi"]
        if root in ("jax", "jaxlib"):
            return sys.modules["jax.numpy"]
        found = np
    return found


def is_symbol(*operands: Value) -> bool:
    """Whether any operand is a CasADi symbol, so that the law is being traced."""
    return any(type(x).__module__.startswith("casadi") for x in operands)


def where(condition: Value, when_true: Value, when_false: Value) -> Value:
    """`when_true` where the condition holds, else `when_false`; both sides are computed on arrays."""
    library = _library(condition, when_true, when_false)
    if library is None:
        return when_true if condition else when_false
    choose = library.where if hasattr(library, "where") else library.if_else
    return choose(condition, when_true, when_false)


def maximum(a: Value, b: Value) -> Value:
    """The larger; traced as a comparison, whose derivative at equality is that of `a`."""
    return np.maximum(a, b) if _library(a, b) is np else where(a >= b, a, b)


def minimum(a: Value, b: Value) -> Value:
    """The smaller; traced as a comparison, whose derivative at equality is that of `b`, the one not the larger."""
    return np.minimum(a, b) if _library(a, b) is np else where(a >= b, b, a)


def clip(x: Value, low: Value, high: Value) -> Value:
    """`x` held between `low` and `high`."""
    return minimum(maximum(x, low), high)


def absolute_value(x: Value) -> Value:
    """|x|."""
    return where(x >= 0, x, -x)


def both(a: Value, b: Value) -> Value:
    """Logical and of two conditions."""
    library = _library(a, b)
    if library is None:
        return bool(a and b)
    return library.logical_and(a, b) if hasattr(library, "logical_and") else library.logic_and(a, b)


def _unary(name: str, x: Value) -> Value:
    library = _library(x)
    return getattr(np if library is None else library, name)(x)


def _on_float(result: Value, x: Value) -> Value:
    return float(result) if isinstance(x, float | int) else result


def sqrt(x: Value) -> Value:
    """Square root; NaN below zero."""
    return _on_float(_unary("sqrt", x), x)


def exp(x: Value) -> Value:
    """e**x."""
    return _on_float(_unary("exp", x), x)


def log(x: Value) -> Value:
    """Natural logarithm; NaN below zero."""
    return _on_float(_unary("log", x), x)


def sin(x: Value) -> Value:
    """Sine of an angle in radians."""
    return _on_float(_unary("sin", x), x)


def cos(x: Value) -> Value:
    """Cosine of an angle in radians."""
    return _on_float(_unary("cos", x), x)


def tan(x: Value) -> Value:
    """Tangent of an angle in radians."""
    return _on_float(_unary("tan", x), x)


def sinh(x: Value) -> Value:
    """Hyperbolic sine."""
    return _on_float(_unary("sinh", x), x)


def cosh(x: Value) -> Value:
    """Hyperbolic cosine."""
    return _on_float(_unary("cosh", x), x)


def arctan(x: Value) -> Value:
    """Inverse tangent, in radians."""
    return _on_float(_unary("arctan", x), x)


def arcsinh(x: Value) -> Value:
    """Inverse hyperbolic sine."""
    return _on_float(_unary("arcsinh", x), x)

"""Traced law as an expression of its arguments and parameters, within its validity range without unreached limits."""

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ...core import autodiff, instructions_of
from .expression import FUNCTIONS, MAXIMUM, MINIMUM, POWER, Expressions, Node, fold, in_order, is_number

Bounds = tuple[float, float]
UNKNOWN: Bounds = (-math.inf, math.inf)
ROUNDING = 1e-9
"""Difference of two bounds, relative to them, that is a rounding error (chosen)."""
_INCREASING: dict[str, Callable[[float], float]] = {
    "exp": math.exp, "sinh": math.sinh, "atan": math.atan, "tanh": math.tanh, "asinh": math.asinh,
}  # fmt: skip


def traced_expression(
    law: Any, method: str, new: Expressions, arguments: Sequence[Node], parameters: Sequence[Node]
) -> Node | None:
    """A method of a law at these arguments, with these nodes in place of its parameters, in the order of the leaves.

    None if the law cannot be traced, or contains an operation without a notation.
    """
    import casadi

    if not law.traceable:
        return None
    model, vector = autodiff.symbolic(law)
    symbols = [casadi.SX.sym(f"x{i}") for i in range(len(arguments))]
    value = casadi.SX(getattr(model, method)(*symbols))
    autodiff.check_finite(value, f"{type(law).__name__}.{method}")
    function = casadi.Function("law", [*symbols, vector], casadi.cse([value]))
    kinds, current, result = _kinds(), dict[int, Node](), new.number(0.0)
    for k, (code, target, source) in enumerate(instructions_of(function)):
        if code == casadi.OP_OUTPUT:
            result = current[source[0]]
        elif code == casadi.OP_CONST:
            current[target[0]] = new.number(function.instruction_constant(k))
        elif code == casadi.OP_INPUT:
            current[target[0]] = arguments[source[0]] if source[0] < len(arguments) else parameters[source[1]]
        elif code in kinds:
            current[target[0]] = _apply(new, kinds[code], [current[i] for i in source])
        else:
            return None
    return result


def _apply(new: Expressions, kind: str, values: list[Node]) -> Node:
    match kind:
        case "assign":
            return values[0]
        case "sub":
            return new.add(values[0], new.negative(values[1]))
        case "sq":
            return new.product(values[0], values[0])
        case "twice":
            return new.product(new.number(2.0), values[0])
        case "inv":
            return new.quotient(new.number(1.0), values[0])
    return new.apply(kind, *values)


@functools.cache
def _kinds() -> dict[int, str]:
    """Kinds of nodes by CasADi's number of the operation."""
    import casadi

    named = {
        "ASSIGN": "assign", "ADD": "add", "SUB": "sub", "MUL": "mul", "DIV": "div", "NEG": "neg", "SQ": "sq",
        "TWICE": "twice", "INV": "inv", "FABS": "abs", "POW": "pow", "CONSTPOW": "pow", "FMIN": "min", "FMAX": "max",
        "LT": "lt", "LE": "le", "EQ": "eq", "NE": "ne", "NOT": "not", "AND": "and", "OR": "or", "IF_ELSE_ZERO": "if",
        **{name.upper(): name for name in FUNCTIONS if name != "abs"},
    }  # fmt: skip
    return {getattr(casadi, f"OP_{name}"): kind for name, kind in named.items()}


def within(root: Node, new: Expressions, ranges: Mapping[Node, Bounds]) -> Node:
    """The expression for symbols within these ranges; a parameter has the range of its value."""
    bounds: dict[Node, Bounds] = {}

    def rebuild(old: Node, arguments: list[Node]) -> Node:
        node = new.apply(old.kind, *arguments) if arguments else old
        for each in in_order(node):
            if each not in bounds:
                bounds[each] = _bounds_of(each, bounds, ranges)
        return _reduced(node, new, bounds)

    return fold(root, rebuild)


def _reduced(node: Node, new: Expressions, bounds: Mapping[Node, Bounds]) -> Node:
    """A maximum or minimum with only one possible value, and a branch with a certain condition, as that value."""
    if node.kind in (MAXIMUM, MINIMUM):
        a, b = node.arguments
        if _at_most(bounds[a], bounds[b]):
            return b if node.kind == MAXIMUM else a
        if _at_most(bounds[b], bounds[a]):
            return a if node.kind == MAXIMUM else b
    if node.kind in ("lt", "le", "eq", "ne"):
        truth = _truth(node.kind, *(bounds[each] for each in node.arguments))
        return node if truth is None else new.number(float(truth))
    return node


def _truth(kind: str, a: Bounds, b: Bounds) -> bool | None:
    """Whether a comparison holds for all values of the two ranges; None if it depends on the values."""
    below, above = a[1] < b[0], a[0] > b[1]
    if kind in ("eq", "ne"):
        return kind == "ne" if below or above else None
    if below or (kind == "le" and a[1] <= b[0]):
        return True
    return False if above or (kind == "lt" and a[0] >= b[1]) else None


def _at_most(low: Bounds, high: Bounds) -> bool:
    """Whether no value of the first range exceeds one of the second by more than rounding."""
    if not (math.isfinite(low[1]) and math.isfinite(high[0])):
        return False
    return low[1] <= high[0] + ROUNDING * max(abs(low[1]), abs(high[0]))


def _bounds_of(node: Node, bounds: Mapping[Node, Bounds], ranges: Mapping[Node, Bounds]) -> Bounds:
    if is_number(node):
        return node.number, node.number
    if not node.arguments:
        return ranges.get(node, UNKNOWN)
    try:
        low, high = _operate(node, [bounds[each] for each in node.arguments])
    except (OverflowError, ValueError, ZeroDivisionError):
        return UNKNOWN
    return UNKNOWN if math.isnan(low) or math.isnan(high) else (low, high)


def _operate(node: Node, sides: list[Bounds]) -> Bounds:
    """The range of an operation from those of its arguments, which are taken as independent."""
    (low, high), last = sides[0], sides[-1]
    match node.kind:
        case "add":
            return low + last[0], high + last[1]
        case "neg":
            return -high, -low
        case "mul":
            return _corners(sides[0], last, lambda a, b: a * b)
        case "div" if last[0] > 0 or last[1] < 0:
            return _corners(sides[0], last, lambda a, b: a / b)
        case "max":
            return max(low, last[0]), max(high, last[1])
        case "min":
            return min(low, last[0]), min(high, last[1])
        case "where":
            return min(sides[1][0], last[0]), max(sides[1][1], last[1])
        case "sqrt" | "log" if low > 0:
            return (math.sqrt(low), math.sqrt(high)) if node.kind == "sqrt" else (math.log(low), math.log(high))
        case "sin" | "cos":
            return (-1.0, 1.0) if low < high else (getattr(math, node.kind)(low),) * 2
        case "tan" if -0.5 * math.pi < low and high < 0.5 * math.pi:
            return math.tan(low), math.tan(high)
        case "abs":
            return (0.0 if low <= 0 <= high else min(abs(low), abs(high))), max(abs(low), abs(high))
    if node.kind in _INCREASING:
        return _INCREASING[node.kind](low), _INCREASING[node.kind](high)
    return _power(node, low, high) if node.kind == POWER else UNKNOWN


def _power(node: Node, low: float, high: float) -> Bounds:
    exponent = node.arguments[1]
    if not is_number(exponent) or exponent.number <= 0:
        return UNKNOWN
    if low >= 0:
        return low**exponent.number, high**exponent.number
    if exponent.number % 2 == 0:
        return (0.0 if high > 0 else high**exponent.number), max(-low, high) ** exponent.number
    return (low**exponent.number, high**exponent.number) if exponent.number % 2 == 1 else UNKNOWN


def _corners(a: Bounds, b: Bounds, operation: Callable[[float, float], float]) -> Bounds:
    values = [operation(one, other) for one in a for other in b]
    return (math.nan, math.nan) if any(math.isnan(v) for v in values) else (min(values), max(values))

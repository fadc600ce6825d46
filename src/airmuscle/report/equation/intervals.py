"""Traced law as an expression of its arguments and parameters, within its validity range without
unreached limits.
"""

import itertools
import math
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ...core import Operation, autodiff, nodes
from . import expression
from .expression import (
    COMPARISONS,
    MAXIMUM,
    MINIMUM,
    POWER,
    Expressions,
    Term,
    fold,
    in_order,
    is_number,
)

Bounds = tuple[float, float]
UNKNOWN: Bounds = (-math.inf, math.inf)
ROUNDING = 1e-9
"""Difference of two bounds, relative to them, that is a rounding error (chosen)."""
_KINDS = {
    Operation.ADD: "add",
    Operation.SUBTRACT: "sub",
    Operation.MULTIPLY: "mul",
    Operation.DIVIDE: "div",
    Operation.NEGATE: "neg",
    Operation.SQUARE: "sq",
    Operation.TWICE: "twice",
    Operation.INVERSE: "inv",
    Operation.ABS: "abs",
    Operation.POWER: "pow",
    Operation.FMIN: "min",
    Operation.FMAX: "max",
    Operation.LESS: "lt",
    Operation.LESS_EQUAL: "le",
    Operation.EQUAL: "eq",
    Operation.NOT_EQUAL: "ne",
    Operation.NOT: "not",
    Operation.AND: "and",
    Operation.OR: "or",
    Operation.MASK: "if",
    Operation.SELECT: "where",
    **{Operation[name.upper()]: name for name in expression.FUNCTIONS if name != "abs"},
}
"""Kinds of nodes by the recorded operation."""
_MONOTONE: Mapping[str, Callable[..., float]] = {
    "add": operator.add,
    "neg": operator.neg,
    "mul": operator.mul,
    "div": operator.truediv,
    "pow": operator.pow,
    "max": max,
    "min": min,
    "abs": abs,
    **{
        name: getattr(math, name)
        for name in ("sqrt", "log", "exp", "sin", "cos", "tan", "sinh", "tanh", "asinh", "atan")
    },
}
"""Operations with their extrema at the ends of the ranges of their arguments, apart from poles and
from zero.
"""


def traced_expression(
    law: Any, method: str, new: Expressions, arguments: Sequence[Term], parameters: Sequence[Term]
) -> Term | None:
    """A method of a law at these arguments, with these nodes in place of its parameters, in the
    order of the leaves.

    None if the law cannot be traced, or contains an operation without a notation.
    """
    if not law.traceable:
        return None
    model, leaves = autodiff.symbolic(law)
    symbols = nodes.symbols("x", len(arguments))
    value = nodes.as_node(getattr(model, method)(*symbols))
    autodiff.check_finite([value], f"{type(law).__name__}.{method}")
    known = dict(zip(map(id, symbols), arguments, strict=True))
    known |= zip(map(id, leaves), parameters, strict=True)

    def notation(recorded: nodes.Node) -> Term:
        if recorded.operation == Operation.CONSTANT:
            return new.number(recorded.value)
        return known[id(recorded)]

    for recorded in nodes.in_order([value], known):
        terms = [notation(argument) for argument in recorded.arguments]
        kind = _KINDS.get(recorded.operation)
        if kind is None:
            return None
        known[id(recorded)] = new.apply(kind, *terms)
    return notation(value)


def within(root: Term, new: Expressions, ranges: Mapping[Term, Bounds]) -> Term:
    """The expression for symbols within these ranges; a parameter has the range of its value."""
    bounds: dict[Term, Bounds] = {}

    def rebuild(old: Term, arguments: list[Term]) -> Term:
        node = new.apply(old.kind, *arguments) if arguments else old
        for each in in_order(node):
            if each not in bounds:
                bounds[each] = _bounds_of(each, bounds, ranges)
        return _reduced(node, new, bounds)

    return fold(root, rebuild)


def _reduced(node: Term, new: Expressions, bounds: Mapping[Term, Bounds]) -> Term:
    """A maximum, minimum or comparison with only one possible value as that value."""
    if node.kind in (MAXIMUM, MINIMUM):
        for low, high in itertools.permutations(node.arguments):
            if _at_most(bounds[low], bounds[high]):
                return high if node.kind == MAXIMUM else low
    if node.kind in COMPARISONS:
        a, b = (bounds[each] for each in node.arguments)
        apart = a[1] < b[0] or a[0] > b[1]
        always, never = {
            "lt": (a[1] < b[0], a[0] >= b[1]),
            "le": (a[1] <= b[0], a[0] > b[1]),
            "eq": (False, apart),
            "ne": (apart, False),
        }[node.kind]
        return new.number(float(always)) if always or never else node
    return node


def _at_most(low: Bounds, high: Bounds) -> bool:
    """Whether no value of the first range exceeds one of the second by more than rounding."""
    if not (math.isfinite(low[1]) and math.isfinite(high[0])):
        return False
    return low[1] <= high[0] + ROUNDING * max(abs(low[1]), abs(high[0]))


def _bounds_of(node: Term, bounds: Mapping[Term, Bounds], ranges: Mapping[Term, Bounds]) -> Bounds:
    """The range of a node from those of its arguments, which are taken as independent."""
    if is_number(node):
        return node.value, node.value
    if not node.arguments:
        return ranges.get(node, UNKNOWN)
    sides = [bounds[each] for each in node.arguments]
    low, high = sides[0]
    last = sides[-1]
    if node.kind == expression.WHERE:
        return min(sides[1][0], last[0]), max(sides[1][1], last[1])
    if node.kind in ("sin", "cos") and low < high:
        return -1.0, 1.0
    defined = {
        "div": last[0] > 0 or last[1] < 0,
        "sqrt": low > 0,
        "log": low > 0,
        "tan": -0.5 * math.pi < low and high < 0.5 * math.pi,
        "pow": is_number(node.arguments[-1]) and last[0] > 0 and (low >= 0 or last[0] % 1 == 0),
    }
    if not defined.get(node.kind, node.kind in _MONOTONE):
        return UNKNOWN
    try:
        values = [_MONOTONE[node.kind](*ends) for ends in itertools.product(*sides)]
    except (OverflowError, ValueError, ZeroDivisionError):
        return UNKNOWN
    zero = [0.0] if low < 0 < high and node.kind in ("abs", POWER) else []
    return UNKNOWN if any(map(math.isnan, values)) else (min(values + zero), max(values + zero))

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
        for part in in_order(node):
            if part not in bounds:
                bounds[part] = _bounds_of(part, bounds, ranges)
        return _reduced(node, new, bounds)

    return fold(root, rebuild)


def _reduced(node: Term, new: Expressions, bounds: Mapping[Term, Bounds]) -> Term:
    """A maximum, minimum or comparison with only one possible value as that value."""
    if node.kind in (MAXIMUM, MINIMUM):
        for low, high in itertools.permutations(node.arguments):
            if _at_most(bounds[low], bounds[high]):
                return high if node.kind == MAXIMUM else low
    if node.kind in COMPARISONS:
        left, right = (bounds[argument] for argument in node.arguments)
        always, never = _decided(node.kind, left, right)
        if always or never:
            return new.number(float(always))
    return node


def _decided(kind: str, left: Bounds, right: Bounds) -> tuple[bool, bool]:
    """Whether a comparison holds for all values within these bounds, and whether for none."""
    low, high = left
    least, greatest = right
    apart = high < least or low > greatest
    match kind:
        case "lt":
            return high < least, low >= greatest
        case "le":
            return high <= least, low > greatest
        case "eq":
            return False, apart
        case "ne":
            return apart, False
    raise ValueError(f"{kind} is no comparison")


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
    sides = [bounds[argument] for argument in node.arguments]
    low, high = sides[0]
    if node.kind == expression.WHERE:
        _, when_true, when_false = sides
        return min(when_true[0], when_false[0]), max(when_true[1], when_false[1])
    if node.kind in ("sin", "cos") and low < high:
        return -1.0, 1.0
    if not _is_monotone(node, sides):
        return UNKNOWN
    operation = _MONOTONE[node.kind]
    try:
        values = [operation(*ends) for ends in itertools.product(*sides)]
    except (OverflowError, ValueError, ZeroDivisionError):
        return UNKNOWN
    if any(map(math.isnan, values)):
        return UNKNOWN
    if low < 0 < high and node.kind in ("abs", POWER):
        values.append(0.0)
    return min(values), max(values)


def _is_monotone(node: Term, sides: Sequence[Bounds]) -> bool:
    """Whether an operation has its extrema at the ends of the bounds of its arguments, or at 0."""
    low, high = sides[0]
    least, greatest = sides[-1]
    match node.kind:
        case "div":
            return least > 0 or greatest < 0
        case "sqrt" | "log":
            return low > 0
        case "tan":
            return -0.5 * math.pi < low and high < 0.5 * math.pi
        case "pow":
            return is_number(node.arguments[-1]) and least > 0 and (low >= 0 or least % 1 == 0)
    return node.kind in _MONOTONE

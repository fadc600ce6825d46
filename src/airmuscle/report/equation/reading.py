"""Recorded expressions in the form for reading: powers of one base collected, signs outside of
products, choices as maxima, and without limits that are not reached within the ranges of the
arguments.
"""

import functools
import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from ...core import Node, Operation, nodes, value_of

Bounds = tuple[float, float]
UNKNOWN: Bounds = (-math.inf, math.inf)
ROUNDING = 1e-9
"""Difference of two bounds, relative to them, that is a rounding error (chosen)."""
READABLE = frozenset(Operation) - {
    Operation.CONSTANT,
    Operation.SYMBOL,
    Operation.SIGN,
    Operation.FLOOR,
    Operation.MINIMUM,
    Operation.MAXIMUM,
}
"""Operations that all notations have."""
_LEAST_AT_ZERO = (Operation.ABS, Operation.SQUARE, Operation.POWER, Operation.COSH)


def readable(operation: Operation, *arguments: Node) -> Node:
    """The node of an operation in the form for reading."""
    first = arguments[0]
    match operation:
        case Operation.MULTIPLY:
            return _product(*arguments)
        case Operation.SQUARE:
            return _product(first, first)
        case Operation.POWER:
            return power(*arguments)
        case Operation.SELECT:
            return _choice(*arguments)
        case Operation.MASK:
            return _choice(first, arguments[1], nodes.ZERO)
        case Operation.LOG1P:
            return nodes.log(nodes.add(nodes.ONE, first))
        case Operation.EXPM1:
            return nodes.subtract(nodes.exp(first), nodes.ONE)
    return nodes.made(operation, arguments)


def is_constant(node: Node) -> bool:
    """Whether a node is a number."""
    return bool(node.operation == Operation.CONSTANT)


def power(base: Node, exponent: Node) -> Node:
    """base^exponent, which is not written as products."""
    if is_constant(base) or not is_constant(exponent) or exponent.value in (0.0, 1.0):
        return nodes.power(base, exponent)
    return nodes.binary(Operation.POWER, base, exponent)


def _product(a: Node, b: Node) -> Node:
    """a b; powers of one base are collected, and a sign is moved outside."""
    for factor, cofactor in ((a, b), (b, a)):
        is_negative = is_constant(factor) and factor.value < 0
        if is_negative or factor.operation == Operation.NEGATE:
            return nodes.negative(_product(nodes.negative(factor), cofactor))
    base, m = _as_power(a)
    other_base, n = _as_power(b)
    if base is other_base:
        return power(base, nodes.constant(m + n))
    return nodes.multiply(a, b)


def _as_power(node: Node) -> tuple[Node, float]:
    """A node as base and number in the exponent."""
    if node.operation == Operation.POWER and is_constant(node.arguments[1]):
        base, exponent = node.arguments
        return base, exponent.value
    return node, 1.0


def _choice(condition: Node, x: Node, y: Node) -> Node:
    """x where a condition holds, else y; a maximum, minimum or absolute value if it is one."""
    if nodes.identity(x) == nodes.identity(y):
        return x
    if condition.operation == Operation.NOT:
        return _choice(condition.arguments[0], y, x)
    if condition.operation in (Operation.LESS, Operation.LESS_EQUAL):
        compared = [nodes.identity(side) for side in condition.arguments]
        chosen = [nodes.identity(x), nodes.identity(y)]
        if compared == chosen:
            return nodes.smaller(x, y)
        if compared == chosen[::-1]:
            return nodes.larger(x, y)
        low, high = condition.arguments
        if high is x and nodes.negative(x) is y and is_constant(low) and low.value == 0.0:
            return abs(x)
    return Node(Operation.SELECT, (condition, x, y))


class _Ranged(NamedTuple):
    """An expression and the range of its values."""

    node: Node
    low: float
    high: float

    @property
    def bounds(self) -> Bounds:
        return self.low, self.high


def within(root: Node, ranges: Mapping[Node, Bounds]) -> Node | None:
    """A recorded expression in the form for reading, for symbols within these ranges.

    None if it contains an operation that a notation does not have.
    """
    known = {id(symbol): _Ranged(symbol, *bounds) for symbol, bounds in ranges.items()}
    if not {node.operation for node in nodes.in_order([root], known)} <= READABLE:
        return None
    rules = {operation: functools.partial(_ranged, operation) for operation in READABLE}
    [value] = nodes.replayed([root], known, rules)
    return _with_range(value).node


def _with_range(value: Any) -> _Ranged:
    """A number, which `replayed` hands over as it is, as an expression."""
    return value if isinstance(value, _Ranged) else _Ranged(nodes.constant(value), value, value)


def _ranged(operation: Operation, *operands: Any) -> _Ranged:
    """An operation of expressions, or the one of them that is its only possible value."""
    arguments = [_with_range(operand) for operand in operands]
    if operation == Operation.MASK:
        arguments.append(_with_range(0.0))
    if operation in (Operation.MASK, Operation.SELECT):
        return _chosen(*arguments)
    if operation in (Operation.FMIN, Operation.FMAX):
        for small, large in itertools.permutations(arguments):
            if _at_most(small, large):
                return large if operation == Operation.FMAX else small
    bounds = _bounds(operation, [argument.bounds for argument in arguments])
    return _Ranged(readable(operation, *(argument.node for argument in arguments)), *bounds)


def _chosen(condition: _Ranged, x: _Ranged, y: _Ranged) -> _Ranged:
    """x or y by a condition, which may have one possible value."""
    is_decided = condition.low == condition.high
    if is_decided:
        return x if condition.low else y
    node = _choice(condition.node, x.node, y.node)
    is_extreme = node.operation in (Operation.FMIN, Operation.FMAX)
    if is_extreme:
        return _ranged(node.operation, x, y)
    low = min(x.low, y.low)
    high = max(x.high, y.high)
    return _Ranged(node, low, high)


def _at_most(small: _Ranged, large: _Ranged) -> bool:
    """Whether no value of the first range exceeds one of the second by more than rounding."""
    if not (math.isfinite(small.high) and math.isfinite(large.low)):
        return False
    return small.high <= large.low + ROUNDING * max(abs(small.high), abs(large.low))


def _bounds(operation: Operation, sides: Sequence[Bounds]) -> Bounds:
    """The range of an operation from those of its arguments, which are taken as independent."""
    if not _is_monotone(operation, sides):
        return (-1.0, 1.0) if operation in (Operation.SIN, Operation.COS) else UNKNOWN
    ends_of_all = [*itertools.product(*sides)]
    (low, high), *further = sides
    if low < 0 < high and operation in _LEAST_AT_ZERO:
        ends_of_further = [end for end, _ in further]
        ends_of_all.append((0.0, *ends_of_further))
    values = [value_of(operation, *ends) for ends in ends_of_all]
    if any(map(math.isnan, values)):
        return UNKNOWN
    return min(values), max(values)


def _is_monotone(operation: Operation, sides: Sequence[Bounds]) -> bool:
    """Whether an operation has its extrema at the ends of these ranges, or at 0."""
    if all(low == high for low, high in sides):
        return True
    low, high = sides[0]
    least, greatest = sides[-1]
    match operation:
        case Operation.SIN | Operation.COS:
            return False
        case Operation.DIVIDE | Operation.INVERSE:
            return least > 0 or greatest < 0
        case Operation.TAN:
            return -0.5 * math.pi < low and high < 0.5 * math.pi
        case Operation.POWER:
            return least == greatest > 0 and (low >= 0 or least % 1 == 0)
        case Operation.EQUAL | Operation.NOT_EQUAL:
            return high < least or low > greatest
    return True

"""Derivatives of recorded expressions: rules of the operations, forward and reverse sweeps.

Derivatives are nodes and have derivatives. A selection masks what it does not select, so that an
infinite slope in a branch that is not selected does not matter. At a kink a slope is that of one
side.

Reference: Griewank, A., Walther, A., Evaluating Derivatives, 2nd ed., SIAM 2008, chapter 3.
"""

from collections.abc import Callable, Sequence

from . import nodes
from .nodes import CONSTANT, ONE, ZERO, Node, binary, in_order, unary
from .operations import CONDITIONS, Operation

_MINUS_ONE = nodes.constant(-1.0)
_TWO = nodes.constant(2.0)
_HALF = nodes.constant(0.5)
_FORWARD_COLUMNS = 2
"""Symbols up to which a Jacobian is computed forward, column by column (chosen)."""


def is_zero(node: Node) -> bool:
    """Whether a node is the number 0."""
    return bool(node.operation == CONSTANT and node.value == 0.0)


# Sums and products of slopes. Those of `nodes` would write a product with an inverse as a quotient,
# which takes longer where several slopes share the inverse.


def plus(a: Node, b: Node) -> Node:
    """a + b."""
    if is_zero(b):
        return a
    return b if is_zero(a) else binary(Operation.ADD, a, b)


def minus(a: Node) -> Node:
    """-a."""
    if a.operation == CONSTANT:
        return nodes.constant(-a.value)
    return unary(Operation.NEGATE, a)


def is_mask(node: Node) -> bool:
    """Whether a node is 0 or 1: a condition, or a mask of one."""
    while node.operation == Operation.MASK:
        node = node.arguments[1]
    return node.operation in CONDITIONS


def times(a: Node, b: Node) -> Node:
    """a b; a product with a condition is a mask."""
    if b.operation == CONSTANT or (a.operation != CONSTANT and is_mask(b)):
        a, b = b, a
    if a.operation != CONSTANT:
        return binary(Operation.MASK if is_mask(a) else Operation.MULTIPLY, a, b)
    if b.operation == CONSTANT:
        return nodes.constant(a.value * b.value)
    if a.value == 0.0:
        return ZERO
    if a.value == 1.0:
        return b
    return minus(b) if a.value == -1.0 else binary(Operation.MULTIPLY, a, b)


def over(a: Node) -> Node:
    """1/a."""
    return unary(Operation.INVERSE, a)


def _square(a: Node) -> Node:
    return unary(Operation.SQUARE, a)


def _of_quotient(x: Node, y: Node, r: Node) -> tuple[Node, ...]:
    return over(y), minus(times(r, over(y)))


def _of_power(x: Node, y: Node, r: Node) -> tuple[Node, ...]:
    if y.operation == CONSTANT:
        constant = nodes.constant(y.value - 1.0)
        return times(y, nodes.power(x, constant)), ZERO
    lower = plus(y, _MINUS_ONE)
    by_base = times(y, binary(Operation.POWER, x, lower))
    return by_base, times(r, unary(Operation.LOG, x))


def _inverse_root(x: Node, sign: Node) -> Node:
    """1/sqrt(1 + sign x^2)."""
    return over(unary(Operation.SQRT, plus(ONE, times(sign, _square(x)))))


def _of_choice(first: Node) -> tuple[Node, ...]:
    return first, nodes.negated(first)


RULES: dict[Operation, Callable[..., tuple[Node, ...]]] = {
    Operation.ADD: lambda x, y, r: (ONE, ONE),
    Operation.SUBTRACT: lambda x, y, r: (ONE, _MINUS_ONE),
    Operation.MULTIPLY: lambda x, y, r: (y, x),
    Operation.DIVIDE: _of_quotient,
    Operation.NEGATE: lambda x, r: (_MINUS_ONE,),
    Operation.SQUARE: lambda x, r: (unary(Operation.TWICE, x),),
    Operation.TWICE: lambda x, r: (_TWO,),
    Operation.INVERSE: lambda x, r: (minus(_square(r)),),
    Operation.SQRT: lambda x, r: (times(_HALF, over(r)),),
    Operation.ABS: lambda x, r: (unary(Operation.SIGN, x),),
    Operation.EXP: lambda x, r: (r,),
    Operation.EXPM1: lambda x, r: (plus(ONE, r),),
    Operation.LOG: lambda x, r: (over(x),),
    Operation.LOG1P: lambda x, r: (over(plus(ONE, x)),),
    Operation.SIN: lambda x, r: (unary(Operation.COS, x),),
    Operation.COS: lambda x, r: (minus(unary(Operation.SIN, x)),),
    Operation.TAN: lambda x, r: (plus(ONE, _square(r)),),
    Operation.ASIN: lambda x, r: (_inverse_root(x, _MINUS_ONE),),
    Operation.ACOS: lambda x, r: (minus(_inverse_root(x, _MINUS_ONE)),),
    Operation.ATAN: lambda x, r: (over(plus(ONE, _square(x))),),
    Operation.SINH: lambda x, r: (unary(Operation.COSH, x),),
    Operation.COSH: lambda x, r: (unary(Operation.SINH, x),),
    Operation.TANH: lambda x, r: (plus(ONE, minus(_square(r))),),
    Operation.ASINH: lambda x, r: (_inverse_root(x, ONE),),
    Operation.POWER: _of_power,
    Operation.FMAX: lambda x, y, r: _of_choice(nodes.less_equal(y, x)),
    Operation.FMIN: lambda x, y, r: _of_choice(nodes.less_equal(x, y)),
    Operation.MASK: lambda c, x, r: (ZERO, c),
    Operation.SELECT: lambda c, x, y, r: (ZERO, c, nodes.negated(c)),
    **{
        operation: lambda *arguments_and_result: (ZERO,) * (len(arguments_and_result) - 1)
        for operation in (*CONDITIONS, Operation.SIGN, Operation.FLOOR)
    },
}
"""Slopes of a result by its arguments, from these arguments and the result."""


def partials(node: Node) -> tuple[Node, ...]:
    """The slopes of a node by its arguments."""
    return RULES[node.operation](*node.arguments, node)


def _product(slope: Node, seed: Node) -> Node:
    """Slope times seed, which is a mask if one of both is a condition."""
    if slope is ONE:
        return seed
    if is_mask(slope):
        return nodes.mask(slope, seed)
    return nodes.mask(seed, slope) if is_mask(seed) else nodes.multiply(slope, seed)


def _dependent(roots: Sequence[Node], symbols: Sequence[Node]) -> tuple[list[Node], set[int]]:
    """The nodes that depend on symbols, in order, and the identities of these nodes and symbols."""
    moving = set(map(id, symbols))
    dependent = []
    for node in in_order(roots, moving):
        if any(id(argument) in moving for argument in node.arguments):
            moving.add(id(node))
            dependent.append(node)
    return dependent, moving


def tangents(
    roots: Sequence[Node], symbols: Sequence[Node], direction: Sequence[Node]
) -> list[Node]:
    """The derivatives of roots while symbols move along a direction."""
    tangent_of = {
        id(symbol): change
        for symbol, change in zip(symbols, direction, strict=True)
        if not is_zero(change)
    }
    moved = [symbol for symbol in symbols if id(symbol) in tangent_of]
    dependent, _ = _dependent(roots, moved)
    for node in dependent:
        total = ZERO
        for argument, slope in zip(node.arguments, partials(node), strict=True):
            seed = tangent_of.get(id(argument))
            if seed is not None and slope is not ZERO:
                total = nodes.add(total, _product(slope, seed))
        if not is_zero(total):
            tangent_of[id(node)] = total
    return [tangent_of.get(id(root), ZERO) for root in roots]


def _swept(
    seeds: Sequence[tuple[Node, Node]], dependent: Sequence[Node], moving: set[int]
) -> dict[int, Node]:
    """The adjoints of nodes by identity: each root has a seed, `dependent` are in order."""
    adjoint: dict[int, Node] = {}
    for root, seed in seeds:
        if id(root) in moving:
            adjoint[id(root)] = nodes.add(adjoint.get(id(root), ZERO), seed)
    for node in reversed(dependent):
        received = adjoint.get(id(node))
        if received is None or is_zero(received):
            continue
        for argument, slope in zip(node.arguments, partials(node), strict=True):
            if id(argument) in moving and slope is not ZERO:
                part = _product(slope, received)
                known = adjoint.get(id(argument))
                adjoint[id(argument)] = part if known is None else nodes.add(known, part)
    return adjoint


def gradient(root: Node, symbols: Sequence[Node]) -> list[Node]:
    """The derivatives of one root by symbols."""
    return weighted_gradient([root], symbols, [ONE])


def weighted_gradient(
    roots: Sequence[Node], symbols: Sequence[Node], weights: Sequence[Node]
) -> list[Node]:
    """The derivatives of the sum of weight times root by symbols."""
    dependent, moving = _dependent(roots, symbols)
    adjoint = _swept(list(zip(roots, weights, strict=True)), dependent, moving)
    return [adjoint.get(id(symbol), ZERO) for symbol in symbols]


def jacobian(roots: Sequence[Node], symbols: Sequence[Node]) -> list[list[Node]]:
    """The derivatives of each root by each symbol; ZERO where there is no dependence."""
    if len(symbols) <= min(len(roots), _FORWARD_COLUMNS):
        columns = []
        for k in range(len(symbols)):
            direction = [ONE if i == k else ZERO for i in range(len(symbols))]
            column = tangents(roots, symbols, direction)
            columns.append(column)
        return [[column[i] for column in columns] for i in range(len(roots))]
    dependent, moving = _dependent(roots, symbols)
    rank = {id(node): k for k, node in enumerate(dependent)}
    rows = []
    for root in roots:
        needed = sorted(_needed([root], rank))
        of_root = [dependent[k] for k in needed]
        adjoint = _swept([(root, ONE)], of_root, moving)
        row = [adjoint.get(id(symbol), ZERO) for symbol in symbols]
        rows.append(row)
    return rows


def _needed(roots: Sequence[Node], rank: dict[int, int]) -> set[int]:
    """The ranks of the nodes that roots need."""
    needed: set[int] = set()
    stack = list(roots)
    while stack:
        node = stack.pop()
        k = rank.get(id(node))
        if k is not None and k not in needed:
            needed.add(k)
            stack += node.arguments
    return needed


def by_row(matrix: Sequence[Sequence[Node]]) -> list[Node]:
    """The elements of a matrix, one row after the other."""
    return [element for row in matrix for element in row]

"""Recorded expressions: scalars as nodes, simplified as they are written, equal ones made once.

A law that is called with symbols in place of numbers leaves its expression behind. A node that was
computed from others is listed at one of its arguments (`extensions`): the same operation of the
same arguments is found there and not made again, so that common subexpressions are shared from the
start. There is no table of all nodes: what nobody holds is freed, and recordings of several threads
touch different tables. Two threads that compute with the same node at the same time may make an
equal node twice, which costs sharing, not correctness.

The functions have NumPy's names, so that `ops` uses this module as it uses NumPy.
"""

import contextlib
import gc
import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from .errors import TraceError
from .operations import CONDITIONS, Operation, quotient, value_of

# Operations as names of this module: an attribute of an enumeration takes longer than a comparison.
CONSTANT = Operation.CONSTANT
SYMBOL = Operation.SYMBOL
NEGATE = Operation.NEGATE
INVERSE = Operation.INVERSE
TWICE = Operation.TWICE
SQUARE = Operation.SQUARE
DIVIDE = Operation.DIVIDE
MULTIPLY = Operation.MULTIPLY
ADD = Operation.ADD
SUBTRACT = Operation.SUBTRACT
SQRT = Operation.SQRT
ABS = Operation.ABS
COS = Operation.COS
POWER = Operation.POWER
MASK = Operation.MASK
SELECT = Operation.SELECT

Binary = Callable[["Node", "Node"], "Node"]
"""What makes a node of two others."""
_LEFT = "left"
_RIGHT = "right"
_MAX_PRODUCTS = 100
"""Whole exponents up to which a power is written as products (chosen)."""


def _operator(of_two: Binary) -> Any:
    """The method of a node for an operator of two operands."""

    def method(self: "Node", other: Any) -> Any:
        node = _operand(other)
        return NotImplemented if node is None else of_two(self, node)

    return method


class Node:
    """A scalar: an operation of its arguments, a constant with a value, or a symbol with a name."""

    __slots__ = ("arguments", "extensions", "operation", "value")
    __array_ufunc__ = None  # NumPy leaves operations with nodes to the methods below

    operation: Operation
    arguments: tuple["Node", ...]
    value: Any
    """The number of a constant, the name of a symbol, otherwise None."""
    extensions: dict[Any, "Node"] | None
    """Nodes that were computed from this one, by operation and other arguments."""

    def __init__(
        self, operation: Operation, arguments: tuple["Node", ...] = (), value: Any = None
    ) -> None:
        self.operation = operation
        self.arguments = arguments
        self.value = value
        self.extensions = None

    __add__ = _operator(lambda x, y: add(x, y))
    __radd__ = _operator(lambda x, y: add(y, x))
    __sub__ = _operator(lambda x, y: subtract(x, y))
    __rsub__ = _operator(lambda x, y: subtract(y, x))
    __mul__ = _operator(lambda x, y: multiply(x, y))
    __rmul__ = _operator(lambda x, y: multiply(y, x))
    __truediv__ = _operator(lambda x, y: divide(x, y))
    __rtruediv__ = _operator(lambda x, y: divide(y, x))
    __pow__ = _operator(lambda x, y: power(x, y))
    __rpow__ = _operator(lambda x, y: power(y, x))
    __lt__ = _operator(lambda x, y: less(x, y))
    __le__ = _operator(lambda x, y: less_equal(x, y))
    __gt__ = _operator(lambda x, y: less(y, x))
    __ge__ = _operator(lambda x, y: less_equal(y, x))
    __eq__ = _operator(lambda x, y: equal(x, y))
    __ne__ = _operator(lambda x, y: not_equal(x, y))
    __hash__ = object.__hash__

    def __neg__(self) -> "Node":
        return negative(self)

    def __pos__(self) -> "Node":
        return self

    def __abs__(self) -> "Node":
        return unary(ABS, self)

    def __bool__(self) -> bool:
        if self.operation == CONSTANT:
            return bool(self.value)
        raise TraceError(
            "a recorded value has no truth value: the law is recorded for all numbers. Use"
            " airmuscle.core.ops.where, both and either instead of `if`, `and` and `or`."
        )

    def __float__(self) -> float:
        # NaN for what has no number, so that `check_finite` names the law that asked for one.
        return float(self.value) if self.operation == CONSTANT else math.nan

    def __copy__(self) -> "Node":
        return self

    def __deepcopy__(self, memo: Any) -> "Node":
        return self

    def __repr__(self) -> str:
        if self.operation in (CONSTANT, SYMBOL):
            return str(self.value)
        return f"{self.operation.name.lower()}({', '.join(map(repr, self.arguments))})"


def constant(value: float) -> Node:
    """A constant."""
    return Node(CONSTANT, value=float(value))


ZERO = constant(0.0)
ONE = constant(1.0)


def symbol(name: str) -> Node:
    """A new symbol."""
    return Node(SYMBOL, value=name)


def symbols(name: str, count: int) -> list[Node]:
    """New symbols `name[0]`, `name[1]`, ..."""
    return [symbol(f"{name}[{i}]") for i in range(count)]


def _operand(value: Any) -> Node | None:
    """A number as a constant, a node as it is; None for anything else."""
    if type(value) is Node:
        return value
    if isinstance(value, float | int | np.number | np.bool_):
        return Node(CONSTANT, value=float(value))
    return None


def as_node(value: Any) -> Node:
    """A number as a constant; a node as it is. Raises TraceError for anything else."""
    node = _operand(value)
    if node is not None:
        return node
    if isinstance(value, np.ndarray) and value.size == 1:
        return as_node(value.item())
    raise TraceError(
        f"a recorded expression received {type(value).__name__}; it takes numbers. Use"
        " airmuscle.core.ops, and write a law for one point."
    )


def as_nodes(values: Sequence[Any]) -> list[Node]:
    """Numbers as constants, nodes as they are."""
    return [as_node(value) for value in values]


@contextlib.contextmanager
def recording() -> Iterator[None]:
    """A recording without the garbage collector, which takes up to half of its time.

    Nodes and their tables refer to each other, so that the collector walks through all of them each
    time, and finds nothing to free.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def unary(operation: Operation, x: Node) -> Node:
    """The node of an operation of one argument."""
    if x.operation == CONSTANT:
        return Node(CONSTANT, value=value_of(operation, x.value))
    if operation == SQRT and x.operation == SQUARE:
        return unary(ABS, x.arguments[0])
    if operation == ABS and x.operation in (ABS, SQUARE):
        return x
    known = x.extensions
    if known is None:
        known = x.extensions = {}
    node = known.get(operation)
    if node is None:
        node = known[operation] = Node(operation, (x,))
    return node


def binary(operation: Operation, x: Node, y: Node) -> Node:
    """The node of an operation of two arguments that are not both constant."""
    key: Any
    if x.operation == CONSTANT:
        owner, key = y, (operation, _LEFT, x.value)
    elif y.operation == CONSTANT:
        owner, key = x, (operation, _RIGHT, y.value)
    elif operation in (ADD, MULTIPLY) and id(y) < id(x):  # which commute
        owner, key = y, (operation, id(x))
    else:
        owner, key = x, (operation, id(y))
    known = owner.extensions
    if known is None:
        known = owner.extensions = {}
    node = known.get(key)
    if node is None:
        node = known[key] = Node(operation, (x, y))
    return node


def add(x: Node, y: Node) -> Node:
    """x + y."""
    if x.operation > COS and y.operation > COS:
        return binary(ADD, x, y)
    node = _sum_with_constant(x, y)
    if node is None:
        node = _cancelled_sum(x, y)
    return binary(ADD, x, y) if node is None else node


def _sum_with_constant(x: Node, y: Node) -> Node | None:
    if x.operation == CONSTANT and y.operation == CONSTANT:
        return Node(CONSTANT, value=x.value + y.value)
    if _is_number(x, 0.0):
        return y
    return x if _is_number(y, 0.0) else None


def _cancelled_sum(x: Node, y: Node) -> Node | None:
    """x + (-y), (x - y) + y, x + x and sin^2 + cos^2 in a simpler form; None for another sum."""
    p = x.operation
    q = y.operation
    if q == NEGATE:
        return subtract(x, y.arguments[0])
    if p == NEGATE:
        return subtract(y, x.arguments[0])
    if x is y:
        return unary(TWICE, x)
    if p == SUBTRACT and x.arguments[1] is y:
        return x.arguments[0]
    if q == SUBTRACT and y.arguments[1] is x:
        return y.arguments[0]
    return ONE if _is_circle(x, y) else None


def _is_circle(x: Node, y: Node) -> bool:
    """Whether two nodes are the squares of the sine and of the cosine of one angle."""
    if x.operation != SQUARE or y.operation != SQUARE:
        return False
    first = x.arguments[0]
    second = y.arguments[0]
    pair = {first.operation, second.operation}
    return pair == {Operation.SIN, COS} and first.arguments[0] is second.arguments[0]


def subtract(x: Node, y: Node) -> Node:
    """x - y."""
    if x is y:
        return ZERO
    if x.operation > COS and y.operation > COS:
        return binary(SUBTRACT, x, y)
    node = _difference_with_constant(x, y)
    if node is None:
        node = _cancelled_difference(x, y)
    return binary(SUBTRACT, x, y) if node is None else node


def _difference_with_constant(x: Node, y: Node) -> Node | None:
    if x.operation == CONSTANT and y.operation == CONSTANT:
        return Node(CONSTANT, value=x.value - y.value)
    if _is_number(y, 0.0):
        return x
    return negative(y) if _is_number(x, 0.0) else None


def _cancelled_difference(x: Node, y: Node) -> Node | None:
    """x - (-y), (x + y) - y, x - (x + y) and -x - y in a simpler form; None for another one."""
    if y.operation == NEGATE:
        return add(x, y.arguments[0])
    remainder = _other_summand(x, y)
    if remainder is not None:
        return remainder
    remainder = _other_summand(y, x)
    if remainder is not None:
        return negative(remainder)
    return negative(add(x.arguments[0], y)) if x.operation == NEGATE else None


def _other_summand(total: Node, summand: Node) -> Node | None:
    """What a sum contains besides a summand; None if it is no sum of it."""
    if total.operation != ADD:
        return None
    a, b = total.arguments
    if b is summand:
        return a
    return b if a is summand else None


def multiply(x: Node, y: Node) -> Node:
    """x y."""
    if x is y:
        return square(x)
    if x.operation > COS and y.operation > COS:
        return binary(MULTIPLY, x, y)
    if y.operation == CONSTANT:
        x, y = y, x
    node = _scaled(x, y) if x.operation == CONSTANT else None
    if node is None:
        node = _cancelled_product(x, y)
    return binary(MULTIPLY, x, y) if node is None else node


def _scaled(number: Node, y: Node) -> Node | None:
    """A number times a node, where that is simpler than a product; otherwise None."""
    factor = number.value
    if y.operation == CONSTANT:
        return Node(CONSTANT, value=factor * y.value)
    if factor == 0.0:
        return ZERO
    if abs(factor) == 1.0:
        return y if factor > 0 else negative(y)
    if y.operation == MULTIPLY and y.arguments[0].operation == CONSTANT:
        return multiply(constant(factor * y.arguments[0].value), y.arguments[1])
    if factor == 2.0:
        return unary(TWICE, y)
    if y.operation == DIVIDE and _is_number(y.arguments[1], factor):
        return y.arguments[0]
    return None


def _cancelled_product(x: Node, y: Node) -> Node | None:
    """x (1/y), (x/y) y and (-x) y in a simpler form; None for another product."""
    p = x.operation
    q = y.operation
    if q == INVERSE:
        return divide(x, y.arguments[0])
    if p == INVERSE:
        return divide(y, x.arguments[0])
    if p == DIVIDE and x.arguments[1] is y:
        return x.arguments[0]
    if q == DIVIDE and y.arguments[1] is x:
        return y.arguments[0]
    if p == NEGATE:
        return negative(multiply(x.arguments[0], y))
    return negative(multiply(x, y.arguments[0])) if q == NEGATE else None


def _is_number(x: Node, value: float) -> bool:
    return bool(x.operation == CONSTANT and x.value == value)


def divide(x: Node, y: Node) -> Node:
    """x / y."""
    if x is y:
        return ONE
    if x.operation > COS and y.operation > COS:
        return binary(DIVIDE, x, y)
    node = _over_number(x, y) if y.operation == CONSTANT else _number_over(x, y)
    if node is None:
        node = _cancelled_quotient(x, y)
    return binary(DIVIDE, x, y) if node is None else node


def _over_number(x: Node, number: Node) -> Node | None:
    """A node divided by a number, where that is simpler than a quotient; otherwise None."""
    divisor = number.value
    if x.operation == CONSTANT:
        return Node(CONSTANT, value=quotient(x.value, divisor))
    if abs(divisor) == 1.0:
        return x if divisor > 0 else negative(x)
    if x.operation == TWICE and divisor == 2.0:
        return x.arguments[0]
    return constant(math.inf) if divisor == 0.0 else None


def _number_over(x: Node, y: Node) -> Node | None:
    """0/y and 1/y; None for another quotient."""
    if _is_number(x, 0.0):
        return x
    if _is_number(x, 1.0):
        return y.arguments[0] if y.operation == INVERSE else unary(INVERSE, y)
    return None


def _cancelled_quotient(x: Node, y: Node) -> Node | None:
    """(x y)/y, x/(1/y), (2 x)/(2 y), x/(y x) and (-x)/y in a simpler form; None for another
    quotient.
    """
    p = x.operation
    q = y.operation
    if p == MULTIPLY and (x.arguments[0] is y or x.arguments[1] is y):
        a, b = x.arguments
        return b if a is y else a
    if q == INVERSE:
        return multiply(x, y.arguments[0])
    if p == TWICE and q == TWICE:
        return divide(x.arguments[0], y.arguments[0])
    if q == MULTIPLY and y.arguments[1] is x:
        return unary(INVERSE, y.arguments[0])
    if p == NEGATE:
        return negative(divide(x.arguments[0], y))
    return negative(divide(x, y.arguments[0])) if q == NEGATE else None


def negative(x: Node) -> Node:
    """-x."""
    if x.operation == CONSTANT:
        return Node(CONSTANT, value=-x.value)
    return x.arguments[0] if x.operation == NEGATE else unary(NEGATE, x)


def square(x: Node) -> Node:
    """x^2."""
    if x.operation == SQRT:
        return x.arguments[0]
    return square(x.arguments[0]) if x.operation == NEGATE else unary(SQUARE, x)


def inverse(x: Node) -> Node:
    """1 / x."""
    return divide(ONE, x)


def twice(x: Node) -> Node:
    """2 x."""
    return x if _is_number(x, 0.0) else multiply(constant(2.0), x)


def power(x: Node, y: Node) -> Node:
    """x^y; small whole powers are products."""
    if y.operation != CONSTANT:
        return binary(POWER, x, y)
    exponent = y.value
    if x.operation == CONSTANT:
        return Node(CONSTANT, value=value_of(POWER, x.value, exponent))
    if exponent == 0.5:
        return unary(SQRT, x)
    if not abs(exponent) <= _MAX_PRODUCTS or exponent != math.floor(exponent):
        return binary(POWER, x, y)
    if exponent == 0:
        return ONE
    if exponent < 0:
        return divide(ONE, power(x, constant(-exponent)))
    if exponent == 1:
        return x
    if exponent % 2:
        return multiply(x, power(x, constant(exponent - 1)))
    root = power(x, constant(exponent / 2))
    return multiply(root, root)


def _of_two(operation: Operation, of_equal: Node | None) -> Binary:
    """The function that makes the node of two arguments, which is `of_equal` if they are the
    same."""

    def made(x: Node, y: Node) -> Node:
        if x.operation == CONSTANT and y.operation == CONSTANT:
            return Node(CONSTANT, value=value_of(operation, x.value, y.value))
        if x is y and of_equal is not None:
            return of_equal
        return binary(operation, x, y)

    made.__name__ = made.__qualname__ = operation.name.lower()
    return made


less: Binary = _of_two(Operation.LESS, ZERO)
less_equal: Binary = _of_two(Operation.LESS_EQUAL, ONE)
equal: Binary = _of_two(Operation.EQUAL, ONE)
not_equal: Binary = _of_two(Operation.NOT_EQUAL, ZERO)
_both = _of_two(Operation.AND, None)
_either = _of_two(Operation.OR, None)
_smaller = _of_two(Operation.FMIN, None)
_larger = _of_two(Operation.FMAX, None)


def smaller(x: Any, y: Any) -> Node:
    """The smaller of two values; a NaN is left out."""
    a = as_node(x)
    b = as_node(y)
    return a if a is b else _smaller(a, b)


def larger(x: Any, y: Any) -> Node:
    """The larger of two values; a NaN is left out."""
    a = as_node(x)
    b = as_node(y)
    return a if a is b else _larger(a, b)


def limited(x: Any, low: Any, high: Any) -> Node:
    """A value limited to the interval from `low` to `high`."""
    return smaller(larger(x, low), high)


def negated(condition: Node) -> Node:
    """1 where a condition is 0, else 0."""
    return unary(Operation.NOT, condition)


def mask(condition: Node, x: Node) -> Node:
    """`x` where the condition is not zero, else 0."""
    if _is_number(x, 0.0):
        return x
    if condition.operation == CONSTANT:
        return x if condition.value else ZERO
    if _is_number(x, 1.0) and condition.operation in CONDITIONS:
        return condition
    return binary(MASK, condition, x)


def where(condition: Any, when_true: Any, when_false: Any) -> Node:
    """`when_true` where the condition is not zero, else `when_false`."""
    return select(as_node(condition), as_node(when_true), as_node(when_false))


def select(condition: Node, x: Node, y: Node) -> Node:
    """`x` where the condition is not zero, else `y`."""
    if condition.operation == CONSTANT:
        return x if condition.value else y
    if x is y:
        return x
    if _is_number(y, 0.0):
        return mask(condition, x)
    if _is_number(x, 0.0):
        return mask(negated(condition), y)
    known = condition.extensions
    if known is None:
        known = condition.extensions = {}
    key = (SELECT, identity(x), identity(y))
    node = known.get(key)
    if node is None:
        node = known[key] = Node(SELECT, (condition, x, y))
    return node


def identity(node: Node) -> Any:
    """A key that is equal for equal nodes: a constant is made anew each time."""
    return (_RIGHT, node.value) if node.operation == CONSTANT else id(node)


def logical_and(x: Any, y: Any) -> Node:
    """Logical conjunction of two conditions."""
    return _both(as_node(x), as_node(y))


def logical_or(x: Any, y: Any) -> Node:
    """Logical disjunction of two conditions."""
    return _either(as_node(x), as_node(y))


def _elementary(operation: Operation) -> Callable[[Any], Node]:
    def function(x: Any) -> Node:
        return unary(operation, as_node(x))

    function.__name__ = function.__qualname__ = operation.name.lower()
    return function


sqrt = _elementary(SQRT)
floor = _elementary(Operation.FLOOR)
exp = _elementary(Operation.EXP)
log = _elementary(Operation.LOG)
expm1 = _elementary(Operation.EXPM1)
log1p = _elementary(Operation.LOG1P)
sin = _elementary(Operation.SIN)
cos = _elementary(COS)
tan = _elementary(Operation.TAN)
sinh = _elementary(Operation.SINH)
cosh = _elementary(Operation.COSH)
tanh = _elementary(Operation.TANH)
arcsin = _elementary(Operation.ASIN)
arccos = _elementary(Operation.ACOS)
arctan = _elementary(Operation.ATAN)
arcsinh = _elementary(Operation.ASINH)
sign = _elementary(Operation.SIGN)


def ceil(x: Any) -> Node:
    """The least integer that is not below x."""
    return negative(floor(-as_node(x)))


def log2(x: Any) -> Node:
    """The logarithm to the base 2."""
    return multiply(constant(1.0 / math.log(2.0)), log(x))


def log10(x: Any) -> Node:
    """The decimal logarithm."""
    return multiply(constant(1.0 / math.log(10.0)), log(x))


def arccosh(x: Any) -> Node:
    """The inverse hyperbolic cosine, accurate near 1."""
    above = as_node(x) - 1.0
    return log1p(above + sqrt(above * (above + 2.0)))


def arctanh(x: Any) -> Node:
    """The inverse hyperbolic tangent, accurate near 0."""
    value = as_node(x)
    return multiply(constant(0.5), log1p(2.0 * value / (1.0 - value)))


def logical_not(condition: Any) -> Node:
    """Logical negation of a condition."""
    return negated(as_node(condition))


_MAKERS: dict[Operation, Callable[..., Node]] = {
    NEGATE: negative,
    INVERSE: inverse,
    TWICE: twice,
    SQUARE: square,
    DIVIDE: divide,
    MULTIPLY: multiply,
    ADD: add,
    SUBTRACT: subtract,
    POWER: power,
    Operation.FMIN: smaller,
    Operation.FMAX: larger,
    Operation.LESS: less,
    Operation.LESS_EQUAL: less_equal,
    Operation.EQUAL: equal,
    Operation.NOT_EQUAL: not_equal,
    Operation.AND: _both,
    Operation.OR: _either,
    MASK: mask,
    SELECT: select,
}
"""The functions that make nodes, but those of which `unary` is one."""


def made(operation: Operation, arguments: Sequence[Node]) -> Node:
    """The node of an operation, simplified."""
    maker = _MAKERS.get(operation)
    return unary(operation, *arguments) if maker is None else maker(*arguments)


# Walks


def in_order(roots: Sequence[Node], known: Collection[int] = ()) -> list[Node]:
    """All nodes but constants that the roots need, each after its arguments.

    Nodes whose identities are in `known` are left out, with what they alone need.
    """
    seen = set(known)
    ordered: list[Node] = []
    for root in roots:
        stack: list[Node | None] = [root] if root.operation != CONSTANT else []
        while stack:
            node = stack.pop()
            if node is None:  # all arguments of the next one are listed
                ordered.append(stack.pop())  # type: ignore[arg-type]
                continue
            if id(node) in seen:
                continue
            seen.add(id(node))
            if not node.arguments:
                ordered.append(node)
                continue
            stack.append(node)
            stack.append(None)
            for argument in reversed(node.arguments):
                if argument.operation != CONSTANT:
                    stack.append(argument)
    return ordered


def constants_of(roots: Sequence[Node]) -> list[float]:
    """The numbers that the roots contain."""
    values = [root.value for root in roots if root.operation == CONSTANT]
    for node in in_order(roots):
        values += [x.value for x in node.arguments if x.operation == CONSTANT]
    return values


def occurring(roots: Sequence[Node], candidates: Sequence[Node]) -> list[bool]:
    """Whether the roots depend on each of these nodes."""
    needed = set(map(id, in_order(roots)))
    return [id(node) in needed for node in candidates]


def replaced(
    roots: Sequence[Node],
    old: Sequence[Node],
    new: Sequence[Any],
    ordered: Sequence[Node] | None = None,
) -> list[Node]:
    """The roots with other nodes, or numbers, in place of some; `ordered` are all nodes that they
    need, if these are known."""
    values = {id(node): as_node(value) for node, value in zip(old, new, strict=True)}
    for node in in_order(roots, values) if ordered is None else ordered:
        if id(node) in values:
            continue
        arguments = tuple(values.get(id(x), x) for x in node.arguments)
        same = all(x is y for x, y in zip(arguments, node.arguments, strict=True))
        values[id(node)] = node if same else made(node.operation, arguments)
    return [values.get(id(root), root) for root in roots]


def replayed(
    roots: Sequence[Node], values: Mapping[int, Any], of: Mapping[Operation, Callable[..., Any]]
) -> list[Any]:
    """The roots computed anew in other objects, such as the symbols of another library.

    values    by identity of the nodes that are known, among them all symbols
    of        the function for each operation
    """
    known = dict(values)

    def value(node: Node) -> Any:
        return node.value if node.operation == CONSTANT else known[id(node)]

    for node in in_order(roots, known):
        known[id(node)] = of[node.operation](*map(value, node.arguments))
    return [value(root) for root in roots]

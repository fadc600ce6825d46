"""Operations of recorded expressions, and their values at numbers."""

import enum
import math
from collections.abc import Callable


class Operation(enum.IntEnum):
    """The operation of a node or of an instruction.

    CONSTANT and SYMBOL have no arguments. Comparisons and logical operations are 1 or 0. MASK(c, x)
    is x where c is not zero, else 0; SELECT(c, x, y) is x where c is not zero, else y. MAXIMUM and
    MINIMUM select one of two numbers, as one machine instruction does; FMAX and FMIN are those of
    C, which leave NaN out.
    """

    # Simplifications look for the operations up to COS; the order saves a lookup for all others.
    CONSTANT = 0
    SYMBOL = 1
    NEGATE = 2
    INVERSE = 3
    TWICE = 4
    SQUARE = 5
    DIVIDE = 6
    MULTIPLY = 7
    ADD = 8
    SUBTRACT = 9
    SQRT = 10
    ABS = 11
    SIN = 12
    COS = 13
    TAN = 14
    ASIN = 15
    ACOS = 16
    ATAN = 17
    SINH = 18
    COSH = 19
    TANH = 20
    ASINH = 21
    EXP = 22
    LOG = 23
    EXPM1 = 24
    LOG1P = 25
    POWER = 26
    SIGN = 27
    FLOOR = 28
    FMIN = 29
    FMAX = 30
    MINIMUM = 31
    MAXIMUM = 32
    LESS = 33
    LESS_EQUAL = 34
    EQUAL = 35
    NOT_EQUAL = 36
    NOT = 37
    AND = 38
    OR = 39
    MASK = 40
    SELECT = 41


CONDITIONS = frozenset(
    {
        Operation.LESS,
        Operation.LESS_EQUAL,
        Operation.EQUAL,
        Operation.NOT_EQUAL,
        Operation.NOT,
        Operation.AND,
        Operation.OR,
    }
)
"""Operations whose results are 0 or 1."""


def quotient(a: float, b: float) -> float:
    """a / b, as a processor computes it."""
    if b:
        return a / b
    if a == 0.0 or math.isnan(a):
        return math.nan
    return math.copysign(math.inf, a) * math.copysign(1.0, b)


def _sign(x: float) -> float:
    return x if math.isnan(x) else float((x > 0) - (x < 0))


OF_NUMBERS: dict[Operation, Callable[..., float]] = {
    Operation.NEGATE: lambda x: -x,
    Operation.INVERSE: lambda x: quotient(1.0, x),
    Operation.TWICE: lambda x: x + x,
    Operation.SQUARE: lambda x: x * x,
    Operation.DIVIDE: quotient,
    Operation.MULTIPLY: lambda x, y: x * y,
    Operation.ADD: lambda x, y: x + y,
    Operation.SUBTRACT: lambda x, y: x - y,
    Operation.SQRT: math.sqrt,
    Operation.ABS: abs,
    Operation.SIN: math.sin,
    Operation.COS: math.cos,
    Operation.TAN: math.tan,
    Operation.ASIN: math.asin,
    Operation.ACOS: math.acos,
    Operation.ATAN: math.atan,
    Operation.SINH: math.sinh,
    Operation.COSH: math.cosh,
    Operation.TANH: math.tanh,
    Operation.ASINH: math.asinh,
    Operation.EXP: math.exp,
    Operation.LOG: math.log,
    Operation.EXPM1: math.expm1,
    Operation.LOG1P: math.log1p,
    Operation.POWER: math.pow,
    Operation.SIGN: _sign,
    Operation.FLOOR: lambda x: float(math.floor(x)),
    Operation.FMIN: lambda x, y: x if x <= y or math.isnan(y) else y,
    Operation.FMAX: lambda x, y: x if x >= y or math.isnan(y) else y,
    Operation.LESS: lambda x, y: float(x < y),
    Operation.LESS_EQUAL: lambda x, y: float(x <= y),
    Operation.EQUAL: lambda x, y: float(x == y),
    Operation.NOT_EQUAL: lambda x, y: float(x != y),
    Operation.NOT: lambda x: float(x == 0.0),
    Operation.AND: lambda x, y: float(x != 0.0 and y != 0.0),
    Operation.OR: lambda x, y: float(x != 0.0 or y != 0.0),
    Operation.MASK: lambda condition, x: x if condition else 0.0,
    Operation.SELECT: lambda condition, x, y: x if condition else y,
}
"""Operations of numbers; those of the module math raise outside their domain."""
_INFINITE = {Operation.EXP, Operation.EXPM1, Operation.COSH, Operation.POWER}


def value_of(operation: Operation, *numbers: float) -> float:
    """An operation of numbers; NaN outside its domain, infinity beyond the largest number."""
    try:
        return OF_NUMBERS[operation](*numbers)
    except OverflowError:
        x = numbers[0]
        if operation in _INFINITE:
            return math.inf
        return math.copysign(math.inf, x) if operation == Operation.SINH else x
    except ValueError:
        x = numbers[0]
        pole = (operation == Operation.LOG and x == 0.0) or (
            operation == Operation.LOG1P and x == -1.0
        )
        return -math.inf if pole else math.nan

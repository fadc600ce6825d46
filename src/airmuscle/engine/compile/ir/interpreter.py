"""Interpreter of instructions in IEEE 754 double or single precision, operation by operation as they are printed.

The numbers are those of printed C that is compiled without fused operations, bit by bit, with the functions of the C
library that Python uses.
"""

import math
import struct
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from .emission import FunctionBlock, unknown_operation
from .instructions import Operand, Operation

Function = Callable[..., float]


def _divided(x: float, y: float) -> float:
    if y != 0.0:
        return x / y
    sign = math.copysign(1.0, x) * math.copysign(1.0, y)
    return math.nan if x == 0.0 or math.isnan(x) else math.copysign(math.inf, sign)


_FUNCTIONS: dict[Operation, Function] = {
    Operation.SQRT: math.sqrt, Operation.EXP: math.exp, Operation.LOG: math.log, Operation.SIN: math.sin,
    Operation.COS: math.cos, Operation.TAN: math.tan, Operation.ATAN: math.atan, Operation.SINH: math.sinh,
    Operation.COSH: math.cosh, Operation.TANH: math.tanh, Operation.ASINH: math.asinh, Operation.ASIN: math.asin,
    Operation.ACOS: math.acos, Operation.LOG1P: math.log1p, Operation.EXPM1: math.expm1, Operation.POWER: math.pow,
    Operation.CONSTANT_POWER: math.pow, Operation.FLOOR: lambda x: float(math.floor(x)),
}  # fmt: skip
_OPERATIONS: dict[Operation, Function] = {
    Operation.ASSIGN: lambda x: x,
    Operation.ADD: lambda x, y: x + y,
    Operation.SUBTRACT: lambda x, y: x - y,
    Operation.MULTIPLY: lambda x, y: x * y,
    Operation.AND: lambda x, y: x * y,
    Operation.DIVIDE: _divided,
    Operation.INVERSE: lambda x: _divided(1.0, x),
    Operation.NEGATE: lambda x: -x,
    Operation.SQUARE: lambda x: x * x,
    Operation.TWICE: lambda x: x + x,
    Operation.ABS: abs,
    Operation.SIGN: lambda x: 1.0 if x > 0 else -1.0 if x < 0 else 0.0,
    Operation.LESS: lambda x, y: float(x < y),
    Operation.LESS_EQUAL: lambda x, y: float(x <= y),
    Operation.EQUAL: lambda x, y: float(x == y),
    Operation.NOT_EQUAL: lambda x, y: float(x != y),
    Operation.NOT: lambda x: float(x == 0.0),
    Operation.OR: lambda x, y: float(x + y != 0.0),
    Operation.FMIN: lambda x, y: x if x < y else y,
    Operation.FMAX: lambda x, y: x if x > y else y,
    Operation.MINIMUM: lambda x, y: x if x < y else y,
    Operation.MAXIMUM: lambda x, y: x if x > y else y,
    Operation.MASK: lambda x, y: y if x != 0.0 else 0.0,
    Operation.SELECT: lambda x, y, z: y if x != 0.0 else z,
}
_NOT_FINITE: dict[Operation, Callable[..., Any]] = {
    Operation.SQRT: np.sqrt, Operation.EXP: np.exp, Operation.LOG: np.log, Operation.SIN: np.sin,
    Operation.COS: np.cos, Operation.TAN: np.tan, Operation.SINH: np.sinh, Operation.COSH: np.cosh,
    Operation.ASIN: np.arcsin, Operation.ACOS: np.arccos, Operation.LOG1P: np.log1p, Operation.EXPM1: np.expm1,
    Operation.POWER: np.power, Operation.CONSTANT_POWER: np.power, Operation.FLOOR: np.floor,
}  # fmt: skip
"""Functions for which Python raises an exception where the C library gives infinity or NaN."""


def _to_single(value: float) -> float:
    try:
        single: float = struct.unpack("<f", struct.pack("<f", value))[0]
    except OverflowError:
        return math.copysign(math.inf, value)
    return single


class InterpretedBody(FunctionBlock):
    """A function that is evaluated while it is emitted; its arrays are `arrays`, its results stand in `stored`.

    single  every number is rounded to single precision
    """

    def __init__(self, arrays: Mapping[str, Sequence[float]], single: bool = False) -> None:
        super().__init__()
        self._single = single
        self.stored: dict[tuple[str, int], float] = {}
        self._arrays, self._values = arrays, dict[str, float]()

    def assignment(self, name: str, expression: str) -> str:
        return f"{name} = {expression}"

    def _result(self, value: float) -> str:
        name = self.new_name()
        self._values[name] = _to_single(value) if self._single else value
        return name

    def constant(self, value: float) -> str:
        return self._result(value)

    def load(self, array: str, index: int) -> str:
        return self._result(float(self._arrays[array][index]))

    def store(self, array: str, index: int, value: str) -> None:
        self.stored[array, index] = self._values[value]

    def operate(self, operation: Operation, x: Sequence[str]) -> str:
        values = [self._values[name] for name in x]
        if operation in _OPERATIONS:
            return self._result(_OPERATIONS[operation](*values))
        if operation not in _FUNCTIONS:
            raise unknown_operation(operation, "interpreted")
        try:
            return self._result(_FUNCTIONS[operation](*values))
        except (ValueError, OverflowError):  # of Python; the C library gives infinity or NaN
            with np.errstate(all="ignore"):
                return self._result(float(_NOT_FINITE[operation](*map(np.float64, values))))

    def unless_zero(
        self, gates: Sequence[str], compute: Callable[[], dict[Operand, str]], instead: Mapping[Operand, str]
    ) -> dict[Operand, str]:
        if any(self._values[gate] != 0.0 for gate in gates):
            inside = compute()
            return {operand: inside[operand] for operand in instead}
        return dict(instead)

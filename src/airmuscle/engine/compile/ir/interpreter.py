"""Interpreter of instructions in IEEE 754 double or single precision, operation by operation as
they are printed.

The numbers are those of printed C that is compiled without fused operations, bit by bit, with the
functions of the C library that Python uses.
"""

import math
import operator
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ....core import quotient
from .emission import FunctionBlock, nearest_single
from .instructions import Operand

_OPERATORS: dict[str, Callable[[float, float], float]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": quotient,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    "==": operator.eq,
    "!=": operator.ne,
}


class InterpretedBody(FunctionBlock):
    """A function that is evaluated while it is emitted; its arrays are `arrays`, its results stand
    in `stored`.

    single  every number is rounded to single precision
    """

    language = "interpreted"

    def __init__(self, arrays: Mapping[str, Sequence[float]], single: bool = False) -> None:
        super().__init__()
        self._single = single
        self.stored: dict[tuple[str, int], float] = {}
        self._arrays, self._values = arrays, dict[str, float]()

    def _result(self, value: float) -> str:
        name = self.new_name()
        self._values[name] = nearest_single(value) if self._single else value
        return name

    def constant(self, value: float) -> str:
        return self._result(value)

    def load(self, array: str, index: int) -> str:
        return self._result(float(self._arrays[array][index]))

    def store(self, array: str, index: int, value: str) -> None:
        self.stored[array, index] = self._values[value]

    def arithmetic(self, operator: str, a: str, b: str) -> str:
        return self._result(_OPERATORS[operator](self._values[a], self._values[b]))

    def negative(self, a: str) -> str:
        return self._result(-self._values[a])

    def choose(self, comparison: str, a: str, b: str, when_true: str, when_false: str) -> str:
        return when_true if _OPERATORS[comparison](self._values[a], self._values[b]) else when_false

    def call(self, function: str, x: Sequence[str]) -> str:
        values = [self._values[name] for name in x]
        try:
            return self._result(
                float(getattr(math, "fabs" if function == "abs" else function)(*values))
            )
        except (ValueError, OverflowError):  # of Python; the C library gives infinity or NaN
            with np.errstate(all="ignore"):
                return self._result(float(getattr(np, function)(*map(np.float64, values))))

    def unless_zero(
        self,
        gates: Sequence[str],
        compute: Callable[[], dict[Operand, str]],
        instead: Mapping[Operand, str],
    ) -> dict[Operand, str]:
        if any(self._values[gate] != 0.0 for gate in gates):
            inside = compute()
            return {operand: inside[operand] for operand in instead}
        return dict(instead)

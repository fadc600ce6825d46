"""Emission of instructions into functions of a target language: straight-line code, and branches
around blocks.
"""

import abc
import functools
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ....core import Operation, TraceError
from .instructions import CALLED, Code, Operand
from .scheduling import ConditionalBlock, Item
from .skipped_blocks import COMMANDED, STEADY, VARYING, skipping

LEVEL = {"u": COMMANDED, "w": STEADY, "h": STEADY}
"""Arguments that do not depend on the states: inputs, their slopes, and the step size."""

_ARITHMETIC = {
    Operation.ADD: "+",
    Operation.SUBTRACT: "-",
    Operation.MULTIPLY: "*",
    Operation.DIVIDE: "/",
    Operation.SQUARE: "*",
    Operation.TWICE: "+",
}
"""Operators between the first and the last argument."""
_FUNCTIONS = {Operation.SQRT: "sqrt", Operation.ABS: "abs", Operation.FLOOR: "floor", **CALLED}
_COMPARISONS = {
    Operation.LESS: "<",
    Operation.LESS_EQUAL: "<=",
    Operation.EQUAL: "==",
    Operation.NOT_EQUAL: "!=",
}
_EXTREMES = {
    Operation.FMIN: "<",
    Operation.FMAX: ">",
    Operation.MINIMUM: "<",
    Operation.MAXIMUM: ">",
}
"""Strict comparison, as in the processor's instruction: of two equal values either may be
returned.
"""


def nearest_single(value: float) -> float:
    """The nearest number in single precision; infinity where the value is too large for it."""
    with np.errstate(over="ignore"):
        return float(np.float32(value))


class FunctionBlock(abc.ABC):
    """The lines of one function under construction, with elimination of common subexpressions.

    A subclass states what its language writes: constants, array elements, arithmetic, calls and
    choices. `needed` are the functions that the target must be given a definition of, with the
    number of their arguments.
    """

    language: str
    """Name of the language in messages."""

    def __init__(self, scalars: Sequence[str] = ()) -> None:
        self.lines: list[str] = []
        self.scalars = frozenset(scalars)
        self.needed: dict[str, int] = {}
        self.known: dict[str, str] = {}
        """The names of values by their expressions."""
        self._named = 0

    def put(self, expression: str) -> str:
        """The name of the value of `expression`; the instruction is appended unless it exists
        already.
        """
        name = self.known.get(expression)
        if name is None:
            name = self.known[expression] = self.new_name()
            self.lines.append(self.assignment(name, expression))
        return name

    def new_name(self) -> str:
        """A name that no value has."""
        self._named += 1
        return f"v{self._named}"

    def assignment(self, name: str, expression: str) -> str:
        """The line that gives a value its name."""
        return f"{name} = {expression}"

    @abc.abstractmethod
    def constant(self, value: float) -> str:
        """A constant."""

    @abc.abstractmethod
    def load(self, array: str, index: int) -> str:
        """The value of an array element, or of a scalar argument."""

    @abc.abstractmethod
    def store(self, array: str, index: int, value: str) -> None:
        """Write a value into an array element."""

    @abc.abstractmethod
    def arithmetic(self, operator: str, a: str, b: str) -> str:
        """The value of a + b, a - b, a * b or a / b."""

    @abc.abstractmethod
    def negative(self, a: str) -> str:
        """The value of -a."""

    @abc.abstractmethod
    def call(self, function: str, x: Sequence[str]) -> str:
        """The value of a function, by its name in C; `abs` is that of numbers."""

    @abc.abstractmethod
    def choose(self, comparison: str, a: str, b: str, when_true: str, when_false: str) -> str:
        """`when_true` where a < b, a <= b, a > b, a == b or a != b, as `comparison` states, else
        `when_false`.
        """

    def logical(self, operator: str, a: str, b: str) -> str:
        """The product or the sum of two conditions."""
        return self.arithmetic(operator, a, b)

    def sign(self, x: str) -> str:
        """1, 0 or -1, as the sign of a value."""
        zero = self.constant(0.0)
        negative = self.choose("<", x, zero, self.constant(-1.0), zero)
        return self.choose(">", x, zero, self.constant(1.0), negative)

    def operate(self, operation: Operation, x: Sequence[str]) -> str:
        """The value of one operation, whose instructions are appended; raises TraceError for an
        unknown operation.
        """
        if operation in _ARITHMETIC:
            return self.arithmetic(_ARITHMETIC[operation], x[0], x[-1])
        if operation in _FUNCTIONS:
            return self.call(_FUNCTIONS[operation], x)
        unity = self.constant(1.0)
        zero = self.constant(0.0)
        if operation in _COMPARISONS:
            return self.choose(_COMPARISONS[operation], x[0], x[1], unity, zero)
        if operation in _EXTREMES:
            return self.choose(_EXTREMES[operation], x[0], x[1], x[0], x[1])
        match operation:
            case Operation.NEGATE:
                return self.negative(x[0])
            case Operation.INVERSE:
                return self.arithmetic("/", unity, x[0])
            case Operation.SIGN:
                return self.sign(x[0])
            case Operation.NOT:
                return self.choose("==", x[0], zero, unity, zero)
            case Operation.AND:
                return self.logical("*", x[0], x[1])
            case Operation.OR:
                return self.choose("!=", self.logical("+", x[0], x[1]), zero, unity, zero)
            case Operation.MASK | Operation.SELECT:
                return self.choose(
                    "!=", x[0], zero, x[1], x[2] if operation == Operation.SELECT else zero
                )
        raise TraceError(
            f"operation {operation.name} has no {self.language} form; write the law over"
            " airmuscle.core.ops."
        )

    def unless_zero(
        self,
        gates: Sequence[str],
        compute: Callable[[], dict[Operand, str]],
        instead: Mapping[Operand, str],
    ) -> dict[Operand, str]:
        """The results that `compute` appends and returns if a gate is not zero, otherwise those of
        `instead`.

        In a language without branches they are computed in any case: their product with the gate is
        zero.
        """
        inside = compute()
        return {operand: inside[operand] for operand in instead}


class TargetLanguage(abc.ABC):
    """A language in which functions of arrays are printed. Arrays are arguments that do not
    overlap.
    """

    labels: Mapping[str, Sequence[Any]] = {}
    """The names of the elements of arrays, in a language that has names for values."""

    @abc.abstractmethod
    def body(self, scalars: Sequence[str] = ()) -> FunctionBlock:
        """An empty function of which some arguments are numbers, the others arrays."""

    def function(self, name: str, inputs: Sequence[str], outputs: Sequence[str], body: Any) -> str:
        """The text of a function of arrays and numbers that computes `outputs`; in a language
        without, its lines.
        """
        return "\n".join(body.lines)

    def preparation(
        self, name: str, inputs: Sequence[str], outputs: Sequence[str], body: Any
    ) -> str:
        """The text of a function that is called once for a set of parameters."""
        return self.function(name, inputs, outputs, body)


def computed(
    block: FunctionBlock,
    code: Code,
    inputs: Sequence[str],
    precomputed: Mapping[Operand, int] | None = None,
) -> dict[tuple[int, int], str]:
    """Append code to a block; the names of its results by output and index. Other arguments as of
    `Emission`.
    """
    emission = Emission(block, inputs, precomputed or {}, {})
    emission.run(with_gates(code, inputs, precomputed or {}))
    return {(o, i): emission.value_of(operand) for o, i, operand in code.outputs}


def with_gates(
    code: Code,
    inputs: Sequence[str],
    precomputed: Mapping[Operand, int],
    early: frozenset[Operand] = frozenset(),
) -> list[Item]:
    """The instructions of `code`, with those that a zero factor or an inactive clamp makes
    redundant in blocks.
    """

    return skipping(code, levels_of_inputs(inputs, precomputed), early)


def levels_of_inputs(
    inputs: Sequence[str], precomputed: Collection[Operand]
) -> Callable[[Operand], int]:
    """What an operand that no instruction computes depends on."""

    def level(operand: Operand) -> int:
        return STEADY if operand in precomputed else LEVEL.get(inputs[operand[1]], VARYING)

    return level


class Emission:
    """Instructions appended to a block, and the names of their results, `values`.

    `inputs` are the names of the arrays, `precomputed` the indices of operands in `c`, `values`
    the names of known values.
    """

    def __init__(
        self,
        block: FunctionBlock,
        inputs: Sequence[str],
        precomputed: Mapping[Operand, int],
        values: Mapping[Operand, str],
    ) -> None:
        self.block, self.inputs, self.held, self.values = block, inputs, precomputed, dict(values)

    def run(self, body: Iterable[Item]) -> dict[Operand, str]:
        """Append instructions and conditional blocks; the names of all values."""
        for line in body:
            if isinstance(line, ConditionalBlock):
                instead = {operand: self.value_of(value) for operand, value in line.instead}
                inside = Emission(self.block, self.inputs, self.held, self.values)
                compute = functools.partial(inside.run, line.body)
                self.values |= self.block.unless_zero(
                    [self.value_of(gate) for gate in line.gates], compute, instead
                )
            else:
                self.values[line.result] = self.block.operate(
                    line.operation, list(map(self.value_of, line.arguments))
                )
        return self.values

    def value_of(self, operand: Operand) -> str:
        """The name of the value of an operand, which is loaded if it is an array element."""
        if operand in self.values:
            return self.values[operand]
        if operand in self.held:
            return self.block.load("c", self.held[operand])
        if operand[0] == "c":
            return self.block.constant(float(operand[1]))
        return self.block.load(self.inputs[operand[1]], operand[2])

"""ONNX graph of printed functions: each instruction is a node, each array a tensor (elements, count)."""

from collections.abc import Callable, Mapping, Sequence

from .ir.emission import FunctionBlock, unknown_operation
from .ir.instructions import Operand, Operation

_NODES = {
    Operation.ADD: "Add", Operation.SUBTRACT: "Sub", Operation.MULTIPLY: "Mul", Operation.AND: "Mul",
    Operation.DIVIDE: "Div", Operation.NEGATE: "Neg", Operation.SQRT: "Sqrt", Operation.ABS: "Abs",
    Operation.FLOOR: "Floor", Operation.EXP: "Exp", Operation.LOG: "Log", Operation.SIN: "Sin", Operation.COS: "Cos",
    Operation.ATAN: "Atan", Operation.ASIN: "Asin", Operation.ACOS: "Acos", Operation.TANH: "Tanh",
    Operation.POWER: "Pow", Operation.CONSTANT_POWER: "Pow", Operation.SIGN: "Sign",
}  # fmt: skip
_TESTS = {Operation.LESS: "Less", Operation.LESS_EQUAL: "LessOrEqual", Operation.EQUAL: "Equal"}
_EXTREMES = {Operation.FMIN: "Less", Operation.MINIMUM: "Less", Operation.FMAX: "Greater", Operation.MAXIMUM: "Greater"}


class GraphBody(FunctionBlock):
    """Nodes and constants of a graph; functions are appended one after the other.

    nodes      (operator, inputs, output)
    constants  numbers by name; those named i0, i1, ... are indices
    arrays     the name of the tensor of each array that was not computed here
    results    elements of the arrays that were computed, which later functions read
    """

    def __init__(self, arrays: Mapping[str, str]) -> None:
        super().__init__()
        self.nodes: list[tuple[str, tuple[str, ...], str]] = []
        self.constants: dict[str, float] = {}
        self.arrays, self.results = dict(arrays), dict[str, dict[int, str]]()

    def assignment(self, name: str, expression: str) -> str:
        return f"{name} = {expression}"

    def node(self, operator: str, *inputs: str) -> str:
        """The output of a node, which is appended unless it exists already."""
        key = f"{operator}({', '.join(inputs)})"
        if key not in self._known:
            self._known[key] = self.new_name()
            self.nodes.append((operator, inputs, self._known[key]))
        return self._known[key]

    def constant(self, value: float) -> str:
        return self._constant(f"k{value!r}", value)

    def _constant(self, name: str, value: float) -> str:
        self.constants[name] = value
        return name

    def load(self, array: str, index: int) -> str:
        if array in self.results:
            return self.results[array][index]
        if array in self.scalars:
            return array
        return self.node("Gather", self.arrays.get(array, array), self._constant(f"i{index}", index))

    def store(self, array: str, index: int, value: str) -> None:
        self.results.setdefault(array, {})[index] = value

    def operate(self, operation: Operation, x: Sequence[str]) -> str:
        node, one, zero = self.node, self.constant(1.0), self.constant(0.0)
        if operation in _NODES:
            return node(_NODES[operation], *x)
        if operation in _TESTS:
            return node("Where", node(_TESTS[operation], *x), one, zero)
        if operation in _EXTREMES:
            return node("Where", node(_EXTREMES[operation], *x), *x)
        composed: dict[Operation, Callable[[], str]] = {
            Operation.ASSIGN: lambda: x[0],
            Operation.SQUARE: lambda: node("Mul", x[0], x[0]),
            Operation.TWICE: lambda: node("Add", x[0], x[0]),
            Operation.INVERSE: lambda: node("Div", one, x[0]),
            Operation.NOT_EQUAL: lambda: node("Where", node("Equal", *x), zero, one),
            Operation.NOT: lambda: node("Where", node("Equal", x[0], zero), one, zero),
            Operation.OR: lambda: node("Where", node("Equal", node("Add", *x), zero), zero, one),
            Operation.MASK: lambda: node("Where", node("Equal", x[0], zero), zero, x[1]),
            Operation.SELECT: lambda: node("Where", node("Equal", x[0], zero), x[2], x[1]),
            Operation.TAN: lambda: node("Div", node("Sin", x[0]), node("Cos", x[0])),
            Operation.LOG1P: lambda: self._log1p(x[0]),
            Operation.EXPM1: lambda: self._expm1(x[0]),
            Operation.SINH: lambda: self._sinh(x[0]),
            Operation.COSH: lambda: self._half(node("Exp", x[0]), node("Exp", node("Neg", x[0]))),
            Operation.ASINH: lambda: self._asinh(x[0]),
        }
        if operation not in composed:
            raise unknown_operation(operation, "ONNX")
        return composed[operation]()

    def _half(self, a: str, b: str) -> str:
        return self.node("Mul", self.constant(0.5), self.node("Add", a, b))

    def _log1p(self, x: str) -> str:
        """log(1 + x), accurate for small x, by W. Kahan's quotient log(u) x/(u - 1) with u = 1 + x."""
        node, one = self.node, self.constant(1.0)
        u = node("Add", one, x)
        quotient = node("Div", node("Mul", node("Log", u), x), node("Sub", u, one))
        return node("Where", node("Equal", u, one), x, quotient)

    def _expm1(self, x: str) -> str:
        """exp(x) - 1, accurate for small x, by (u - 1) x/log(u) with u = exp(x)."""
        node, one = self.node, self.constant(1.0)
        u = node("Exp", x)
        less = node("Sub", u, one)
        small = node("Where", node("Equal", u, one), x, node("Div", node("Mul", less, x), node("Log", u)))
        return node("Where", node("Equal", less, self.constant(-1.0)), less, small)

    def _sinh(self, x: str) -> str:
        less = self._expm1(x)
        return self._half(less, self.node("Div", less, self.node("Add", less, self.constant(1.0))))

    def _asinh(self, x: str) -> str:
        node, one, size = self.node, self.constant(1.0), self.node("Abs", x)
        square = node("Mul", x, x)
        root = node("Add", one, node("Sqrt", node("Add", one, square)))
        return node("Mul", node("Sign", x), self._log1p(node("Add", size, node("Div", square, root))))

    def unless_zero(
        self, gates: Sequence[str], compute: Callable[[], dict[Operand, str]], instead: Mapping[Operand, str]
    ) -> dict[Operand, str]:
        inside = compute()
        return {operand: inside[operand] for operand in instead}

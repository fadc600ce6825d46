"""ONNX graph of printed functions: each instruction is a node, each array a tensor (elements,
count).
"""

from collections.abc import Mapping, Sequence

from .ir.emission import FunctionBlock

_NODES = {
    "+": "Add",
    "-": "Sub",
    "*": "Mul",
    "/": "Div",
    "<": "Less",
    "<=": "LessOrEqual",
    ">": "Greater",
    "==": "Equal",
}


class GraphBody(FunctionBlock):
    """Nodes and constants of a graph; functions are appended one after the other.

    nodes      (operator, inputs, output)
    constants  numbers by name; those named i0, i1, ... are indices
    arrays     the name of the tensor of each array that was not computed here
    results    elements of the arrays that were computed, which later functions read
    """

    language = "ONNX"

    def __init__(self, arrays: Mapping[str, str]) -> None:
        super().__init__()
        self.nodes: list[tuple[str, tuple[str, ...], str]] = []
        self.constants: dict[str, float] = {}
        self.arrays, self.results = dict(arrays), dict[str, dict[int, str]]()

    def node(self, operator: str, *inputs: str) -> str:
        """The output of a node, which is appended unless it exists already."""
        key = f"{operator}({', '.join(inputs)})"
        if key not in self.known:
            self.known[key] = self.new_name()
            self.nodes.append((operator, inputs, self.known[key]))
        return self.known[key]

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
        return self.node(
            "Gather", self.arrays.get(array, array), self._constant(f"i{index}", index)
        )

    def store(self, array: str, index: int, value: str) -> None:
        self.results.setdefault(array, {})[index] = value

    def arithmetic(self, operator: str, a: str, b: str) -> str:
        return self.node(_NODES[operator], a, b)

    def negative(self, a: str) -> str:
        return self.node("Neg", a)

    def sign(self, x: str) -> str:
        return self.node("Sign", x)

    def choose(self, comparison: str, a: str, b: str, when_true: str, when_false: str) -> str:
        if comparison == "!=":
            return self.choose("==", a, b, when_false, when_true)
        return self.node("Where", self.node(_NODES[comparison], a, b), when_true, when_false)

    def call(self, function: str, x: Sequence[str]) -> str:
        """A node, or several for a function that has none."""
        node = self.node
        number = x[0]
        match function:
            case "tan":
                return node("Div", node("Sin", number), node("Cos", number))
            case "cosh":
                return self._half(node("Exp", number), node("Exp", node("Neg", number)))
            case "sinh":
                less = self._expm1(number)
                return self._half(less, node("Div", less, node("Add", less, self.constant(1.0))))
            case "asinh":
                unity = self.constant(1.0)
                size = node("Abs", number)
                square = node("Mul", number, number)
                root = node("Add", unity, node("Sqrt", node("Add", unity, square)))
                return node(
                    "Mul",
                    node("Sign", number),
                    self._log1p(node("Add", size, node("Div", square, root))),
                )
            case "log1p":
                return self._log1p(number)
            case "expm1":
                return self._expm1(number)
        return node(function.capitalize(), *x)

    def _half(self, a: str, b: str) -> str:
        return self.node("Mul", self.constant(0.5), self.node("Add", a, b))

    def _log1p(self, x: str) -> str:
        """log(1 + x), accurate for small x, by W. Kahan's quotient log(u) x/(u - 1) with u = 1 +
        x.
        """
        node = self.node
        unity = self.constant(1.0)
        u = node("Add", unity, x)
        quotient = node("Div", node("Mul", node("Log", u), x), node("Sub", u, unity))
        return node("Where", node("Equal", u, unity), x, quotient)

    def _expm1(self, x: str) -> str:
        """exp(x) - 1, accurate for small x, by (u - 1) x/log(u) with u = exp(x)."""
        node = self.node
        unity = self.constant(1.0)
        u = node("Exp", x)
        less = node("Sub", u, unity)
        small = node(
            "Where", node("Equal", u, unity), x, node("Div", node("Mul", less, x), node("Log", u))
        )
        return node("Where", node("Equal", less, self.constant(-1.0)), less, small)

"""Printer of the expressions of kernels, by the precedence of their operators."""

import abc
import ast
import math
from collections.abc import Sequence

from .source import KernelSource
from .types import ElementType, TypedKernel, indices

OPERATORS: dict[type, tuple[str, int]] = {
    ast.Or: ("||", 1),
    ast.And: ("&&", 2),
    ast.Eq: ("==", 4),
    ast.NotEq: ("!=", 4),
    ast.Lt: ("<", 4),
    ast.LtE: ("<=", 4),
    ast.Gt: (">", 4),
    ast.GtE: (">=", 4),
    ast.Add: ("+", 5),
    ast.Sub: ("-", 5),
    ast.Mult: ("*", 6),
    ast.Div: ("/", 6),
}
"""Operators with their precedence."""
CONDITIONAL = 0
NEGATION = 7
ATOM = 9
"""Precedence of a conditional value, of signs, and of names, numbers and calls."""
FUNCTIONS = {"min", "max", "abs", "sqrt", "np.ceil", "np.floor", "np.sqrt", "np.exp", "np.log"}


class ExpressionPrinter(abc.ABC):
    """Text of expressions of the function `kernel` in a language; a subclass states what its
    language writes.
    """

    kernel: TypedKernel
    source: KernelSource
    reserved: frozenset[str] = frozenset()
    """Words that cannot be names; a name that is one of them is followed by an underscore."""
    spelling: dict[type, str]
    """Operators that the language writes otherwise."""
    infinity: str
    flags = "false", "true"

    @abc.abstractmethod
    def element(self, array: ast.Name, at: Sequence[ast.expr]) -> str:
        """An element, or a row, of an array."""

    @abc.abstractmethod
    def size(self, array: str, dimension: int) -> str:
        """The number of elements of an array in one dimension."""

    @abc.abstractmethod
    def call(self, name: str, arguments: Sequence[ast.expr]) -> str:
        """A call of one of FUNCTIONS, of `int`, or of a printed function with one result and no
        changed array.
        """

    @abc.abstractmethod
    def conditional(self, node: ast.IfExp) -> str:
        """A conditional value."""

    def name(self, name: str) -> str:
        """A variable."""
        return f"{name}_" if name in self.reserved else name

    def expression(self, node: ast.expr, outer: int = 0) -> str:
        """An expression, in parentheses if it binds less than `outer`."""
        text, precedence = self._expression(node)
        return f"({text})" if precedence < outer else text

    def _expression(self, node: ast.expr) -> tuple[str, int]:
        match node:
            case ast.Constant(value=bool(value)):
                return self.flags[value], ATOM
            case ast.Constant(value=int(value)):
                return str(value), ATOM
            case ast.Constant(value=float(value)):
                return self.number(value), ATOM
            case ast.Name(id=name):
                return self._named(node), ATOM
            case ast.Attribute() if ast.unparse(node) == "np.inf":
                return self.number(math.inf), ATOM
            case ast.Subscript(value=ast.Name() as array):
                return self.element(array, indices(node)), ATOM
            case ast.Subscript(
                value=ast.Attribute(value=ast.Name(id=name), attr="shape"),
                slice=ast.Constant(value=int(k)),
            ):
                return self.size(name, k), ATOM
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return f"-{self.expression(operand, NEGATION)}", NEGATION
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return (
                    f"{self.spelling.get(ast.Not, '!')}{self.expression(operand, NEGATION)}",
                    NEGATION,
                )
            case ast.BinOp() | ast.BoolOp() | ast.Compare():
                return self._operation(node)
            case ast.IfExp():
                return self.conditional(node), CONDITIONAL
            case ast.Call(keywords=[]):
                return self._call(node), ATOM
        raise self.source.unprintable(node, f"the expression {type(node).__name__}")

    def number(self, value: float) -> str:
        """A finite number or infinity that is not negative."""
        return self.infinity if math.isinf(value) else repr(value).removesuffix(".0")

    def _named(self, node: ast.Name) -> str:
        name = node.id
        if name in self.kernel.kinds:
            return self.name(name)
        value = self.source.constants.get(name)
        if value is None:
            raise self.source.unprintable(node, f"the unknown name {name}")
        return self.number(value) if math.isinf(value) else name

    def _operator(self, operator: ast.AST, node: ast.expr) -> tuple[str, int]:
        if type(operator) not in OPERATORS:
            raise self.source.unprintable(node, f"the operator {type(operator).__name__}")
        text, precedence = OPERATORS[type(operator)]
        return self.spelling.get(type(operator), text), precedence

    def operator(self, text: str, left: ast.expr, right: ast.expr) -> str:
        """An arithmetic operator between these operands."""
        return text

    def _operation(self, node: ast.BinOp | ast.BoolOp | ast.Compare) -> tuple[str, int]:
        if isinstance(node, ast.BinOp):
            if isinstance(node.op, ast.Pow):
                return self.call("pow", [node.left, node.right]), ATOM
            text, level = self._operator(node.op, node)
            text = self.operator(text, node.left, node.right)
            return (
                (
                    f"{self.expression(node.left, level)} {text}"
                    f" {self.expression(node.right, level + 1)}"
                ),
                level,
            )
        if isinstance(node, ast.BoolOp):
            text, level = self._operator(node.op, node)
            return f" {text} ".join(self.expression(value, 3) for value in node.values), level
        operands = [node.left, *node.comparators]
        parts = []
        for operator, left, right in zip(node.ops, operands, operands[1:], strict=False):
            text, level = self._operator(operator, node)
            if (self.kernel.of(left) == ElementType.FLAG) != (
                self.kernel.of(right) == ElementType.FLAG
            ):
                raise self.source.unprintable(node, "a comparison of a flag with a number")
            parts.append(f"{self.expression(left, 5)} {text} {self.expression(right, 5)}")
        return " && ".join(parts), 4 if len(parts) == 1 else 2

    def _call(self, node: ast.Call) -> str:
        name = ast.unparse(node.func)
        called = self.kernel.calls.get(name)
        if called is not None and (called.written or len(called.returns) != 1):
            raise self.source.unprintable(
                node, "a function with several results within an expression"
            )
        if called is None and name not in FUNCTIONS and name != "int":
            raise self.source.unprintable(node, f"the function {name}")
        return self.call(name, node.args)

    def joined(self, arguments: Sequence[ast.expr]) -> str:
        """Arguments in a call."""
        return ", ".join(map(self.expression, arguments))

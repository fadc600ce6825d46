"""Notations of an expression: LaTeX, MATLAB, Excel and C."""

import abc
import math
from collections.abc import Collection, Mapping
from typing import ClassVar

from ..formatting import symbol_formula
from .expression import ADD, NEGATIVE, NUMBER, POWER, PRODUCT, QUOTIENT, SYMBOL, WHERE, Node, fold, in_order, is_number

SUM, TERM, BASE, ATOM = 1, 2, 3, 4
"""Binding strengths of a sum, a product, a power and what needs no parentheses."""
_RELATIONS = {"lt": "<", "le": "<=", "eq": "==", "ne": "!="}


class Notation(abc.ABC):
    """Writer of expressions. `names` are the texts of symbols and of parts that are defined elsewhere."""

    relations: ClassVar[Mapping[str, str]] = _RELATIONS
    logical: ClassVar[Mapping[str, str]] = {"and": "&&", "or": "||", "not": "!"}
    functions: ClassVar[Mapping[str, str]] = {}
    """Names of functions that differ from the kinds of their nodes; with `pow`, a power is a call of a function."""
    parentheses: ClassVar[str] = "({})"
    choice: ClassVar[str]
    """Form of a choice, from the condition, the value where it holds, and the other value."""

    def __init__(self, names: Mapping[Node, str], arguments: Collection[Node] = ()) -> None:
        self._names, self._arguments = names, set(arguments)

    @property
    def defined(self) -> Collection[Node]:
        """The symbols and parts with a name."""
        return self._names.keys()

    def text(self, root: Node, *, definition: bool = False) -> str:
        """The expression; with `definition`, that of a part itself and not its name."""
        if not definition and root in self._names:
            return self._names[root]

        def write(node: Node, inner: list[tuple[str, int]]) -> tuple[str, int]:
            is_named = node in self._names and not (definition and node is root)
            return (self._names[node], ATOM) if is_named else self._write(node, inner)

        return fold(root, write)[0]

    def _write(self, node: Node, inner: list[tuple[str, int]]) -> tuple[str, int]:
        texts = [text for text, _ in inner]
        match node.kind:
            case _ if node.kind == NUMBER:
                return self.number(node.number), ATOM if node.number >= 0 else SUM
            case _ if node.kind == SYMBOL:
                return self._names.get(node, node.name), ATOM
            case _ if node.kind == ADD:
                left, right = texts
                return f"{left} - {right[1:]}" if right.startswith("-") else f"{left} + {right}", SUM
            case _ if node.kind == NEGATIVE:
                return f"-{self._bound(inner[0], TERM)}", SUM
            case _ if node.kind == PRODUCT:
                strength = TERM if node.arguments[1].kind == PRODUCT else BASE
                return self._product(node, self._bound(inner[0], TERM), self._bound(inner[1], strength)), TERM
            case _ if node.kind == QUOTIENT:
                return self._quotient(node, inner)
            case _ if node.kind == POWER and POWER not in self.functions:
                return self._power(node, inner)
            case _ if node.kind == WHERE:
                return self.choice.format(*texts), ATOM
        if node.kind in self.relations:
            return f"({texts[0]} {self.relations[node.kind]} {texts[1]})", ATOM
        if node.kind in self.logical:
            sign = self.logical[node.kind]
            return f"({sign}{texts[0]})" if node.kind == "not" else f"({texts[0]} {sign} {texts[1]})", ATOM
        return self._call(self.functions.get(node.kind, node.kind), texts), ATOM

    def _bound(self, inner: tuple[str, int], strength: int) -> str:
        return inner[0] if inner[1] >= strength else self.parentheses.format(inner[0])

    def _product(self, node: Node, left: str, right: str) -> str:
        return f"{left}{self._dot(*node.arguments)}*{right}"

    def _quotient(self, node: Node, inner: list[tuple[str, int]]) -> tuple[str, int]:
        return f"{self._bound(inner[0], TERM)}{self._dot(node.arguments[1])}/{self._bound(inner[1], BASE)}", TERM

    def _power(self, node: Node, inner: list[tuple[str, int]]) -> tuple[str, int]:
        return f"{self._bound(inner[0], ATOM)}{self._dot(node)}^{self._bound(inner[1], ATOM)}", BASE

    def _dot(self, *operands: Node) -> str:
        """The sign of an operation on each element of arrays; empty where one of the operands is a scalar."""
        return ""

    def _call(self, function: str, texts: list[str]) -> str:
        return f"{function}{self.parentheses.format(', '.join(texts))}"

    @abc.abstractmethod
    def number(self, value: float) -> str:
        """A number with all its digits."""


class C(Notation):
    """The C language, with math.h."""

    functions: ClassVar[Mapping[str, str]] = {"max": "fmax", "min": "fmin", "abs": "fabs", POWER: "pow"}
    choice = "({} ? {} : {})"

    def number(self, value: float) -> str:
        return repr(value)


class Matlab(Notation):
    """MATLAB and Octave; arguments may be arrays of one size."""

    relations: ClassVar[Mapping[str, str]] = {**_RELATIONS, "ne": "~="}
    logical: ClassVar[Mapping[str, str]] = {"and": "&", "or": "|", "not": "~"}
    choice = "({0}.*({1}) + (~{0}).*({2}))"

    def number(self, value: float) -> str:
        return "pi" if value == math.pi else repr(value).removesuffix(".0")

    def _dot(self, *operands: Node) -> str:
        return "." if all(self._arguments.intersection(in_order(each)) for each in operands) else ""


class Excel(Notation):
    """Excel and LibreOffice Calc, with English function names, decimal points and commas between arguments.

    Excel reads 15 significant digits of a number.
    """

    relations: ClassVar[Mapping[str, str]] = {**_RELATIONS, "eq": "=", "ne": "<>"}
    logical: ClassVar[Mapping[str, str]] = {}
    functions: ClassVar[Mapping[str, str]] = {"log": "ln", POWER: "power"}
    choice = "IF({},{},{})"

    def number(self, value: float) -> str:
        return "PI()" if value == math.pi else f"{value:.15G}"

    def _call(self, function: str, texts: list[str]) -> str:
        return f"{function.upper()}({','.join(texts)})"


_MULTIPLES_OF_PI = {math.pi: r"\pi", 2 * math.pi: r"2\,\pi", 4 * math.pi: r"4\,\pi"}
_LATEX_FUNCTIONS = {
    "log": r"\ln", "asin": r"\arcsin", "acos": r"\arccos", "atan": r"\arctan", "asinh": r"\operatorname{arsinh}",
    **{name: rf"\{name}" for name in ("exp", "sin", "cos", "tan", "sinh", "cosh", "tanh", "max", "min")},
}  # fmt: skip


class Latex(Notation):
    """LaTeX; numbers have `digits` significant digits, or all of them."""

    relations: ClassVar[Mapping[str, str]] = {"lt": "<", "le": r"\le", "eq": "=", "ne": r"\ne"}
    logical: ClassVar[Mapping[str, str]] = {"and": r"\land", "or": r"\lor", "not": r"\lnot "}
    functions: ClassVar[Mapping[str, str]] = _LATEX_FUNCTIONS
    parentheses = r"\left({}\right)"
    choice = r"\begin{{cases}} {1} & {0} \\ {2} & \text{{otherwise}} \end{{cases}}"

    def __init__(self, names: Mapping[Node, str], digits: int | None = None) -> None:
        super().__init__({node: latex_symbol(name) for node, name in names.items()})
        self._digits = digits

    def number(self, value: float) -> str:
        if value in _MULTIPLES_OF_PI:
            return _MULTIPLES_OF_PI[value]
        text = repr(value) if self._digits is None else f"{value:.{self._digits}g}"
        mantissa, _, exponent = text.removesuffix(".0").partition("e")
        if not exponent:
            return mantissa
        power = f"10^{{{int(exponent)}}}"
        mantissa = mantissa.removesuffix(".0")
        return power if mantissa == "1" else rf"{mantissa} \cdot {power}"

    def _write(self, node: Node, inner: list[tuple[str, int]]) -> tuple[str, int]:
        if node.kind == SYMBOL and node not in self._names:
            return latex_symbol(node.name), ATOM
        if node.kind == NUMBER and ("cdot" in self.number(node.number) or r"\," in self.number(node.number)):
            return self.number(node.number), TERM if node.number > 0 else SUM
        if node.kind == "sqrt":
            return rf"\sqrt{{{inner[0][0]}}}", ATOM
        if node.kind == "abs":
            return rf"\left|{inner[0][0]}\right|", ATOM
        return super()._write(node, inner)

    def _product(self, node: Node, left: str, right: str) -> str:
        return rf"{left} \cdot {right}" if right[:1].isdigit() or "cdot" in right else rf"{left}\,{right}"

    def _quotient(self, node: Node, inner: list[tuple[str, int]]) -> tuple[str, int]:
        return rf"\frac{{{inner[0][0]}}}{{{inner[1][0]}}}", BASE

    def _power(self, node: Node, inner: list[tuple[str, int]]) -> tuple[str, int]:
        if is_number(node.arguments[1], 0.5):
            return rf"\sqrt{{{inner[0][0]}}}", ATOM
        return f"{self._bound(inner[0], ATOM)}^{{{inner[1][0]}}}", BASE


def latex_symbol(name: str) -> str:
    """A name of an equation, such as eps_0 or a_21_inner, as LaTeX."""
    return symbol_formula(name).removeprefix(r"\(").removesuffix(r"\)")

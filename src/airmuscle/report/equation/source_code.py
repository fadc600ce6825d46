"""Source text of an equation for other programs, LaTeX, MATLAB, Excel and C, and the notations of
its expressions.
"""

import functools
import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, NamedTuple

from ...core import Node, Operation, nodes
from ..formulas import symbol_formula
from .derivation import LawEquation, Symbol, summands
from .reading import READABLE

SUM = 1
QUOTIENT = 2
PRODUCT = 3
BASE = 4
ATOM = 5
"""Binding strengths of a sum, a quotient, a product, a power and what needs no parentheses."""
_SIGNS = {
    Operation.LESS: "<",
    Operation.LESS_EQUAL: "<=",
    Operation.EQUAL: "==",
    Operation.NOT_EQUAL: "!=",
    Operation.AND: "&&",
    Operation.OR: "||",
}
_FUNCTIONS = {Operation.FMIN: "min", Operation.FMAX: "max"}


class WrittenPart(NamedTuple):
    """The text of a part of an expression."""

    text: str
    strength: int
    is_array: bool = False
    """Whether the part depends on an argument of the equation, which may be an array."""


class Notation:
    """Writer of the expressions of an equation; `names` are the texts of its symbols and parts."""

    signs: ClassVar[Mapping[Operation, str]] = _SIGNS
    """Signs of comparisons and logical operations; those without are calls of a function."""
    negation: ClassVar[str] = "!"
    functions: ClassVar[Mapping[Operation, str]] = {}
    """Names of functions that are not those of the operations; with POWER, a power is a call of a
    function.
    """
    parentheses: ClassVar[str] = "({})"
    choice: ClassVar[str]
    """Form of a choice, from the condition, the value where it holds, and the other value."""

    def __init__(self, names: Mapping[Node, str], arguments: Sequence[Node] = ()) -> None:
        self._pieces = {
            node: WrittenPart(
                text,
                SUM if text.startswith("-") else ATOM,
                any(nodes.occurring([node], arguments)),
            )
            for node, text in names.items()
        }
        self._writers = {
            operation: functools.partial(self._written, operation) for operation in READABLE
        }

    def text(self, root: Node, *, definition: bool = False) -> str:
        """The expression; with `definition`, that of a part itself and not its name."""
        known = {
            id(node): piece
            for node, piece in self._pieces.items()
            if node is not root or not definition
        }
        [written] = nodes.replayed([root], known, self._writers)
        return self._piece(written).text

    def _piece(self, value: Any) -> WrittenPart:
        """A number, which `replayed` hands over as it is, as text."""
        if isinstance(value, WrittenPart):
            return value
        text = self.number(value + 0.0)  # minus zero is zero
        return WrittenPart(text, SUM if text.startswith("-") else ATOM)

    def _written(self, operation: Operation, *operands: Any) -> WrittenPart:
        pieces = [self._piece(operand) for operand in operands]
        text, strength = self._operation(operation, *pieces)
        return WrittenPart(text, strength, any(piece.is_array for piece in pieces))

    def _operation(self, operation: Operation, *x: WrittenPart) -> tuple[str, int]:
        texts = [piece.text for piece in x]
        match operation:
            case Operation.ADD:
                return _sum_text(*texts), SUM
            case Operation.SUBTRACT:
                return f"{texts[0]} - {self._bound(x[1], QUOTIENT)}", SUM
            case Operation.NEGATE:
                return f"-{self._bound(x[0], QUOTIENT)}", SUM
            case Operation.MULTIPLY:
                return self._product(*x), PRODUCT
            case Operation.TWICE:
                return self._product(self._piece(2.0), *x), PRODUCT
            case Operation.DIVIDE:
                return self._quotient(*x)
            case Operation.INVERSE:
                return self._quotient(self._piece(1.0), *x)
            case Operation.POWER if operation not in self.functions:
                return self._power(*x)
            case Operation.SELECT:
                return self.choice.format(*texts), ATOM
            case Operation.NOT if self.negation:
                return f"({self.negation}{texts[0]})", ATOM
        sign = self.signs.get(operation)
        if sign is not None:
            return f"({texts[0]} {sign} {texts[1]})", ATOM
        name = self.functions.get(operation) or _FUNCTIONS.get(operation) or operation.name.lower()
        return self._call(name, texts), ATOM

    def _bound(self, piece: WrittenPart, strength: int) -> str:
        text = piece.text
        return text if piece.strength >= strength else self.parentheses.format(text)

    def _product(self, x: WrittenPart, y: WrittenPart) -> str:
        left = self._bound(x, QUOTIENT)
        return f"{left}{self._dot(x, y)}*{self._bound(y, PRODUCT)}"

    def _quotient(self, x: WrittenPart, y: WrittenPart) -> tuple[str, int]:
        return f"{self._bound(x, QUOTIENT)}{self._dot(y)}/{self._bound(y, BASE)}", QUOTIENT

    def _power(self, base: WrittenPart, exponent: WrittenPart) -> tuple[str, int]:
        dot = self._dot(base) or self._dot(exponent)
        return f"{self._bound(base, ATOM)}{dot}^{self._bound(exponent, ATOM)}", BASE

    def _dot(self, *operands: WrittenPart) -> str:
        """The sign of an operation on each element of arrays; empty where one of the operands is a
        scalar.
        """
        return ""

    def _call(self, function: str, texts: list[str]) -> str:
        return f"{function}{self.parentheses.format(', '.join(texts))}"

    def number(self, value: float) -> str:
        """A number with all its digits."""
        return repr(value)


def _sum_text(left: str, right: str) -> str:
    return f"{left} - {right[1:]}" if right.startswith("-") else f"{left} + {right}"


class C(Notation):
    """The C language, with math.h."""

    functions: ClassVar[Mapping[Operation, str]] = {
        Operation.FMAX: "fmax",
        Operation.FMIN: "fmin",
        Operation.ABS: "fabs",
        Operation.POWER: "pow",
    }
    choice = "({} ? {} : {})"


class Matlab(Notation):
    """MATLAB and Octave; arguments may be arrays of one size."""

    signs: ClassVar[Mapping[Operation, str]] = {
        **_SIGNS,
        Operation.NOT_EQUAL: "~=",
        Operation.AND: "&",
        Operation.OR: "|",
    }
    negation = "~"
    choice = "({0}.*({1}) + (~{0}).*({2}))"

    def number(self, value: float) -> str:
        return "pi" if value == math.pi else repr(value).removesuffix(".0")

    def _dot(self, *operands: WrittenPart) -> str:
        return "." if all(operand.is_array for operand in operands) else ""


class Excel(Notation):
    """Excel and LibreOffice Calc: English names, decimal points, commas between arguments, 15
    digits of a number.
    """

    signs: ClassVar[Mapping[Operation, str]] = {
        Operation.LESS: "<",
        Operation.LESS_EQUAL: "<=",
        Operation.EQUAL: "=",
        Operation.NOT_EQUAL: "<>",
    }
    negation = ""
    functions: ClassVar[Mapping[Operation, str]] = {
        Operation.LOG: "ln",
        Operation.POWER: "power",
    }
    choice = "IF({},{},{})"

    def number(self, value: float) -> str:
        return "PI()" if value == math.pi else f"{value:.15G}"

    def _call(self, function: str, texts: list[str]) -> str:
        return f"{function.upper()}({','.join(texts)})"


_MULTIPLES_OF_PI = {math.pi: r"\pi", 2 * math.pi: r"2\,\pi", 4 * math.pi: r"4\,\pi"}


class Latex(Notation):
    """LaTeX; numbers have `digits` significant digits, or all of them."""

    signs: ClassVar[Mapping[Operation, str]] = {
        Operation.LESS: "<",
        Operation.LESS_EQUAL: r"\le",
        Operation.EQUAL: "=",
        Operation.NOT_EQUAL: r"\ne",
        Operation.AND: r"\land",
        Operation.OR: r"\lor",
    }
    negation = r"\lnot "
    functions: ClassVar[Mapping[Operation, str]] = {
        Operation.LOG: "ln",
        Operation.ASIN: "arcsin",
        Operation.ACOS: "arccos",
        Operation.ATAN: "arctan",
        Operation.ASINH: "operatorname{arsinh}",
    }
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

    def _piece(self, value: Any) -> WrittenPart:
        piece = super()._piece(value)
        is_product = piece is not value and re.search(r"cdot|\\,", piece.text)
        return piece._replace(strength=min(piece.strength, PRODUCT)) if is_product else piece

    def _operation(self, operation: Operation, *x: WrittenPart) -> tuple[str, int]:
        match operation:
            case Operation.SQRT:
                return rf"\sqrt{{{x[0].text}}}", ATOM
            case Operation.ABS:
                return rf"\left|{x[0].text}\right|", ATOM
        return super()._operation(operation, *x)

    def _call(self, function: str, texts: list[str]) -> str:
        return rf"\{super()._call(function, texts)}"

    def _product(self, x: WrittenPart, y: WrittenPart) -> str:
        left = self._bound(x, QUOTIENT)
        right = self._bound(y, PRODUCT)
        is_number = right[:1].isdigit() or "cdot" in right
        return rf"{left} \cdot {right}" if is_number else rf"{left}\,{right}"

    def _quotient(self, x: WrittenPart, y: WrittenPart) -> tuple[str, int]:
        return rf"\frac{{{x.text}}}{{{y.text}}}", BASE

    def _power(self, base: WrittenPart, exponent: WrittenPart) -> tuple[str, int]:
        return f"{self._bound(base, ATOM)}^{{{exponent.text}}}", BASE


def latex_symbol(name: str) -> str:
    """A name of an equation, such as eps_0 or a_21_inner, as LaTeX."""
    return symbol_formula(name).removeprefix(r"\(").removesuffix(r"\)")


TERMS_PER_LINE = 6
"""Number of terms in a line of a displayed sum (chosen)."""
EXAMPLE = {"p": 3e5, "P": 3.0, "eps": 0.1, "F": 100.0}
"""Arguments in the first row of a worksheet (chosen)."""


def source_codes(equation: LawEquation, validity: str) -> dict[str, str]:
    """The equation by language; `validity` is a sentence on the range of its arguments."""
    return {
        "LaTeX": latex_source(equation, validity),
        "MATLAB": matlab_source(equation, validity),
        "Excel": excel_source(equation),
        "C": c_source(equation, validity),
    }


def displayed_lines(equation: LawEquation) -> list[str]:
    """The definitions of the parts and the equation, in LaTeX with four significant digits; long
    sums in lines.
    """
    rows = _latex_rows(equation, Latex(equation.names, digits=4))
    return [rf"\begin{{align*}} {row} \end{{align*}}" for row in rows]


def latex_source(equation: LawEquation, validity: str) -> str:
    """The equation and the values of its parameters in LaTeX (amsmath), with all digits."""
    notation = Latex(equation.names)
    lines = _latex_rows(equation, notation)
    for parameter in equation.parameters:
        unit = "" if parameter.unit == "1" else rf"\,\mathrm{{{parameter.unit.replace('^', '')}}}"
        lines.append(rf"{latex_symbol(parameter.name)} &= {notation.number(parameter.value)}{unit}")
    head = f"% {_signature(equation)}. {validity}\n\\begin{{align*}}\n"
    return head + " \\\\\n".join(lines) + "\n\\end{align*}"


def matlab_source(equation: LawEquation, validity: str) -> str:
    """The equation as a MATLAB function of arrays."""
    names = [symbol.name for symbol in equation.arguments]
    result = equation.result
    arguments = [node for node, name in equation.names.items() if name in names]
    notation = Matlab(equation.names, arguments)
    return "\n".join(
        [
            f"function {result.name} = muscle_{result.meaning.split()[-1]}({', '.join(names)})",
            f"% {_signature(equation)}. {validity}",
            *_definitions(equation, notation, "{} = {};", "  % [{}] {}"),
            f"{result.name} = {notation.text(equation.value)};",
            "end",
        ]
    )


def c_source(equation: LawEquation, validity: str) -> str:
    """The equation as a C function."""
    notation = C(equation.names)
    arguments = ", ".join(f"double {symbol.name}" for symbol in equation.arguments)
    return "\n".join(
        [
            "#include <math.h>",
            "",
            f"/* {_signature(equation)}. {validity} */",
            f"double muscle_{equation.result.meaning.split()[-1]}({arguments})",
            "{",
            *_definitions(equation, notation, "    const double {} = {};", " /* [{}] {} */"),
            f"    return {notation.text(equation.value)};",
            "}",
        ]
    )


def _definitions(
    equation: LawEquation, notation: Notation, assignment: str, remark: str
) -> list[str]:
    """The lines that give parameters and parts their values."""
    lines = []
    for parameter in equation.parameters:
        value = assignment.format(parameter.name, notation.number(parameter.value))
        lines.append(value + remark.format(parameter.unit, parameter.meaning))
    for part, node in equation.parts:
        lines.append(assignment.format(part.name, notation.text(node, definition=True)))
    return lines


def excel_source(equation: LawEquation) -> str:
    """The equation as two rows of a worksheet for cell A1, with tabulators: headers, then example
    and formulas.
    """
    cells = {symbol.name: f"{chr(ord('A') + i)}2" for i, symbol in enumerate(equation.arguments)}
    for part, _ in equation.parts:
        cells[part.name] = f"{chr(ord('A') + len(cells))}2"
    texts = Excel({}).number
    values = {parameter.name: texts(parameter.value) for parameter in equation.parameters}
    values |= cells
    notation = Excel({node: values[name] for node, name in equation.names.items()})
    headers = [
        _headed(symbol)
        for symbol in (*equation.arguments, *(part for part, _ in equation.parts), equation.result)
    ]
    formulas = [f"={notation.text(node, definition=True)}" for _, node in equation.parts]
    examples = [texts(EXAMPLE[symbol.name]) for symbol in equation.arguments]
    return (
        "\t".join(headers)
        + "\n"
        + "\t".join([*examples, *formulas, f"={notation.text(equation.value)}"])
    )


def _latex_rows(equation: LawEquation, notation: Latex) -> list[str]:
    """Definition of each part, and the equation; a sum of many terms in several lines."""
    rows = []
    for symbol, node in (*equation.parts, (equation.result, equation.value)):
        is_part = symbol is not equation.result
        terms = summands(node) if is_part or node not in equation.names else [node]
        lines = [notation.text(node, definition=is_part)]
        if len(terms) > TERMS_PER_LINE:
            first, *further = map(notation.text, terms)
            signed = [
                first,
                *(f"- {text[1:]}" if text.startswith("-") else f"+ {text}" for text in further),
            ]
            lines = [
                " ".join(signed[i : i + TERMS_PER_LINE])
                for i in range(0, len(signed), TERMS_PER_LINE)
            ]
        rows.append(f"{latex_symbol(symbol.name)} &= " + " \\\\\n&\\quad {} ".join(lines))
    return rows


def _signature(equation: LawEquation) -> str:
    result, *sources = (
        f"{symbol.meaning} {_headed(symbol)}" for symbol in (equation.result, *equation.arguments)
    )
    text = f"{result} from {' and '.join(sources)}"
    return text[0].upper() + text[1:]


def _headed(symbol: Symbol) -> str:
    return f"{symbol.name} [{symbol.unit}]" if symbol.unit else symbol.name


REMARKS = {
    "LaTeX": "requires amsmath",
    "MATLAB": "function of arrays, for MATLAB and Octave",
    "Excel": (
        "two rows to be pasted into cell A1; English function names, decimal point, 15 significant"
        " digits"
    ),
    "C": "function of doubles",
}
"""Remarks on each language."""

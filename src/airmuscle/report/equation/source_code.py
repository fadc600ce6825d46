"""Source text of an equation for other programs, LaTeX, MATLAB, Excel and C, and the notations of
its expressions.
"""

import math
from collections.abc import Collection, Mapping
from typing import ClassVar

from ..formulas import symbol_formula
from .derivation import LawEquation, Symbol
from .expression import POWER, Term, fold, in_order, is_number, summands

SUM = 1
TERM = 2
BASE = 3
ATOM = 4
"""Binding strengths of a sum, a product, a power and what needs no parentheses."""
_RELATIONS = {"lt": "<", "le": "<=", "eq": "==", "ne": "!="}


class Notation:
    """Writer of expressions. `names` are the texts of symbols and of parts that are defined
    elsewhere.
    """

    relations: ClassVar[Mapping[str, str]] = _RELATIONS
    logical: ClassVar[Mapping[str, str]] = {"and": "&&", "or": "||", "not": "!"}
    functions: ClassVar[Mapping[str, str]] = {}
    """Names of functions that differ from the kinds of their nodes; with `pow`, a power is a call
    of a function.
    """
    parentheses: ClassVar[str] = "({})"
    choice: ClassVar[str]
    """Form of a choice, from the condition, the value where it holds, and the other value."""

    def __init__(self, names: Mapping[Term, str], arguments: Collection[Term] = ()) -> None:
        self._names, self._arguments = names, set(arguments)

    def text(self, root: Term, *, definition: bool = False) -> str:
        """The expression; with `definition`, that of a part itself and not its name."""

        def write(node: Term, inner: list[tuple[str, int]]) -> tuple[str, int]:
            is_named = node in self._names and not (definition and node is root)
            return (self._names[node], ATOM) if is_named else self._write(node, inner)

        return fold(root, write)[0]

    def _write(self, node: Term, inner: list[tuple[str, int]]) -> tuple[str, int]:
        texts = [text for text, _ in inner]
        match node.kind:
            case "number":
                return self.number(node.value), ATOM if node.value >= 0 else SUM
            case "symbol":
                return self._names.get(node, node.name), ATOM
            case "add":
                return _sum_text(*texts), SUM
            case "neg":
                return f"-{self._bound(inner[0], TERM)}", SUM
            case "mul":
                strength = TERM if node.arguments[1].kind == "mul" else BASE
                left = self._bound(inner[0], TERM)
                right = self._bound(inner[1], strength)
                return self._product(node, left, right), TERM
            case "div":
                return self._quotient(node, inner)
            case "pow" if POWER not in self.functions:
                return self._power(node, inner)
            case "where":
                return self.choice.format(*texts), ATOM
        sign = self.relations.get(node.kind) or self.logical.get(node.kind)
        if sign is None:
            function = self.functions.get(node.kind, node.kind)
            return self._call(function, texts), ATOM
        if node.kind == "not":
            return f"({sign}{texts[0]})", ATOM
        return f"({texts[0]} {sign} {texts[1]})", ATOM

    def _bound(self, inner: tuple[str, int], strength: int) -> str:
        return inner[0] if inner[1] >= strength else self.parentheses.format(inner[0])

    def _product(self, node: Term, left: str, right: str) -> str:
        return f"{left}{self._dot(*node.arguments)}*{right}"

    def _quotient(self, node: Term, inner: list[tuple[str, int]]) -> tuple[str, int]:
        numerator = self._bound(inner[0], TERM)
        denominator = self._bound(inner[1], BASE)
        dot = self._dot(node.arguments[1])
        return f"{numerator}{dot}/{denominator}", TERM

    def _power(self, node: Term, inner: list[tuple[str, int]]) -> tuple[str, int]:
        base = self._bound(inner[0], ATOM)
        exponent = self._bound(inner[1], ATOM)
        return f"{base}{self._dot(node)}^{exponent}", BASE

    def _dot(self, *operands: Term) -> str:
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

    functions: ClassVar[Mapping[str, str]] = {
        "max": "fmax",
        "min": "fmin",
        "abs": "fabs",
        POWER: "pow",
    }
    choice = "({} ? {} : {})"


class Matlab(Notation):
    """MATLAB and Octave; arguments may be arrays of one size."""

    relations: ClassVar[Mapping[str, str]] = {**_RELATIONS, "ne": "~="}
    logical: ClassVar[Mapping[str, str]] = {"and": "&", "or": "|", "not": "~"}
    choice = "({0}.*({1}) + (~{0}).*({2}))"

    def number(self, value: float) -> str:
        return "pi" if value == math.pi else repr(value).removesuffix(".0")

    def _dot(self, *operands: Term) -> str:
        return (
            "."
            if all(self._arguments.intersection(in_order(operand)) for operand in operands)
            else ""
        )


class Excel(Notation):
    """Excel and LibreOffice Calc: English names, decimal points, commas between arguments, 15
    digits of a number.
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


class Latex(Notation):
    """LaTeX; numbers have `digits` significant digits, or all of them."""

    relations: ClassVar[Mapping[str, str]] = {"lt": "<", "le": r"\le", "eq": "=", "ne": r"\ne"}
    logical: ClassVar[Mapping[str, str]] = {"and": r"\land", "or": r"\lor", "not": r"\lnot "}
    functions: ClassVar[Mapping[str, str]] = {
        "log": r"\ln",
        "asin": r"\arcsin",
        "acos": r"\arccos",
        "atan": r"\arctan",
        "asinh": r"\operatorname{arsinh}",
        **{
            name: rf"\{name}"
            for name in ("exp", "sin", "cos", "tan", "sinh", "cosh", "tanh", "max", "min")
        },
    }
    parentheses = r"\left({}\right)"
    choice = r"\begin{{cases}} {1} & {0} \\ {2} & \text{{otherwise}} \end{{cases}}"

    def __init__(self, names: Mapping[Term, str], digits: int | None = None) -> None:
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

    def _write(self, node: Term, inner: list[tuple[str, int]]) -> tuple[str, int]:
        if node.kind == "symbol" and node not in self._names:
            return latex_symbol(node.name), ATOM
        if node.kind == "number":
            number = self.number(node.value)
            if "cdot" in number or r"\," in number:
                return number, TERM if node.value > 0 else SUM
        if node.kind in ("sqrt", "abs"):
            [(text, _)] = inner
            root = rf"\sqrt{{{text}}}"
            return root if node.kind == "sqrt" else rf"\left|{text}\right|", ATOM
        return super()._write(node, inner)

    def _product(self, node: Term, left: str, right: str) -> str:
        return (
            rf"{left} \cdot {right}"
            if right[:1].isdigit() or "cdot" in right
            else rf"{left}\,{right}"
        )

    def _quotient(self, node: Term, inner: list[tuple[str, int]]) -> tuple[str, int]:
        return rf"\frac{{{inner[0][0]}}}{{{inner[1][0]}}}", BASE

    def _power(self, node: Term, inner: list[tuple[str, int]]) -> tuple[str, int]:
        if is_number(node.arguments[1], 0.5):
            return rf"\sqrt{{{inner[0][0]}}}", ATOM
        return f"{self._bound(inner[0], ATOM)}^{{{inner[1][0]}}}", BASE


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
    rows = _latex_rows(equation, Latex(equation.part_nodes, digits=4))
    return [rf"\begin{{align*}} {row} \end{{align*}}" for row in rows]


def latex_source(equation: LawEquation, validity: str) -> str:
    """The equation and the values of its parameters in LaTeX (amsmath), with all digits."""
    notation = Latex(equation.part_nodes)
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
    notation = Matlab(
        equation.part_nodes, {node for node in _symbols(equation) if node.name in names}
    )
    return "\n".join(
        [
            f"function {result.name} = muscle_{result.meaning.split()[-1]}({', '.join(names)})",
            f"% {_signature(equation)}. {validity}",
            *(
                f"{parameter.name} = {notation.number(parameter.value)};"
                f"  % [{parameter.unit}] {parameter.meaning}"
                for parameter in equation.parameters
            ),
            *(
                f"{part.name} = {notation.text(node, definition=True)};"
                for part, node in equation.parts
            ),
            f"{result.name} = {notation.text(equation.value)};",
            "end",
        ]
    )


def c_source(equation: LawEquation, validity: str) -> str:
    """The equation as a C function."""
    notation = C(equation.part_nodes)
    arguments = ", ".join(f"double {symbol.name}" for symbol in equation.arguments)
    return "\n".join(
        [
            "#include <math.h>",
            "",
            f"/* {_signature(equation)}. {validity} */",
            f"double muscle_{equation.result.meaning.split()[-1]}({arguments})",
            "{",
            *(
                f"    const double {parameter.name} = {notation.number(parameter.value)};"
                f" /* [{parameter.unit}] {parameter.meaning} */"
                for parameter in equation.parameters
            ),
            *(
                f"    const double {part.name} = {notation.text(node, definition=True)};"
                for part, node in equation.parts
            ),
            f"    return {notation.text(equation.value)};",
            "}",
        ]
    )


def excel_source(equation: LawEquation) -> str:
    """The equation as two rows of a worksheet for cell A1, with tabulators: headers, then example
    and formulas.
    """
    cells = {symbol.name: f"{chr(ord('A') + i)}2" for i, symbol in enumerate(equation.arguments)}
    for part, _ in equation.parts:
        cells[part.name] = f"{chr(ord('A') + len(cells))}2"
    texts = Excel({}).number
    values = {parameter.name: texts(parameter.value) for parameter in equation.parameters}
    names: dict[Term, str] = {node: cells[part.name] for part, node in equation.parts}
    for node in _symbols(equation):
        text = cells.get(node.name) or values[node.name]
        names[node] = f"({text})" if text.startswith("-") else text
    notation = Excel(names)
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
        terms = summands(node) if is_part or node not in equation.part_nodes else [node]
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


def _symbols(equation: LawEquation) -> set[Term]:
    roots = [equation.value, *(node for _, node in equation.parts)]
    return {node for root in roots for node in in_order(root) if node.kind == "symbol"}


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

"""Source text of an equation for other programs: LaTeX, MATLAB, Excel and C."""

from .derivation import LawEquation, Symbol
from .expression import Node, in_order, summands
from .notation import C, Excel, Latex, Matlab, latex_symbol

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
    """The definitions of the parts and the equation, in LaTeX with four significant digits; long sums in lines."""
    return _latex_lines(equation, Latex(equation.part_nodes, digits=4))


def latex_source(equation: LawEquation, validity: str) -> str:
    """The equation and the values of its parameters in LaTeX (amsmath), with all digits."""
    lines = [line.removeprefix(r"\begin{align*} ").removesuffix(r" \end{align*}") for line in _latex_lines(
        equation, Latex(equation.part_nodes))]  # fmt: skip
    lines += [
        rf"{latex_symbol(each.name)} &= {_latex_number(each.value)}{_latex_unit(each.unit)}"
        for each in equation.parameters
    ]
    return "\n".join(
        [f"% {_signature(equation)}. {validity}", r"\begin{align*}", " \\\\\n".join(lines), r"\end{align*}"]
    )


def matlab_source(equation: LawEquation, validity: str) -> str:
    """The equation as a MATLAB function of arrays."""
    notation = Matlab(equation.part_nodes, _argument_nodes(equation))
    given = ", ".join(each.name for each in equation.arguments)
    return "\n".join(
        [
            f"function {_variable(equation)} = muscle_{_word(equation)}({given})",
            f"% {_signature(equation)}. {validity}",
            *(f"{each.name} = {notation.number(_value(each))};  % {_described(each)}" for each in equation.parameters),
            *(f"{part.name} = {notation.text(node, definition=True)};" for part, node in equation.parts),
            f"{_variable(equation)} = {notation.text(equation.value)};",
            "end",
        ]
    )


def c_source(equation: LawEquation, validity: str) -> str:
    """The equation as a C function."""
    notation = C(equation.part_nodes)
    arguments = ", ".join(f"double {each.name}" for each in equation.arguments)
    return "\n".join(
        [
            "#include <math.h>",
            "",
            f"/* {_signature(equation)}. {validity} */",
            f"double muscle_{_word(equation)}({arguments})",
            "{",
            *(
                f"    const double {each.name} = {notation.number(_value(each))}; /* {_described(each)} */"
                for each in equation.parameters
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
    """The equation as two rows of a worksheet, cells separated by tabulators: headers, then example and formulas.

    It is pasted into cell A1.
    """
    cells = {each.name: f"{chr(ord('A') + i)}2" for i, each in enumerate(equation.arguments)}
    for part, _ in equation.parts:
        cells[part.name] = f"{chr(ord('A') + len(cells))}2"
    texts = Excel({}).number
    values = {each.name: texts(_value(each)) for each in equation.parameters}
    names: dict[Node, str] = {node: cells[part.name] for part, node in equation.parts}
    for node in _symbols(equation):
        text = cells.get(node.name) or values[node.name]
        names[node] = f"({text})" if text.startswith("-") else text
    notation = Excel(names)
    headers = [_headed(each) for each in (*equation.arguments, *(part for part, _ in equation.parts), equation.result)]
    formulas = [f"={notation.text(node, definition=True)}" for _, node in equation.parts]
    examples = [texts(EXAMPLE[each.name]) for each in equation.arguments]
    return "\t".join(headers) + "\n" + "\t".join([*examples, *formulas, f"={notation.text(equation.value)}"])


def _latex_lines(equation: LawEquation, notation: Latex) -> list[str]:
    lines = [_latex_equation(latex_symbol(part.name), node, notation, definition=True) for part, node in equation.parts]
    return [*lines, _latex_equation(latex_symbol(equation.result.name), equation.value, notation)]


def _latex_equation(left: str, node: Node, notation: Latex, *, definition: bool = False) -> str:
    """`left = node`; a sum of many terms in several lines."""
    terms = summands(node) if definition or node not in notation.defined else [node]
    if len(terms) <= TERMS_PER_LINE:
        return rf"\begin{{align*}} {left} &= {notation.text(node, definition=definition)} \end{{align*}}"
    texts = [notation.text(term) for term in terms]
    signed = [
        text if i == 0 else f"- {text[1:]}" if text.startswith("-") else f"+ {text}" for i, text in enumerate(texts)
    ]
    rows = [" ".join(signed[i : i + TERMS_PER_LINE]) for i in range(0, len(signed), TERMS_PER_LINE)]
    return rf"\begin{{align*}} {left} &= " + " \\\\\n&\\quad {} ".join(rows) + r" \end{align*}"


def _symbols(equation: LawEquation) -> set[Node]:
    roots = [equation.value, *(node for _, node in equation.parts)]
    return {node for root in roots for node in in_order(root) if node.kind == "symbol"}


def _argument_nodes(equation: LawEquation) -> set[Node]:
    names = {each.name for each in equation.arguments}
    return {node for node in _symbols(equation) if node.name in names}


def _variable(equation: LawEquation) -> str:
    return equation.result.name


def _word(equation: LawEquation) -> str:
    return equation.result.meaning.split()[-1]


def _signature(equation: LawEquation) -> str:
    sources = " and ".join(_described_quantity(each) for each in equation.arguments)
    text = f"{_described_quantity(equation.result)} from {sources}"
    return text[0].upper() + text[1:]


def _described_quantity(symbol: Symbol) -> str:
    return f"{symbol.meaning} {_headed(symbol)}"


def _headed(symbol: Symbol) -> str:
    return f"{symbol.name} [{symbol.unit}]" if symbol.unit else symbol.name


def _described(symbol: Symbol) -> str:
    return f"[{symbol.unit}] {symbol.meaning}"


def _value(symbol: Symbol) -> float:
    assert symbol.value is not None
    return symbol.value


def _latex_number(value: float | None) -> str:
    assert value is not None
    return Latex({}).number(value)


def _latex_unit(unit: str) -> str:
    return "" if unit == "1" else rf"\,\mathrm{{{unit.replace('^', '')}}}"


REMARKS = {
    "LaTeX": "requires amsmath",
    "MATLAB": "function of arrays, for MATLAB and Octave",
    "Excel": "two rows to be pasted into cell A1; English function names, decimal point, 15 significant digits",
    "C": "function of doubles",
}
"""Remarks on each language."""

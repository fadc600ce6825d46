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
    notation = Latex(equation.part_nodes)
    lines = [line.removeprefix(r"\begin{align*} ").removesuffix(r" \end{align*}")
             for line in _latex_lines(equation, notation)]  # fmt: skip
    for each in equation.parameters:
        unit = "" if each.unit == "1" else rf"\,\mathrm{{{each.unit.replace('^', '')}}}"
        lines.append(rf"{latex_symbol(each.name)} &= {notation.number(each.value)}{unit}")
    head = f"% {_signature(equation)}. {validity}\n\\begin{{align*}}\n"
    return head + " \\\\\n".join(lines) + "\n\\end{align*}"


def matlab_source(equation: LawEquation, validity: str) -> str:
    """The equation as a MATLAB function of arrays."""
    names, result = [each.name for each in equation.arguments], equation.result.name
    notation = Matlab(equation.part_nodes, {node for node in _symbols(equation) if node.name in names})
    lines = [
        f"function {result} = muscle_{_word(equation)}({', '.join(names)})", f"% {_signature(equation)}. {validity}",
        *(f"{each.name} = {notation.number(each.value)};  % [{each.unit}] {each.meaning}"
          for each in equation.parameters),
        *(f"{part.name} = {notation.text(node, definition=True)};" for part, node in equation.parts),
        f"{result} = {notation.text(equation.value)};", "end",
    ]  # fmt: skip
    return "\n".join(lines)


def c_source(equation: LawEquation, validity: str) -> str:
    """The equation as a C function."""
    notation = C(equation.part_nodes)
    arguments = ", ".join(f"double {each.name}" for each in equation.arguments)
    lines = [
        "#include <math.h>", "", f"/* {_signature(equation)}. {validity} */",
        f"double muscle_{_word(equation)}({arguments})", "{",
        *(f"    const double {each.name} = {notation.number(each.value)}; /* [{each.unit}] {each.meaning} */"
          for each in equation.parameters),
        *(f"    const double {part.name} = {notation.text(node, definition=True)};" for part, node in equation.parts),
        f"    return {notation.text(equation.value)};", "}",
    ]  # fmt: skip
    return "\n".join(lines)


def excel_source(equation: LawEquation) -> str:
    """The equation as two rows of a worksheet, cells separated by tabulators: headers, then example and formulas.

    It is pasted into cell A1.
    """
    cells = {each.name: f"{chr(ord('A') + i)}2" for i, each in enumerate(equation.arguments)}
    for part, _ in equation.parts:
        cells[part.name] = f"{chr(ord('A') + len(cells))}2"
    texts = Excel({}).number
    values = {each.name: texts(each.value) for each in equation.parameters}
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
    first, *others = map(notation.text, terms)
    signed = [first, *(f"- {text[1:]}" if text.startswith("-") else f"+ {text}" for text in others)]
    rows = [" ".join(signed[i : i + TERMS_PER_LINE]) for i in range(0, len(signed), TERMS_PER_LINE)]
    return rf"\begin{{align*}} {left} &= " + " \\\\\n&\\quad {} ".join(rows) + r" \end{align*}"


def _symbols(equation: LawEquation) -> set[Node]:
    roots = [equation.value, *(node for _, node in equation.parts)]
    return {node for root in roots for node in in_order(root) if node.kind == "symbol"}


def _word(equation: LawEquation) -> str:
    return equation.result.meaning.split()[-1]


def _signature(equation: LawEquation) -> str:
    result, *sources = (f"{each.meaning} {_headed(each)}" for each in (equation.result, *equation.arguments))
    text = f"{result} from {' and '.join(sources)}"
    return text[0].upper() + text[1:]


def _headed(symbol: Symbol) -> str:
    return f"{symbol.name} [{symbol.unit}]" if symbol.unit else symbol.name


REMARKS = {
    "LaTeX": "requires amsmath",
    "MATLAB": "function of arrays, for MATLAB and Octave",
    "Excel": "two rows to be pasted into cell A1; English function names, decimal point, 15 significant digits",
    "C": "function of doubles",
}
"""Remarks on each language."""

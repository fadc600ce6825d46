r"""Formulas in texts, as MathML and as plain text.

A text of a chapter (claim, caption, table title, column header, cell) may contain formulas: LaTeX
between \( and \), such as \(k_\text{max}\). The page shows them as MathML, which browsers render
without scripts, a figure as Matplotlib mathtext; CSV and JSON files, the terminal and alternative
texts of figures contain the plain form, k_max.
"""

import functools
import html
import re
from typing import Literal
from xml.etree import ElementTree

_FORMULA_WITH_PUNCTUATION = re.compile(r"([(\[]*)\\\((.+?)\\\)([)\],.;:%]*)")
_NO_WRAP = '<span class="nowrap">{}</span>'
"""Browsers break lines between a formula and the punctuation next to it."""
_NAME = re.compile(r"(?P<base>[A-Za-z]+)(?:_(?P<index>[A-Za-z0-9]+(?:_[A-Za-z0-9]+)*))?")
_CODE = re.compile(r"`([^`<>]+)`")
_UNIT_SPACE = re.compile(r"(?<=\d) (?=%|(?:k?N|[kM]?Pa|[mc]?m|k?g|m?s|bar|K|rad|Hz)\b)")
_GREEK = {
    name: rf"\{name}"
    for name in (
        "alpha",
        "beta",
        "gamma",
        "delta",
        "zeta",
        "eta",
        "theta",
        "kappa",
        "lambda",
        "mu",
        "nu",
        "pi",
        "rho",
        "sigma",
        "tau",
        "phi",
        "psi",
        "omega",
        "Delta",
        "Gamma",
        "Omega",
        "Phi",
    )
} | {"eps": r"\varepsilon"}
_SYMBOL = re.compile(r"[\w^() '-]+")
"""Characters of a symbol; a label with others, `geometry.radius`, is a name and no formula."""
_INDICES = re.compile(r"[0-9ijk]+")
"""Subscripts that count; all others are abbreviations and set upright."""
_SPACED = "=+-<>≤≥≈≠"
"""Operators with a space on both sides in plain text."""


def to_mathml(text: str) -> str:
    r"""Return HTML: the text escaped, every formula \(...\) replaced by a MathML element."""
    result = ""
    end = 0
    for match in _FORMULA_WITH_PUNCTUATION.finditer(text):
        before, latex, after = match.groups()
        formula = _escape(before) + _mathml(latex) + _escape(after)
        result += _escape(text[end : match.start()]) + (
            _NO_WRAP.format(formula) if before or after else formula
        )
        end = match.end()
    return result + _escape(text[end:])


def _escape(text: str) -> str:
    """Return HTML with a no-break space between a number and its unit, and code between
    backticks.
    """
    escaped = _UNIT_SPACE.sub("\N{NO-BREAK SPACE}", html.escape(text))
    return _CODE.sub(r"<code>\1</code>", escaped)


def symbol_formula(symbol: str) -> str:
    r"""Return a declared symbol such as eps_0 as a formula, \(\varepsilon_{0}\), and any other
    label unchanged.
    """
    if not _SYMBOL.fullmatch(symbol):
        return symbol
    products = re.sub(r"(?<=\w) (?=\w)", r"\\,", symbol)
    return rf"\({_NAME.sub(_symbol_latex, products)}\)"


def _symbol_latex(match: re.Match[str]) -> str:
    base = match["base"]
    index = match["index"]
    latex = _GREEK.get(
        base, rf"\text{{{base}}}" if len(base) > 2 else base
    )  # words are set upright
    if base == "qm":  # mass flow, ISO 80000-4
        return r"q_\text{m}"
    if index is None:
        return latex
    parts = [part if _INDICES.fullmatch(part) else rf"\text{{{part}}}" for part in index.split("_")]
    return (
        f"{latex}_{parts[0]}"
        if len(parts) == 1 and parts[0] != index
        else f"{latex}_{{{', '.join(parts)}}}"
    )


def to_display_mathml(latex: str) -> str:
    """Return an equation in LaTeX as a MathML element on a line of its own."""
    return _mathml(latex, "block")


@functools.cache
def _mathml(latex: str, display: Literal["block", "inline"] = "inline") -> str:
    from latex2mathml.converter import convert  # needed by reports only

    return convert(latex, display=display).replace(
        "<mo>&#x0002F;</mo>", '<mo lspace="0" rspace="0">&#x0002F;</mo>'
    )


@functools.cache
def plain_formula(latex: str) -> str:
    """A formula in LaTeX as plain text."""
    return " ".join(_plain(ElementTree.fromstring(_mathml(latex))).split())


def _plain(element: ElementTree.Element) -> str:
    """Return a MathML element as text."""
    tag = element.tag.rpartition("}")[2]
    parts = [_plain(child) for child in element]
    if tag in ("msub", "munder"):
        return f"{parts[0]}_{parts[1]}"
    if tag in ("msup", "mover"):
        return f"{parts[0]}^{_grouped(parts[1])}"
    if tag in ("msubsup", "munderover"):
        return f"{parts[0]}_{parts[1]}^{_grouped(parts[2])}"
    if tag == "mfrac":
        return f"{_grouped(parts[0])}/{_grouped(parts[1])}"
    if tag == "msqrt":
        return f"sqrt({''.join(parts)})"
    if tag == "mspace":
        return " "
    if not parts:
        return (element.text or "").replace("\u2212", "-")
    # of a row; a sign at its beginning or after an operator has no space behind it
    text = ""
    after_operator = True
    for child, part in zip(element, parts, strict=True):
        operator = child.tag.endswith("}mo")
        text += f" {part} " if operator and part in _SPACED and not after_operator else part
        after_operator = operator and part not in (")", "|")
    return text


def _grouped(text: str) -> str:
    return f"({text})" if re.search(r"[ +\-/]", text) else text

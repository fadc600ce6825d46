r"""Formulas in report texts: LaTeX between \( and \), rendered as MathML, plain text or Matplotlib mathtext.

A text of a chapter (claim, caption, table title, column header, cell) may contain formulas such as
\(k_\text{max}\). The page shows them as MathML, which browsers render without scripts; CSV and JSON files, the
terminal and alternative texts of figures contain the plain form, k_max.
"""

import functools
import html
import re
from typing import Literal
from xml.etree import ElementTree

_FORMULA = re.compile(r"\\\((.+?)\\\)")
_FORMULA_WITH_PUNCTUATION = re.compile(r"([(\[]*)\\\((.+?)\\\)([)\],.;:%]*)")
_NO_WRAP = '<span class="nowrap">{}</span>'
"""Browsers break lines between a formula and the punctuation next to it."""
_NAME = re.compile(r"(?P<base>[A-Za-z]+)(?:_(?P<index>[A-Za-z0-9]+(?:_[A-Za-z0-9]+)*))?")
_UNIT_SPACE = re.compile(r"(?<=\d) (?=%|(?:k?N|[kM]?Pa|[mc]?m|k?g|m?s|bar|K|rad|Hz)\b)")
_GREEK = {
    name: rf"\{name}"
    for name in ("alpha", "beta", "gamma", "delta", "zeta", "eta", "theta", "kappa", "lambda", "mu", "nu", "pi", "rho",
                 "sigma", "tau", "phi", "psi", "omega", "Delta", "Gamma", "Omega", "Phi")
} | {"eps": r"\varepsilon"}  # fmt: skip
_SYMBOL = re.compile(r"[\w^() '-]+")
"""Characters of a symbol; a label with others, `geometry.radius`, is a name and no formula."""
_INDICES = re.compile(r"[0-9ijk]+")
"""Subscripts that count; all others are abbreviations and set upright."""
_SPACED = "=+-<>≤≥≈≠"
"""Operators with a space on both sides in plain text."""


def to_mathml(text: str) -> str:
    r"""Return HTML: the text escaped, every formula \(...\) replaced by a MathML element."""
    result, end = "", 0
    for match in _FORMULA_WITH_PUNCTUATION.finditer(text):
        before, latex, after = match.groups()
        formula = _escape(before) + _mathml(latex) + _escape(after)
        result += _escape(text[end : match.start()]) + (_NO_WRAP.format(formula) if before or after else formula)
        end = match.end()
    return result + _escape(text[end:])


def _escape(text: str) -> str:
    """Return HTML with a no-break space between a number and its unit."""
    return _UNIT_SPACE.sub("\N{NO-BREAK SPACE}", html.escape(text))


def to_plain(text: str) -> str:
    r"""Return the text with every formula \(...\) replaced by its plain form, for example k_max (1 - e^v)."""
    return _FORMULA.sub(lambda match: _plain_formula(match[1]), text)


def to_mathtext(text: str) -> str:
    r"""Return the text for a Matplotlib label: formulas between dollar signs."""
    return _FORMULA.sub(lambda match: f"${match[1]}$", text)


def symbol_formula(symbol: str) -> str:
    r"""Return a declared symbol such as eps_0 as a formula, \(\varepsilon_{0}\), and any other label unchanged."""
    if not _SYMBOL.fullmatch(symbol):
        return symbol
    products = re.sub(r"(?<=\w) (?=\w)", r"\\,", symbol)
    return rf"\({_NAME.sub(_symbol_latex, products)}\)"


def _symbol_latex(match: re.Match[str]) -> str:
    base, index = match["base"], match["index"]
    latex = _GREEK.get(base, rf"\text{{{base}}}" if len(base) > 2 else base)  # words are set upright
    if base == "qm":  # mass flow, ISO 80000-4
        return r"q_\text{m}"
    if index is None:
        return latex
    parts = [each if _INDICES.fullmatch(each) else rf"\text{{{each}}}" for each in index.split("_")]
    return f"{latex}_{parts[0]}" if len(parts) == 1 and parts[0] != index else f"{latex}_{{{', '.join(parts)}}}"


def to_display_mathml(latex: str) -> str:
    """Return an equation in LaTeX as a MathML element on a line of its own."""
    return _mathml(latex, "block")


@functools.cache
def _mathml(latex: str, display: Literal["block", "inline"] = "inline") -> str:
    from latex2mathml.converter import convert  # needed by reports only

    return convert(latex, display=display).replace("<mo>&#x0002F;</mo>", '<mo lspace="0" rspace="0">&#x0002F;</mo>')


@functools.cache
def _plain_formula(latex: str) -> str:
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
    return _join(list(element), parts) if parts else (element.text or "").replace("\u2212", "-")


def _join(elements: list[ElementTree.Element], parts: list[str]) -> str:
    """Join the parts of a row; a sign at its beginning or after another operator has no space behind it."""
    text, after_operator = "", True
    for element, part in zip(elements, parts, strict=True):
        operator = element.tag.endswith("}mo")
        text += f" {part} " if operator and part in _SPACED and not after_operator else part
        after_operator = operator and part not in (")", "|")
    return text


def _grouped(text: str) -> str:
    return f"({text})" if re.search(r"[ +\-/]", text) else text

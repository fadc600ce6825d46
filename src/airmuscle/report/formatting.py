r"""Formatting of numbers, units and formulas for the page and the terminal.

A text of a chapter (claim, caption, table title, column header, cell) may contain formulas: LaTeX
between \( and \), such as \(k_\text{max}\). The page shows them as MathML, which browsers render
without scripts, a figure as Matplotlib mathtext; CSV and JSON files, the terminal and alternative
texts of figures contain the plain form, k_max.
"""

import functools
import html
import math
import re
from numbers import Integral, Real
from typing import Any, Literal
from xml.etree import ElementTree

import numpy as np

DIGITS = 4
"""Significant digits of a number in a report."""
MISSING = "–"
P_VALUE = "p-value"
SMALLEST_P = 1e-3
"""Header of a column of p-values, and the value below which one is shown as a bound."""
_NUMBER = re.compile(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?")
_EXPONENT = re.compile(r"(?:\b1|(\d(?:\.\d+)?))e([-+]?)0*(\d+)\b")
_NUMBERS = re.compile(rf"{_NUMBER.pattern}((, | to ){_NUMBER.pattern})*")
_NEGATIVE_ZERO = re.compile(r"(?<![\w.])-(?=0(\.0*)?(?![\d.]))")
_POWER = re.compile(r"(?<=[A-Za-z])(?:\^?([23])|\^([ij]))(?![0-9A-Za-z])")
_SUPERSCRIPTS = str.maketrans("0123456789ij", "⁰¹²³⁴⁵⁶⁷⁸⁹ⁱʲ")


def format_number(value: Any, digits: int = DIGITS) -> str:
    """Return a number rounded to significant digits; integers and text unchanged, an en dash for
    None and NaN.

    Magnitudes from 1e-4 to 1e6 have no exponent, zero has no sign. A truth value is yes or no, a
    pair `1 to 2`.
    """
    if value is None:
        return MISSING
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    if isinstance(value, tuple):
        return " to ".join(dict.fromkeys(format_number(end, digits) for end in value))
    if isinstance(value, str) or not isinstance(value, Real):
        return str(value)
    if isinstance(value, Integral):
        return str(int(value))
    number = float(value)
    if not math.isfinite(number):
        return MISSING if math.isnan(number) else "∞" if number > 0 else "-∞"
    rounded = float(f"{number:.{digits - 1}e}") + 0.0  # the sum turns -0 into 0
    if rounded == 0.0 or 1e-4 <= abs(rounded) < 1e6:
        return np.format_float_positional(rounded, trim="-")
    return f"{rounded:.{digits}g}"


def format_cell(value: Any, digits: int = DIGITS) -> str:
    """Return a table cell: as `format_number` does, also numbers stored as text, in typographic
    form.
    """
    if isinstance(value, str) and not _NUMBERS.fullmatch(value):
        return value
    if is_number_text(value) and not value.lstrip("-+").isdigit():
        mantissa = value.partition("e")[0].lstrip("-+0.")
        if "e" in value or sum(map(str.isdigit, mantissa)) > DIGITS:
            value = float(value)
            digits = DIGITS
    return typographic(_NEGATIVE_ZERO.sub("", format_number(value, digits)))


def is_number_text(value: Any) -> bool:
    """Whether a cell is text that contains one number and nothing else."""
    return isinstance(value, str) and _NUMBER.fullmatch(value) is not None


def format_p_value(value: float | None) -> str:
    """Return a p-value to two significant digits, `< 0.001` if it is smaller; an en dash for None
    and NaN.
    """
    if value is not None and value < SMALLEST_P:
        return f"< {SMALLEST_P:g}"
    return format_number(value, 2)


def format_quantity(value: float, unit: str) -> str:
    """Return a value with its unit for prose: `2 × 10⁻⁵ m³`; the unit 1 is not shown."""
    return f"{typographic(format_number(value))} {format_unit(unit)}".rstrip()


def format_unit(unit: str) -> str:
    """Return a unit with superscripts, `m³/(s Pa)`; empty for the unit 1."""
    return (
        ""
        if unit == "1"
        else _POWER.sub(lambda match: (match[1] or match[2]).translate(_SUPERSCRIPTS), unit)
    )


def typographic(text: str) -> str:
    """Return a formatted number with a minus sign and a power of ten: `-2.5e-07` as `−2.5 ×
    10⁻⁷`.
    """

    def power(match: re.Match[str]) -> str:
        sign = "⁻" if match[2] == "-" else ""
        factor = f"{match[1]} × " if match[1] else ""
        return f"{factor}10{sign}{match[3].translate(_SUPERSCRIPTS)}"

    return re.sub(r"(?<![\w.)])-(?=[\d∞])", "−", _EXPONENT.sub(power, text))


# Formulas

_FORMULA = re.compile(r"\\\((.+?)\\\)")
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


def to_plain(text: str) -> str:
    r"""Return the text with every formula \(...\) replaced by its plain form, for example k_max (1
    - e^v).
    """
    return _FORMULA.sub(lambda match: _plain_formula(match[1]), text)


def to_mathtext(text: str) -> str:
    r"""Return the text for a Matplotlib label: formulas between dollar signs."""
    return _FORMULA.sub(lambda match: f"${match[1]}$", text)


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

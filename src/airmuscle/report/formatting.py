"""Formatting of numbers, units and texts with formulas for the page and the terminal."""

import math
import re
from numbers import Integral, Real
from typing import Any

import numpy as np

from .. import report

_FORMULA = re.compile(r"\\\((.+?)\\\)")
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


def to_plain(text: str) -> str:
    r"""Return the text with every formula \(...\) replaced by its plain form, for example k_max (1
    - e^v).
    """
    return _FORMULA.sub(lambda match: report.plain_formula(match[1]), text)


def to_mathtext(text: str) -> str:
    r"""Return the text for a Matplotlib label: formulas between dollar signs."""
    return _FORMULA.sub(lambda match: f"${match[1]}$", text)

"""Formatting of numbers, units and claims for the page and the terminal."""

import math
import re
from collections.abc import Iterable
from numbers import Integral, Real
from typing import Any

import numpy as np

from .chapter import DIGITS
from .claims import DEPENDS, DIFFERS, HOLDS, NOT_PRINTED, NOT_TESTABLE, Claim, Kind, Statement, statements

MARKS = {HOLDS: "✓", DIFFERS: "✗", DEPENDS: "±", NOT_TESTABLE: "?", NOT_PRINTED: "–"}
"""A sign next to each verdict, so that it does not depend on colour."""

MEANINGS = {
    HOLDS: "The reproduced value agrees with the expected one within the tolerance, in every reading.",
    DIFFERS: "The reproduced value does not agree with the expected one, in any reading.",
    DEPENDS: "It agrees in some readings of the paper and not in others.",
    NOT_TESTABLE: "Its measurements are lost, its condition is not printed, or every law fulfils it.",
    NOT_PRINTED: "The paper gives no value to compare with, or no value can be computed.",
}
"""Meaning of each verdict."""

MISSING = "–"
P_VALUE, SMALLEST_P = "p-value", 1e-3
"""Header of a column of p-values, and the value below which one is shown as a bound."""
_NUMBER = re.compile(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?")
_EXPONENT = re.compile(r"(?:\b1|(\d(?:\.\d+)?))e([-+]?)0*(\d+)\b")
_NUMBERS = re.compile(rf"{_NUMBER.pattern}((, | to ){_NUMBER.pattern})*")
_NEGATIVE_ZERO = re.compile(r"(?<![\w.])-(?=0(\.0*)?(?![\d.]))")
_POWER = re.compile(r"(?<=[A-Za-z])(?:\^?([23])|\^([ij]))(?![0-9A-Za-z])")
_SUPERSCRIPTS = str.maketrans("0123456789ij", "⁰¹²³⁴⁵⁶⁷⁸⁹ⁱʲ")


def format_number(value: Any, digits: int = DIGITS) -> str:
    """Return a number rounded to significant digits; integers and text unchanged, an en dash for None and NaN.

    Magnitudes from 1e-4 to 1e6 have no exponent, zero has no sign. A truth value is yes or no, a pair `1 to 2`.
    """
    if value is None:
        return MISSING
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    if isinstance(value, tuple):
        return " to ".join(dict.fromkeys(format_number(each, digits) for each in value))
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
    """Return a table cell: as `format_number` does, also numbers stored as text, in typographic form."""
    if isinstance(value, str) and not _NUMBERS.fullmatch(value):
        return value
    return typographic(_NEGATIVE_ZERO.sub("", _rounded(value, digits)))


def _rounded(value: Any, digits: int) -> str:
    if is_number_text(value) and not value.lstrip("-+").isdigit():
        mantissa = value.partition("e")[0].lstrip("-+0.")
        if "e" in value or sum(map(str.isdigit, mantissa)) > DIGITS:
            return format_number(float(value))
    return format_number(value, digits)


def is_number_text(value: Any) -> bool:
    """Whether a cell is text that contains one number and nothing else."""
    return isinstance(value, str) and _NUMBER.fullmatch(value) is not None


def format_p_value(value: float | None) -> str:
    """Return a p-value to two significant digits, `< 0.001` if it is smaller; an en dash for None and NaN."""
    if value is not None and value < SMALLEST_P:
        return f"< {SMALLEST_P:g}"
    return format_number(value, 2)


def format_quantity(value: float, unit: str) -> str:
    """Return a value with its unit for prose: `2 × 10⁻⁵ m³`; the unit 1 is not shown."""
    return f"{typographic(format_number(value))} {format_unit(unit)}".rstrip()


def format_unit(unit: str) -> str:
    """Return a unit with superscripts, `m³/(s Pa)`; empty for the unit 1."""
    return "" if unit == "1" else _POWER.sub(lambda match: (match[1] or match[2]).translate(_SUPERSCRIPTS), unit)


def typographic(text: str) -> str:
    """Return a formatted number with a minus sign and a power of ten: `-2.5e-07` as `−2.5 × 10⁻⁷`."""

    def power(match: re.Match[str]) -> str:
        sign = "⁻" if match[2] == "-" else ""
        factor = f"{match[1]} × " if match[1] else ""
        return f"{factor}10{sign}{match[3].translate(_SUPERSCRIPTS)}"

    return re.sub(r"(?<![\w.)])-(?=[\d∞])", "−", _EXPONENT.sub(power, text))


def format_published(claim: Claim, *, with_tolerance: bool = True) -> str:
    """Return the published value with its relation and tolerance: `≥ 4`, `20 ± 0.5`; an en dash if there is none."""
    if claim.printed is None:
        return MISSING
    tolerance = f" ± {format_number(claim.printed.tolerance)}" if claim.printed.tolerance and with_tolerance else ""
    origin = " (chosen)" if claim.printed.chosen else " (derived)" if claim.printed.derived else ""
    return f"{claim.printed.relation}{format_number(claim.printed.value)}{tolerance}{origin}"


def count_verdicts(claims: Iterable[Claim], kind: Kind = Kind.CLAIM) -> dict[str, int]:
    """Return the number of statements of one kind with each verdict; the cases of a statement count once."""
    verdicts = [statement.verdict for statement in statements(claims, kind)]
    return {verdict: verdicts.count(verdict) for verdict in MARKS}


def format_reproduced(statement: Statement, digits: int = DIGITS) -> str:
    """Return the reproduced value of a statement, or the range of its readings: `1.64 to 41.18`."""
    if not statement.reproduced:
        return MISSING
    low, high = (format_number(end(statement.reproduced), digits) for end in (min, max))
    return low if low == high else f"{low} to {high}"


def format_verdicts(count: int, verdict: str) -> str:
    """A number of statements or readings with their verdict: `1 holds`, `4 hold`."""
    plural = {HOLDS: "hold", DIFFERS: "differ", DEPENDS: "depend"}
    return f"{count} {verdict if count == 1 else plural.get(verdict, verdict)}"


def count_readings(statement: Statement) -> str:
    """The number of cases of a statement with each verdict: `7 readings: 4 hold, 3 differ`."""
    verdicts = [case.verdict for case in statement.cases]
    counts = {verdict: verdicts.count(verdict) for verdict in MARKS if verdict in verdicts}
    texts = [format_verdicts(n, verdict) for verdict, n in counts.items()]
    return f"{len(verdicts)} readings: {', '.join(texts)}"

"""Numbers that loggers write for a missing value."""

import math

CODES = (
    99.0,
    999.0,
    999.9,
    9999.0,
    9999.9,
    99999.0,
    999999.0,
    32767.0,
    32768.0,
    1e30,
    1e31,
    1e36,
    1e37,
    1e38,
)
"""Magnitudes that loggers write for a missing value (chosen: the usual ones)."""
MIN_CODE = 500.0
"""Minimum magnitude of a code that is recognised in another power of ten of the unit (chosen)."""


def code_of(value: float) -> float | None:
    """The code for a missing value that a number [SI] is, in some power of ten of its unit; None if
    it is none.
    """
    if value == 0.0 or not math.isfinite(value):
        return None
    ratios = ((code, abs(value) / code) for code in CODES if code > MIN_CODE)
    exact = (
        code for code, ratio in ratios if abs(math.log10(ratio) - round(math.log10(ratio))) < 1e-7
    )
    return math.copysign(code, value) if (code := next(exact, None)) is not None else None

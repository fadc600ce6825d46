"""Unit factors such as `bar` and `mm` (`6 * bar` is 600 000 Pa), and conversion of text with a unit ("300 mm") to SI.

`display("bar", "mm")` chooses the units of plots, tables and texts.

All internal values are SI. A pressure is gauge unless its unit states absolute, such as "bara" or "kPa(a)".
"""

from ..core.display import display
from ..core.units import (
    AMBIENT_PRESSURE,
    J,
    K,
    MPa,
    N,
    Pa,
    UnitConversion,
    W,
    bar,
    cm,
    conversion,
    degree,
    g,
    kg,
    km,
    kN,
    kPa,
    m,
    mbar,
    minute,
    mm,
    ms,
    percent,
    psi,
    quantity,
    rad,
    s,
)  # fmt: skip

__all__ = [
    "AMBIENT_PRESSURE", "J", "K", "MPa", "N", "Pa", "UnitConversion", "W", "bar", "cm", "conversion", "degree",
    "display", "g", "kN", "kPa", "kg", "km", "m", "mbar", "minute", "mm", "ms", "percent", "psi", "quantity", "rad",
    "s",
]  # fmt: skip

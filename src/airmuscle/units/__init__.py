"""Unit factors such as `bar` and `mm` (`6 * bar` is 600 000 Pa), and text with a unit, "300 mm", read into SI.

Everything inside is SI; a pressure is gauge unless its unit says absolute, "bara" or "kPa(a)".
"""

from ..core.units import (
    AMBIENT_PRESSURE,
    Conversion,
    J,
    K,
    MPa,
    N,
    Pa,
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
    "AMBIENT_PRESSURE", "Conversion", "J", "K", "MPa", "N", "Pa", "W", "bar", "cm", "conversion", "degree", "g", "kN",
    "kPa", "kg", "km", "m", "mbar", "minute", "mm", "ms", "percent", "psi", "quantity", "rad", "s",
]  # fmt: skip

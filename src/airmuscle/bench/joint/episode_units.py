"""Units of the angles, speeds and pressures of episodes, by their tables in a mapping file."""

QUESTION = "?"
"""Stands in a proposed mapping for a unit that its user must state."""
_DEGREE = 0.017453292519943295
UNITS = {
    "angles": {"rad": 1.0, "deg": _DEGREE},
    "speeds": {"rad": 1.0, "deg": _DEGREE, "rad/s": 1.0, "deg/s": _DEGREE, "rpm": 6.0 * _DEGREE},
    "pressures": {
        "Pa": 1.0,
        "hPa": 100.0,
        "kPa": 1e3,
        "MPa": 1e6,
        "bar": 1e5,
        "mbar": 100.0,
        "psi": 6894.757293168361,
    },
}
"""Units of gauge pressures, angles and their speeds, in SI units."""

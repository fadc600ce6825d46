"""Units at the border: everything inside is SI, pressure is gauge, contraction is a ratio.

`from airmuscle.units import bar, mm` gives factors, so that `6 * bar` is 600 000 Pa. Text such as `"300 mm"`,
`"psia"` or `"kPa(a)"` is read here; gauge or absolute is part of a pressure's unit, and a plain `bar` is gauge.
"""

from __future__ import annotations

import contextlib
import dataclasses
import difflib
import functools
import math
import re
from typing import Any

from .errors import UnitError

AMBIENT_PRESSURE = 101_325.0
"""Standard atmosphere [Pa], what an absolute pressure is reduced by unless an ambient pressure is given."""

ABSOLUTE = "Pa(a)"
"""The declared unit of a pressure that is absolute by its meaning: of the ambient air, say."""

m = N = Pa = s = kg = K = rad = J = W = 1.0
mm, cm, km = 1e-3, 1e-2, 1e3
kPa, MPa, bar, mbar, psi = 1e3, 1e6, 1e5, 1e2, 6894.757293168361
kN, g, ms, minute = 1e3, 1e-3, 1e-3, 60.0
percent, degree = 0.01, math.pi / 180.0

_FACTORS: dict[str, tuple[float, str]] = {
    "1": (1.0, "1"), "-": (1.0, "1"), "": (1.0, "1"), "%": (percent, "1"), "percent": (percent, "1"),
    "m": (m, "m"), "mm": (mm, "m"), "cm": (cm, "m"), "N": (N, "N"), "kN": (kN, "N"),
    "Pa": (Pa, "Pa"), "kPa": (kPa, "Pa"), "MPa": (MPa, "Pa"), "bar": (bar, "Pa"), "mbar": (mbar, "Pa"),
    "psi": (psi, "Pa"), "s": (s, "s"), "ms": (ms, "s"), "min": (minute, "s"), "kg": (kg, "kg"), "g": (g, "kg"),
    "K": (K, "K"), "rad": (rad, "rad"), "deg": (degree, "rad"), "°": (degree, "rad"), "degree": (degree, "rad"),
    "m3": (1.0, "m3"), "m^3": (1.0, "m3"), "m³": (1.0, "m3"), "kg/s": (1.0, "kg/s"), "m/s": (1.0, "m/s"),
    "N/m": (1.0, "N/m"), "N/mm": (1e3, "N/m"), "J": (J, "J"), "m3/(s Pa)": (1.0, "m3/(s Pa)"),
    "dm3/(s bar)": (1e-8, "m3/(s Pa)"), "m3/s": (1.0, "m3/s"), "l/min": (1e-3 / 60.0, "m3/s"),
    "cm3": (1e-6, "m3"), "cm^3": (1e-6, "m3"), "N/bar": (1e-5, "N/Pa"), "MPa/m": (1e6, "Pa/m"),
    "GPa/m^2": (1e9, "Pa/m^2"), "MPa/m^3": (1e6, "Pa/m^3"),
}  # fmt: skip
"""Units that occur often; a test holds them equal to pint's, whose registry costs a command 0.4 s."""

_GAUGE_OR_ABSOLUTE = re.compile(
    r"^(?P<unit>(?:Pa|hPa|kPa|MPa|bar|mbar|psi|atm|torr))\s*[_ ]?\(?\s*(?P<kind>g|a|gauge|abs|absolute)\s*\)?$",
    re.IGNORECASE,
)
_SPELLING = {"pa": "Pa", "hpa": "hPa", "kpa": "kPa", "mpa": "MPa"}


@dataclasses.dataclass(frozen=True)
class UnitConversion:
    """How a column or number in some unit becomes SI: `value * factor + offset`."""

    factor: float
    offset: float = 0.0
    assumed_gauge: bool = False

    def __call__(self, value: Any) -> Any:
        return value * self.factor + self.offset


@functools.cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()


def _to_pint_syntax(unit: str) -> str:
    """Our spelling of a unit in pint's grammar: `m3/(s Pa)` is `m**3/(s*Pa)`."""
    powers = re.sub(r"([A-Za-z])\^?(\d)", r"\1**\2", unit.replace("³", "3").replace("²", "2"))
    return re.sub(r"(?<=[\w)])\s+(?=[\w(])", "*", powers).replace("%", "percent").replace("°C", "degC")


_LARGE_EXPONENT = re.compile(r"(\*\*|\^)[\s\d()+-]*(\*\*|\^)|(\*\*|\^)\s*\(?\s*[-+]?\s*\d{2}")
"""Powers of powers and powers of ten or more: no unit has them, and working them out may never end."""


def _convert_with_pint(unit: str, target: str, where: str) -> UnitConversion:
    import pint

    try:
        if _LARGE_EXPONENT.search(unit):
            raise ValueError(unit)
        registry = _registry()
        zero, one = (registry.Quantity(v, _to_pint_syntax(unit)).to(_to_pint_syntax(target)).magnitude for v in (0.0, 1.0))
    except pint.DimensionalityError:
        raise UnitError(f"{where}unit '{unit}' cannot become {_describe_target(target)}: it measures something else.") from None
    except Exception:  # pint and tokenize raise many kinds on text that is no unit
        raise UnitError(
            f"{where}'{unit}' is no unit known here. Write it like 'mm', 'kPa', 'bara', 'N', '%' or 'm3/(s Pa)'."
        ) from None
    return UnitConversion(float(one - zero), float(zero))


def _describe_target(target: str) -> str:
    return "a ratio" if target in ("1", "dimensionless") else f"'{target}'"


def conversion(unit: str, target: str, *, ambient: float = AMBIENT_PRESSURE, where: str = "") -> UnitConversion:
    """How values in `unit` become `target` (an SI unit; pressures become gauge).

    `where` opens the message of the UnitError raised for a unit that is unknown or measures something else.
    """
    if target == ABSOLUTE:
        if (found := _GAUGE_OR_ABSOLUTE.match(unit.strip())) and found["kind"].lower().startswith("g"):
            raise UnitError(f"{where}: unit '{unit}' is gauge, but this pressure is absolute; write kPa(a) or bara.")
        return dataclasses.replace(conversion(unit, "Pa", ambient=0.0, where=where), assumed_gauge=False)
    unit, where = unit.strip(), f"{where}: " if where else ""
    if unit == target and target != "Pa":
        return UnitConversion(1.0)
    found = _GAUGE_OR_ABSOLUTE.match(unit)
    if found:
        if target != "Pa":
            raise UnitError(f"{where}unit '{unit}' is a pressure; a quantity in '{target}' was expected.")
        bare = _SPELLING.get(found["unit"].lower(), found["unit"].lower())
        absolute = found["kind"].lower().startswith("a")
        return UnitConversion(conversion(bare, "Pa").factor, -ambient if absolute else 0.0)
    if unit in _FACTORS and {_FACTORS[unit][1], target} == {"1", "rad"}:  # pint takes an angle for a ratio
        raise UnitError(f"{where}unit '{unit}' cannot become {_describe_target(target)}: it measures something else.")
    if unit in _FACTORS and _FACTORS[unit][1] == target:
        factor = _FACTORS[unit][0]
        return UnitConversion(factor, assumed_gauge=target == "Pa")
    found_by_pint = _convert_with_pint(unit or "dimensionless", "dimensionless" if target == "1" else target, where)
    return dataclasses.replace(found_by_pint, assumed_gauge=target == "Pa")


_NUMBER = re.compile(r"^\s*(?P<number>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(?P<unit>.*?)\s*$")


def quantity(value: float | str, target: str, *, ambient: float = AMBIENT_PRESSURE, where: str = "") -> float:
    """A number in SI from `0.3` (already in `target`) or from text with its unit, `"300 mm"`.

    Raises UnitError where the text holds no number, or its unit is unknown or of the wrong kind.
    """
    prefix = f"{where}: " if where else ""
    if isinstance(value, float | int) and not isinstance(value, bool):
        with contextlib.suppress(OverflowError):
            return float(value)
        raise UnitError(f"{prefix}the number is too large.")
    found = _NUMBER.match(value) if isinstance(value, str) else None
    if not isinstance(value, str) or not found:
        raise UnitError(f"{prefix}{value!r} is not a number with a unit; write it like '6 bar' or '300 mm'.")
    if re.match(r",\s*\d", found["unit"]):
        pointed = value.replace(",", ".", 1)
        raise UnitError(f"{prefix}'{value}' holds a comma; write the decimal sign as a point, '{pointed}'.")
    if not found["unit"] and target != "1":
        raise UnitError(f"{prefix}'{value}' carries no unit; write it like '{found['number']} {target}'.")
    number = float(found["number"])
    if not math.isfinite(number):
        raise UnitError(f"{prefix}'{value}' is too large for a number.")
    try:
        return float(conversion(found["unit"], target, ambient=ambient, where=where)(number))
    except UnitError as reason:
        raise UnitError(f"{reason}{_suggest_unit(found['unit'], target)}") from None


def _suggest_unit(unit: str, target: str) -> str:
    """A closing sentence: the unit of the right kind whose spelling is nearest, in whatever case."""
    pressures = ("bara", "barg", "psia", "psig") if target in ("Pa", ABSOLUTE) else ()
    kind = "Pa" if target == ABSOLUTE else target
    known = (*(name for name, (_, of) in _FACTORS.items() if of == kind and name), *pressures)
    cases = {name.lower(): name for name in known}
    near = difflib.get_close_matches(unit.lower(), cases, n=1)
    return f" Did you mean '{cases[near[0]]}'?" if near and cases[near[0]] != unit and unit not in _FACTORS else ""

"""Unit conversion of inputs to SI; pressure is gauge, contraction is a ratio.

`from airmuscle.units import bar, mm` imports unit factors, so that `6 * bar` is 600 000 Pa. Text
with a unit, such as `"300 mm"`, is parsed here. Gauge or absolute is part of the unit of a
pressure: `"psia"` and `"kPa(a)"` are absolute, a plain `"bar"` is gauge.
"""

import contextlib
import dataclasses
import difflib
import functools
import math
import re
from typing import Any

from .absolute_pressure import STANDARD_ATMOSPHERE, AbsolutePressure, ambient_of_texts
from .annotation import abridged
from .errors import UnitError

STANDARD_GRAVITY = 9.80665
"""Standard acceleration of gravity [m/s2] (ISO 80000-3)."""
AMBIENT_PRESSURE = STANDARD_ATMOSPHERE
"""Standard atmosphere [Pa], subtracted from an absolute pressure unless another ambient pressure is
given.
"""

ABSOLUTE = "Pa(a)"
"""Declared unit of a pressure that is absolute by definition, such as the ambient pressure."""

m = N = Pa = s = kg = K = rad = J = W = 1.0
mm = 1e-3
cm = 1e-2
km = 1e3
kPa = 1e3
MPa = 1e6
bar = 1e5
mbar = 1e2
psi = 6894.757293168361
kN = 1e3
g = 1e-3
ms = 1e-3
minute = 60.0
percent = 0.01
degree = math.pi / 180.0

_FACTORS: dict[str, tuple[float, str]] = {
    "1": (1.0, "1"),
    "-": (1.0, "1"),
    "": (1.0, "1"),
    "%": (percent, "1"),
    "percent": (percent, "1"),
    "m": (m, "m"),
    "mm": (mm, "m"),
    "cm": (cm, "m"),
    "N": (N, "N"),
    "kN": (kN, "N"),
    "Pa": (Pa, "Pa"),
    "kPa": (kPa, "Pa"),
    "MPa": (MPa, "Pa"),
    "bar": (bar, "Pa"),
    "mbar": (mbar, "Pa"),
    "psi": (psi, "Pa"),
    "s": (s, "s"),
    "ms": (ms, "s"),
    "min": (minute, "s"),
    "kg": (kg, "kg"),
    "g": (g, "kg"),
    "K": (K, "K"),
    "rad": (rad, "rad"),
    "deg": (degree, "rad"),
    "°": (degree, "rad"),
    "degree": (degree, "rad"),
    "m3": (1.0, "m3"),
    "m^3": (1.0, "m3"),
    "m³": (1.0, "m3"),
    "kg/s": (1.0, "kg/s"),
    "m/s": (1.0, "m/s"),
    "N/m": (1.0, "N/m"),
    "N/mm": (1e3, "N/m"),
    "J": (J, "J"),
    "m3/(s Pa)": (1.0, "m3/(s Pa)"),
    "dm3/(s bar)": (1e-8, "m3/(s Pa)"),
    "m3/s": (1.0, "m3/s"),
    "l/min": (1e-3 / 60.0, "m3/s"),
    "cm3": (1e-6, "m3"),
    "cm^3": (1e-6, "m3"),
    "N/bar": (1e-5, "N/Pa"),
    "MPa/m": (1e6, "Pa/m"),
    "GPa/m^2": (1e9, "Pa/m^2"),
    "MPa/m^3": (1e6, "Pa/m^3"),
    "mm/s": (1e-3, "m/s"),
    "deg/s": (degree, "rad/s"),
    "g/s": (1e-3, "kg/s"),
    "dm3": (1e-3, "m3"),
    "l": (1e-3, "m3"),
    "N m": (1.0, "N m"),
    "Nm": (1.0, "N m"),
    "rad/s": (1.0, "rad/s"),
    "m/s^2": (1.0, "m/s^2"),
    "mm/s^2": (1e-3, "m/s^2"),
    "rad/s^2": (1.0, "rad/s^2"),
    "N m/rad": (1.0, "N m/rad"),
}
"""Factors of common units, tested against pint, whose registry takes 0.4 s to load."""

_FULL_NAMES = {
    "newton": "N",
    "newtons": "N",
    "kilonewton": "kN",
    "pascal": "Pa",
    "kilopascal": "kPa",
    "megapascal": "MPa",
    "bars": "bar",
    "millibar": "mbar",
    "kilogram": "kg",
    "kilograms": "kg",
    "gram": "g",
    "grams": "g",
    "millimeter": "mm",
    "millimetre": "mm",
    "millimeters": "mm",
    "millimetres": "mm",
    "meter": "m",
    "metre": "m",
    "second": "s",
    "seconds": "s",
    "sec": "s",
    "degrees": "deg",
}
"""Units by their names in words, in lower case."""
_USUAL_UNITS: dict[str, tuple[tuple[float, str], ...]] = {
    "m": ((1.0, "m"), (math.inf, "mm")),
    "Pa": ((20.0, "bar"), (1e4, "kPa")),
    "s": ((10.0, "s"), (math.inf, "ms")),
    ABSOLUTE: ((20.0, "bara"), (1e4, "kPa(a)")),
    "m3": ((math.inf, "cm3"),),
    "rad": ((3.2, "rad"), (math.inf, "deg")),
    "kg": ((500.0, "kg"), (math.inf, "g")),
    "m3/(s Pa)": ((1e-5, "m3/(s Pa)"), (math.inf, "dm3/(s bar)")),
}
"""Units in which a number below a limit is usually written, by SI unit (chosen), for the examples
in messages.
"""
_EXAMPLES = {
    "m": "300 mm",
    "Pa": "6 bar",
    ABSOLUTE: "1 bara",
    "N": "200 N",
    "kg": "10 kg",
    "s": "2 s",
    "rad": "60 deg",
    "1": "12 %",
    "m3": "500 cm3",
    "m3/(s Pa)": "0.3 dm3/(s bar)",
    "N m": "5 N m",
    "K": "293 K",
}
"""Numbers with a unit that is usual for an SI unit (chosen), for the examples in messages."""
_MAX_CHARACTERS = 200
"""Maximum number of characters of a text with a unit (chosen)."""

_GAUGE_OR_ABSOLUTE = re.compile(
    r"^(?P<unit>(?:Pa|hPa|kPa|MPa|bar|mbar|psi|atm|torr))\s*[_"
    r" ]?\(?\s*(?P<kind>g|a|gauge|abs|absolute)\s*\)?$",
    re.IGNORECASE,
)
_SPELLING = {"pa": "Pa", "hpa": "hPa", "kpa": "kPa", "mpa": "MPa"}


def known_factor(unit: str, default: Any = math.nan) -> Any:
    """Factor of a common unit to SI, `default` if the unit is not among them."""
    return _FACTORS[unit][0] if unit in _FACTORS else default


def known_si_unit(unit: str) -> str:
    """SI unit of a common unit, empty if the unit is not among them."""
    return _FACTORS[unit][1] if unit in _FACTORS else ""


@dataclasses.dataclass(frozen=True)
class UnitConversion:
    """Conversion to SI: `value * factor + offset`.

    `assumed_gauge` is true for a pressure whose unit does not state gauge or absolute.
    """

    factor: float
    offset: float = 0.0
    assumed_gauge: bool = False

    def __call__(self, value: Any) -> Any:
        return value * self.factor + self.offset


@functools.cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()


_NAMES_OF_PINT = {"kp": "kgf", "rev": "turn", "Nm": "N m", "mNm": "mN m", "kNm": "kN m"}
"""Kilopond, revolution and newton metre in names of pint, to which Nm is the metre number, a unit
of yarns.
"""


def _to_pint_syntax(unit: str) -> str:
    """Return a unit in the syntax of pint, with its names: `m3/(s Pa)` becomes `m**3/(s*Pa)`."""
    unit = unit.replace("³", "3").replace("²", "2")
    for name, of_pint in _NAMES_OF_PINT.items():
        unit = re.sub(rf"\b{name}\b", of_pint, unit)
    powers = re.sub(r"([A-Za-z])\^?(\d)", r"\1**\2", unit)
    return (
        re.sub(r"(?<=[\w)])\s+(?=[\w(])", "*", powers).replace("%", "percent").replace("°C", "degC")
    )


_LARGE_EXPONENT = re.compile(r"(\*\*|\^)[\s\d()+-]*(\*\*|\^)|(\*\*|\^)\s*\(?\s*[-+]?\s*\d{2}")
"""Nested exponents and exponents of ten or more: no unit has them, and their evaluation may not
terminate.
"""


_UNCERTAIN_NAME = re.compile(
    r"(?<![A-Za-z_])(tons?|ton_force|force_ton|mt|cwt|hundredweight)(?![A-Za-z_])"
)
_REPLACEMENTS = {
    "mt": "t (1000 kg)",
    "hundredweight": "kg or lb",
    "cwt": "kg or lb",
    "force": "kN",
    "ton": "t (1000 kg), short_ton (907.2 kg) or long_ton (1016 kg)",
}
"""What to write in place of a name of several units; `mt` is a thousandth of a tonne to pint."""


def _convert_with_pint(unit: str, target: str, where: str) -> UnitConversion:
    """Return the conversion found by pint, with 2 pi between frequencies and angular speeds. Raises
    UnitError.
    """
    import pint

    if name := _UNCERTAIN_NAME.search(unit):
        instead = next(
            replacement for part, replacement in _REPLACEMENTS.items() if part in name[1]
        )
        raise UnitError(f"{where}'{name[1]}' is the name of several units; write {instead}.")
    try:
        if _LARGE_EXPONENT.search(unit):
            raise ValueError(unit)
        registry = _registry()
        source, destination = (
            registry.Quantity(1.0, _to_pint_syntax(text)) for text in (unit, target)
        )
        at_zero, at_one, at_two = (
            registry.Quantity(v, source.units).to(destination.units).magnitude
            for v in (0.0, 1.0, 2.0)
        )
    except pint.DimensionalityError:
        raise UnitError(
            f"{where}unit '{unit}' cannot be converted to {_describe_target(target)}: it measures"
            " another quantity."
        ) from None
    except Exception:  # pint and tokenize raise many exception types on text that is not a unit
        raise UnitError(
            f"{where}'{unit}' is not a known unit. Write it like 'mm', 'kPa', 'bara', 'N', '%' or"
            " 'm3/(s Pa)'."
        ) from None
    if not math.isclose(at_two - at_one, at_one - at_zero):
        raise UnitError(f"{where}unit '{unit}' is logarithmic; write {_describe_target(target)}.")
    return UnitConversion(
        float(at_one - at_zero)
        * _angle_factor(source.units, destination.units, unit, target, where),
        float(at_zero),
    )


def _angle_factor(source: Any, destination: Any, unit: str, target: str, where: str) -> float:
    """1 for units that count angles and bits alike, which are ratios to pint, and for a torque per
    angle without the angle, N m s; 2 pi between frequency and angular speed. Raises UnitError for
    an angle in place of a ratio.
    """
    counted = _counted(source)
    expected = _counted(destination)
    cycles = sum(power for name, power in source._units.items() if name.endswith("hertz"))
    if cycles == -1 and not counted and expected == {"radian": -1}:  # per cycle per second
        return 1.0 / (2.0 * math.pi)
    if counted == expected or (not counted and expected == {"radian": -1}):
        return 1.0
    if counted == {"radian": 1} and target == "Hz":
        return 1.0 / (2.0 * math.pi)
    if expected == {"radian": 1} and any(name.endswith("hertz") for name in source._units):
        return 2.0 * math.pi
    reason = "it measures another quantity." if counted else "it states no angle."
    frequency = " Write rad/s, deg/s, or a frequency in Hz or rpm." if target == "rad/s" else ""
    raise UnitError(
        f"{where}unit '{unit}' cannot be converted to {_describe_target(target)}:"
        f" {reason}{frequency}"
    )


def _counted(unit: Any) -> dict[str, float]:
    """Exponents of radian and bit in a unit."""
    exponents = _registry().get_base_units(unit)[1]._units
    return {name: exponents[name] for name in ("radian", "bit") if exponents.get(name)}


def _describe_target(target: str) -> str:
    """Return the target unit as it appears in a message."""
    return "a ratio" if target in ("1", "dimensionless") else f"'{target}'"


def conversion(
    unit: str, target: str, *, ambient: float = AMBIENT_PRESSURE, where: str = ""
) -> UnitConversion:
    """Return the conversion from `unit` to `target`, an SI unit; pressures become gauge pressures.

    `ambient` is the absolute ambient pressure [Pa] subtracted from absolute pressures; `where` is
    the prefix of error messages. Raises UnitError for a unit that is unknown or of another
    dimension.
    """
    _check_texts(unit, target, where)
    if target == ABSOLUTE:
        return _to_absolute(unit, where)
    unit = unit.strip()
    unit = _FULL_NAMES.get(unit.casefold(), unit)
    where = f"{where}: " if where else ""
    if unit == target and target != "Pa":
        return UnitConversion(1.0)
    match = _GAUGE_OR_ABSOLUTE.match(unit)
    if match:
        if target != "Pa":
            raise UnitError(
                f"{where}unit '{unit}' is a pressure; a quantity in '{target}' was expected."
            )
        name = match["unit"].lower()
        bare = _SPELLING.get(name, name)
        offset = -ambient if _is_absolute(unit) else 0.0
        return UnitConversion(conversion(bare, "Pa").factor, offset)
    if unit in _FACTORS and _FACTORS[unit][1] == target:
        factor = _FACTORS[unit][0]
        return UnitConversion(factor, assumed_gauge=target == "Pa")
    to_target = _convert_with_pint(
        unit or "dimensionless", "dimensionless" if target == "1" else target, where
    )
    return dataclasses.replace(to_target, assumed_gauge=target == "Pa")


def _check_texts(unit: Any, target: Any, where: Any) -> None:
    """Raise UnitError unless two units are texts of a length that a unit can have."""
    if not (isinstance(unit, str) and isinstance(target, str) and isinstance(where, str)):
        raise UnitError(
            f"a unit is a text, such as 'mm', 'kPa' or 'N'; given are {abridged(unit)} and"
            f" {abridged(target)}."
        )
    length = max(len(unit), len(target))
    if length > _MAX_CHARACTERS:
        raise UnitError(
            f"{where}{': ' if where else ''}a text of {length} characters is not a unit; at most"
            f" {_MAX_CHARACTERS} are allowed. Write it like 'mm', 'kPa' or 'N'."
        )


def _to_absolute(unit: str, where: str) -> UnitConversion:
    """The conversion to an absolute pressure, of a unit that is absolute or does not say."""
    match = _GAUGE_OR_ABSOLUTE.match(unit.strip())
    if match and match["kind"].lower().startswith("g"):
        raise UnitError(
            f"{where}: unit '{unit}' is gauge, but this pressure is absolute; write kPa(a) or bara."
        )
    to_gauge = conversion(unit, "Pa", ambient=0.0, where=where)
    return dataclasses.replace(to_gauge, assumed_gauge=False)


@functools.cache
def is_known_unit(unit: str) -> bool:
    """Whether texts can be converted to a unit; false for a declared unit such as 'u/y' or '1 or
    N'.
    """
    try:
        return unit in _FACTORS or unit == ABSOLUTE or bool(_convert_with_pint(unit, unit, ""))
    except UnitError:
        return False


def usual_unit(number: float, target: str) -> str:
    """The unit that was probably meant by a number without one: 'mm' for 200 where `target` is
    'm'.
    """
    candidates = _USUAL_UNITS.get(target, ())
    return next(
        (unit for limit, unit in candidates if abs(number) < limit),
        target.replace(ABSOLUTE, "Pa(a)"),
    )


def _example(target: str) -> str:
    """A number with a unit of the dimension of `target`, for messages."""
    return _EXAMPLES.get(target, f"1 {target}")


_NUMBER = re.compile(
    r"^\s*(?P<number>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(?P<unit>.*?)\s*$"
)


def quantity(
    value: float | str, target: str, *, ambient: float | None = None, where: str = ""
) -> float:
    """Return a number in SI from `0.3` (already in `target`) or from a text with a unit, `"300
    mm"`.

    `ambient` and `where` as for `conversion`; without `ambient` an absolute pressure is an
    AbsolutePressure by the ambient pressure of the plant whose file is read, else by the standard
    atmosphere. Raises UnitError if the text contains no number, or if its unit is unknown or of the
    wrong dimension.
    """
    if not (isinstance(target, str) and isinstance(where, str)) or len(target) > _MAX_CHARACTERS:
        raise UnitError(
            "the target of a quantity is a unit in SI, such as 'Pa' or 'm'; given is"
            f" {abridged(target)}."
        )
    prefix = f"{where}: " if where else ""
    if isinstance(value, float | int) and not isinstance(value, bool):
        with contextlib.suppress(OverflowError):
            return float(value)
        raise UnitError(f"{prefix}the number is too large.")
    number, unit = _number_and_unit(value, target, prefix)
    of_text = ambient_of_texts() if ambient is None else ambient
    try:
        to_target = conversion(unit, target, ambient=of_text, where=where)
        gauge = float(to_target(number))
    except UnitError as error:
        raise UnitError(f"{error}{_suggest_unit(unit, target)}") from None
    if ambient is None and target == "Pa" and _is_absolute(unit):
        return AbsolutePressure(gauge + of_text, of_text)
    return gauge


def _number_and_unit(text: object, target: str, prefix: str) -> tuple[float, str]:
    """The finite number and the unit of a text; UnitError for anything else."""
    if isinstance(text, str) and len(text) > _MAX_CHARACTERS:
        raise UnitError(
            f"{prefix}a text of {len(text)} characters is not a number with a unit; at most"
            f" {_MAX_CHARACTERS} are allowed. Write it like '{_example(target)}'."
        )
    match = _NUMBER.match(text) if isinstance(text, str) else None
    if not isinstance(text, str) or not match:
        raise UnitError(
            f"{prefix}{abridged(text)} is not a number with a unit; write it like"
            f" '{_example(target)}'."
        )
    number = float(match["number"])
    unit = match["unit"]
    if re.match(r",\s*\d", unit):
        corrected = text.replace(",", ".", 1)
        raise UnitError(f"{prefix}'{text}' contains a comma; write a decimal point, '{corrected}'.")
    if not unit and target != "1":
        usual = usual_unit(number, target)
        raise UnitError(f"{prefix}'{text}' has no unit; write it like '{match['number']} {usual}'.")
    if not math.isfinite(number):
        raise UnitError(f"{prefix}'{text}' is too large.")
    return number, unit


def _is_absolute(unit: str) -> bool:
    match = _GAUGE_OR_ABSOLUTE.match(unit.strip())
    return match is not None and match["kind"].lower().startswith("a")


def _suggest_unit(unit: str, target: str) -> str:
    """Return a sentence that suggests the closest unit of the right dimension, ignoring case, or an
    empty string.
    """
    pressures = ("bara", "barg", "psia", "psig") if target in ("Pa", ABSOLUTE) else ()
    si_unit = "Pa" if target == ABSOLUTE else target
    known = (
        *(name for name, (_, base) in _FACTORS.items() if base == si_unit and name),
        *pressures,
    )
    by_lower_case = {name.lower(): name for name in known}
    matches = difflib.get_close_matches(unit.lower(), by_lower_case, n=1)
    if not matches or unit in _FACTORS or by_lower_case[matches[0]] == unit:
        return ""
    return f" Did you mean '{by_lower_case[matches[0]]}'?"

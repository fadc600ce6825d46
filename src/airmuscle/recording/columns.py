"""Columns of a recording: headings with quantity and unit, SI and display units, displacements as
contractions.
"""

import dataclasses
import re
from collections.abc import Mapping, Sequence
from typing import Any

from .. import core
from ..core import Hint, HintedText, chosen_scale

MOVED = ("contraction", "length", "shortening", "position")
"""Columns of the motion of the muscle end; the first one of a recording is used."""
PROPOSALS = (
    "weg",
    "hub",
    "stroke",
    "travel",
    "extension",
    "displacement",
    "verschiebung",
    "traverse",
    "crosshead",
)
"""Beginnings of headings of displacements, whose zero and direction the heading does not state."""

_SHORTENING, _ELONGATION = (
    {"displacement": f"{name} [mm]"} for name in ("shortening", "elongation")
)
ZERO_NOT_STATED = HintedText(
    "A displacement has no stated zero and direction.",
    Hint(
        "If it is the shortening from the resting length", "columns", _SHORTENING, "ColumnMapping"
    ),
    Hint("If it is the elongation", "columns", _ELONGATION, "ColumnMapping"),
    Hint(
        "To state its reading at the resting length", "displacement_zero", "12 mm", "ColumnMapping"
    ),
)
"""Reason and remedies where a contraction is needed and only a displacement was recorded."""
_DISPLAY_UNITS = {
    "pressure": (1e-3, "kPa"),
    "contraction": (100.0, "%"),
    "volume": (1e6, "cm³"),
    "air_mass": (1e3, "g"),
    "mass_flow": (1e3, "g/s"),
    **dict.fromkeys(("length", "position", "shortening"), (1e3, "mm")),
}
"""Factor and unit of the quantities that are not displayed in SI units."""


@dataclasses.dataclass(frozen=True)
class Quantity:
    """A measurable quantity: SI unit, symbol and meaning."""

    unit: str
    symbol: str
    meaning: str


QUANTITIES: dict[str, Quantity] = {
    "time": Quantity("s", "t", "time"),
    "pressure": Quantity("Pa", "p", "gauge pressure in the muscle"),
    "contraction": Quantity(
        "1", "eps", "contraction (L0 - L)/L0; negative if the muscle is stretched"
    ),
    "force": Quantity("N", "F", "tensile force of the muscle, positive in tension"),
    "length": Quantity("m", "L", "muscle length between the end fittings"),
    "shortening": Quantity(
        "m", "x", "shortening from the resting length, L0 - L; positive as the muscle contracts"
    ),
    "elongation": Quantity(
        "m", "u", "elongation from the resting length, L - L0; read as a negative shortening"
    ),
    "position": Quantity("m", "y", "displacement of the load, positive as the muscle contracts"),
    "speed": Quantity("m/s", "v", "speed of the load, positive as the muscle contracts"),
    "acceleration": Quantity("m/s^2", "a", "acceleration of the load"),
    "angle": Quantity(
        "rad", "theta", "angle of a joint or lever, positive as its first muscle contracts"
    ),
    "angular_speed": Quantity("rad/s", "omega", "angular speed of the joint or lever"),
    "angular_acceleration": Quantity(
        "rad/s^2", "alpha", "angular acceleration of the joint or lever"
    ),
    "setpoint": Quantity("Pa", "p_set", "set gauge pressure of a regulator"),
    "volume": Quantity("m3", "V", "internal volume of the muscle"),
    "air_mass": Quantity("kg", "m_air", "mass of the air in the muscle"),
    "mass_flow": Quantity("kg/s", "qm", "mass flow into the muscle"),
    "fill": Quantity("1", "u_fill", "opening of the fill valve, from 0 (closed) to 1 (open)"),
    "discharge": Quantity(
        "1", "u_dis", "opening of the discharge valve, from 0 (closed) to 1 (open)"
    ),
    "latched": Quantity("1", "u_latch", "1 while the load is latched, 0 when released"),
    "branch": Quantity(
        "1", "b", "branch stated in the file, 1 inflating, 2 deflating; used for comparison only"
    ),
    "friction": Quantity("N", "F_f", "friction force of the muscle, opposing its motion"),
    "shortening_speed": Quantity("m/s", "v_m", "shortening speed of the contractile element"),
    "bristle": Quantity("m", "z", "deflection of a friction element (bristle)"),
    "stop": Quantity("m", "z_s", "deflection of a stop operator (Prandtl–Ishlinskii)"),
    "torque": Quantity(
        "N m", "Q", "torque of the muscles on a joint, positive in the direction of the angle"
    ),
    "stiffness": Quantity(
        "N m/rad", "K_p", "stiffness of a joint at constant pressure of its muscles"
    ),
    "shut_valves_stiffness": Quantity(
        "N m/rad", "K_m", "stiffness of a joint at constant air mass of its muscles"
    ),
    "cocontraction": Quantity(
        "N m", "Q_c", "part of the torques of two muscles that cancels at a joint"
    ),
    "temperature": Quantity("K", "T", "absolute temperature of the air in the muscle"),
}


def quantity_of(column: str) -> Quantity | None:
    """The quantity of a column: `left.pressure` is a pressure, `bristle2` a bristle; None if it is
    unknown.
    """
    return QUANTITIES.get(column.rpartition(".")[2].rstrip("0123456789"))


def display_scale(name: str) -> tuple[float, str]:
    """Factor and unit in which a column is displayed, chosen or usual; the unit is empty for an
    unknown quantity.

    Raises FileError or UnitError for an invalid configuration file.
    """
    quantity = quantity_of(name)
    if quantity is None:
        return 1.0, ""
    usual = _DISPLAY_UNITS.get(
        name.rpartition(".")[2], (1.0, "-" if quantity.unit == "1" else quantity.unit)
    )
    if quantity.unit == "1" and usual[1] != "%":  # an opening is not a contraction
        return usual
    factor, unit = chosen_scale(quantity.unit, *usual)
    return factor, "-" if unit == "1" else unit


def displayed(name: str, value: float, digits: int = 4) -> str:
    """A value [SI] of a column as text in the unit in which the column is displayed, such as "5.309
    kPa".
    """
    factor, unit = display_scale(name)
    return f"{value * factor:.{digits}g} {unit}".removesuffix(" -").rstrip()


def displacement_columns(
    columns: Mapping[str, Any], constants: Mapping[str, float | str]
) -> tuple[dict[str, Any], list[str]]:
    """The columns [SI] with a shortening x = L0 - L for a displacement, or its contraction x/L0;
    notes on each.

    columns    `shortening` x, or `elongation` u = -x; also `position` y = x if its zero is stated
    constants  displacement_zero: the reading [m] at the resting length, subtracted from each of
               them (default: 0); resting_length L0 [m]

    Without the resting length, the column is `shortening` [m]. A contraction or length in the
    columns is kept.
    """
    stated = constants.get("displacement_zero")
    zero = float(stated) if isinstance(stated, float | int) else None
    source = next((name for name in ("shortening", "elongation") if name in columns), "")
    if not source and zero is not None and "position" in columns:
        source = "position"
    if not source:
        return dict(columns), []
    sign = -1.0 if source == "elongation" else 1.0
    shortening = sign * (columns[source] - (zero or 0.0))
    remaining = {
        name: values for name, values in columns.items() if name not in ("shortening", "elongation")
    }
    origin = (
        "the resting length"
        if zero is None
        else f"the reading at the resting length, {1e3 * zero:.4g} mm"
    )
    length = constants.get("resting_length")
    if "contraction" in remaining or "length" in remaining or not isinstance(length, float | int):
        return {**remaining, "shortening": shortening}, [f"The {source} counts from {origin}."]
    note = (
        f"The {source} counts from {origin}, and is converted to a contraction with the resting"
        " length."
    )
    return {**remaining, "contraction": shortening / length}, [note]


def proposal(heading: str) -> str:
    """A sentence that proposes quantities for a heading such as `Weg` or `stroke`; empty for
    others.
    """
    if not heading.lower().startswith(PROPOSALS):
        return ""
    return (
        " If it is the displacement of the muscle, map it to 'shortening [mm]' (from the resting"
        " length, positive as the muscle contracts) or to 'elongation [mm]'."
    )


def column_units(system: "core.System", outputs: Sequence[str]) -> dict[str, str]:
    """The unit of every state, input and output; empty where none is known."""
    units = {name: getattr(quantity_of(name), "unit", "") for name in outputs}
    units |= {i.name: i.unit for i in system.input_variables}
    return {**units, **system.output_units, **{s.name: s.unit for s in system.states}}


# Only these single letters are case-sensitive.
_CASE_SENSITIVE = {"t": "time", "T": "temperature", "v": "speed", "V": "volume"}
_SYNONYMS = {
    "p": "pressure",
    "druck": "pressure",
    "gauge_pressure": "pressure",
    "f": "force",
    "load": "force",
    "tension": "force",
    "kraft": "force",
    "weight": "force",
    "k": "contraction",
    "eps": "contraction",
    "epsilon": "contraction",
    "ε": "contraction",
    "kontraktion": "contraction",
    "l": "length",
    "länge": "length",
    "laenge": "length",
    "y": "position",
    "displacement": "position",
    "velocity": "speed",
    "a": "acceleration",
    "zeit": "time",
    **dict.fromkeys(("timestamp", "time_stamp", "stamp", "epoch", "unix_time"), "time"),
    "temperatur": "temperature",
    "volumen": "volume",
    "verkürzung": "shortening",
    "verkuerzung": "shortening",
    "verlängerung": "elongation",
    "verlaengerung": "elongation",
    **{
        quantity.symbol.lower(): name
        for name, quantity in QUANTITIES.items()
        if len(quantity.symbol) > 1
    },
    **{name: name for name in QUANTITIES},
}

UNIT_SPELLINGS: dict[str, tuple[str, ...]] = {
    "Pa": (
        "Pa",
        "kPa",
        "MPa",
        "bar",
        "mbar",
        "psi",
        "bara",
        "barg",
        "kPa(a)",
        "kPa(g)",
        "kPaa",
        "kPag",
        "psia",
        "psig",
        "bar(a)",
        "bar(g)",
        "Pa(a)",
        "Pa(g)",
    ),
    "m": ("m", "mm", "cm"),
    "1": ("1", "%", "-"),
    "N": ("N", "kN"),
    "s": ("s", "ms", "min"),
    "m/s": ("m/s", "mm/s"),
    "m/s^2": ("m/s^2", "m/s2"),
    "m3": ("m3", "cm3"),
    "kg": ("kg", "g"),
    "kg/s": ("kg/s", "g/s"),
    "K": ("K", "°C"),
    "rad": ("rad", "deg"),
    "rad/s": ("rad/s", "deg/s"),
    "rad/s^2": ("rad/s^2", "deg/s^2"),
    "N m": ("N m", "N*m", "N mm"),
    "N m/rad": ("N m/rad", "N m/deg"),
}
"""Usual spellings of the units of each quantity, used in suggestions and to recognise a suffix as
in `pressure_kPa`.
"""

_FURTHER_SUFFIXES: dict[str, tuple[str, ...]] = {
    "Pa": ("hPa", "torr", "atm", "mmHg", "inHg"),
    "m": ("um", "µm", "in", "inch", "ft", "km"),
    "1": ("percent",),
    "N": ("mN", "MN", "lbf", "kgf", "gf", "kp", "kg", "g", "lb"),
    "s": ("us", "µs", "ns", "h"),
    "m/s": ("cm/s", "in/s", "km/h"),
    "m/s^2": ("mm/s^2", "mm/s2"),
    "m3": ("l", "ml", "dm3", "mm3", "m^3", "cm^3"),
    "kg": ("mg", "lb"),
    "kg/s": ("g/min", "kg/h"),
    "K": ("degC", "degF"),
    "rad": ("degree", "degrees", "°", "mrad"),
    "rad/s": ("rpm", "mrad/s"),
    "N m": ("Nm", "mNm", "kNm"),
}
"""Further units of each quantity that are recognised as a suffix, as in `force_lbf`."""

_MARKED_FORMS = (
    re.compile(r"(?P<name>.*?)\s*\[(?P<unit>.*)\]"),
    re.compile(r"(?P<name>.*?)\s*\((?P<unit>.*)\)"),
    re.compile(r"(?P<name>.+?)\s*/\s*(?P<unit>.+)"),
)
MAX_HEADING = 1000
"""Number of characters of a heading above which it states no quantity and no unit (chosen)."""
_INDEX = re.compile(r":?\s*,?\s*\d+(?<!^1)")
"""A number of a sensor or a column of a matrix, `force (2)` or `y(:,1)`, which is no unit."""
_SUFFIX_FORM = re.compile(r"(?P<name>.+)[_\s](?P<unit>\S+)")


@dataclasses.dataclass(frozen=True)
class Heading:
    """A parsed heading. `name` is the name of a known quantity, or the whole text if the quantity
    is unknown.
    """

    text: str
    name: str
    unit: str | None
    known: bool
    evidence: str = ""
    """Evidence for the quantity where the name is not that of a quantity: words inside it."""

    @property
    def target(self) -> str | None:
        """The SI unit of the quantity; None if the quantity is unknown."""
        return QUANTITIES[self.name.rpartition(".")[2]].unit if self.known else None


def find_quantity_name(text: str) -> str | None:
    """The quantity of a name or synonym in upper or lower case (`left.p` gives `left.pressure`);
    None if unknown.
    """
    prefix, dot, last = text.strip().rpartition(".")
    if prefix and last.lower() == "y":
        return None  # the component of a vector, such as imu.acceleration.y, not a position
    name = _CASE_SENSITIVE.get(last) or _SYNONYMS.get(re.sub(r"[\s-]+", "_", last.strip()).lower())
    return prefix + dot + name if name else None


def parse_heading(text: str) -> Heading:
    """Parse a heading: `pressure [kPa]`, `pressure (kPa)`, `pressure_kPa`, `Pressure / kPa` or
    `p`.
    """
    text = text.strip()
    for form in (*_MARKED_FORMS, _SUFFIX_FORM) if len(text) <= MAX_HEADING else ():
        match = form.fullmatch(text)
        if match and _INDEX.fullmatch(match["unit"]):
            continue
        name = find_quantity_name(match["name"]) if match else None
        if match and name:
            target = QUANTITIES[name.rpartition(".")[2]].unit
            usual = form is not _SUFFIX_FORM or match["unit"] in known_suffixes(target)
            if usual:  # after a blank or underscore
                return Heading(text, name, match["unit"].strip(), True)
    name_only = find_quantity_name(text)
    return Heading(text, name_only or text, None, name_only is not None)


def known_suffixes(target: str) -> tuple[str, ...]:
    """The units of a quantity with this SI unit that are recognised behind a blank or an
    underscore.
    """
    return (*UNIT_SPELLINGS[target], *_FURTHER_SUFFIXES.get(target, ()))


def split_unit(text: str) -> tuple[str, str | None]:
    """Name and unit of a heading with an unknown quantity, such as `height [mm]`; the unit is None
    if not stated.
    """
    forms = _MARKED_FORMS if len(text) <= MAX_HEADING else ()
    match = next((match for form in forms if (match := form.fullmatch(text.strip()))), None)
    return (match["name"].strip(), match["unit"].strip()) if match else (text.strip(), None)

"""Column headings: quantity and unit."""

import dataclasses
import re
from collections.abc import Iterator

from .columns import QUANTITIES

# Only these single letters are case-sensitive.
_CASE_SENSITIVE = {"t": "time", "T": "temperature", "v": "speed", "V": "volume"}
_SYNONYMS = {
    "p": "pressure", "druck": "pressure", "gauge_pressure": "pressure",
    "f": "force", "load": "force", "tension": "force", "kraft": "force", "weight": "force",
    "k": "contraction", "eps": "contraction", "epsilon": "contraction", "ε": "contraction",
    "kontraktion": "contraction", "l": "length", "länge": "length", "y": "position",
    "displacement": "position", "velocity": "speed", "a": "acceleration", "zeit": "time",
    "temperatur": "temperature", "volumen": "volume",
    "verkürzung": "shortening", "verlängerung": "elongation",
    **{quantity.symbol.lower(): name for name, quantity in QUANTITIES.items() if len(quantity.symbol) > 1},
    **{name: name for name in QUANTITIES},
}  # fmt: skip

UNIT_SPELLINGS: dict[str, tuple[str, ...]] = {
    "Pa": (
        "Pa", "kPa", "MPa", "bar", "mbar", "psi", "bara", "barg", "kPa(a)", "kPa(g)", "kPaa", "kPag", "psia", "psig",
        "bar(a)", "bar(g)", "Pa(a)", "Pa(g)",
    ),
    "m": ("m", "mm", "cm"), "1": ("1", "%", "-"), "N": ("N", "kN"), "s": ("s", "ms", "min"), "m/s": ("m/s", "mm/s"),
    "m/s^2": ("m/s^2", "m/s2"), "m3": ("m3", "cm3"), "kg": ("kg", "g"), "kg/s": ("kg/s", "g/s"), "K": ("K", "°C"),
    "rad": ("rad", "deg"), "rad/s": ("rad/s", "deg/s"), "rad/s^2": ("rad/s^2", "deg/s^2"),
    "N m": ("N m", "N*m", "N mm"), "N m/rad": ("N m/rad", "N m/deg"),
}  # fmt: skip
"""Usual spellings of the units of each quantity, used in suggestions and to recognise a suffix as in `pressure_kPa`."""

_MARKED_FORMS = tuple(
    re.compile(pattern)
    for pattern in (
        r"(?P<name>.*?)\s*\[(?P<unit>.*)\]",
        r"(?P<name>.*?)\s*\((?P<unit>.*)\)",
        r"(?P<name>.+?)\s*/\s*(?P<unit>.+)",
    )
)
MAX_HEADING = 1000
"""Number of characters of a heading above which it states no quantity and no unit (chosen)."""
_SUFFIX_FORM = re.compile(r"(?P<name>.+)[_\s](?P<unit>\S+)")


@dataclasses.dataclass(frozen=True)
class Heading:
    """A parsed heading. `name` is the name of a known quantity, or the whole text if the quantity is unknown."""

    text: str
    name: str
    unit: str | None
    known: bool

    @property
    def target(self) -> str | None:
        """The SI unit of the quantity; None if the quantity is unknown."""
        return QUANTITIES[self.name.rpartition(".")[2]].unit if self.known else None


def find_quantity_name(text: str) -> str | None:
    """The quantity of a name or synonym in upper or lower case (`left.p` gives `left.pressure`); None if unknown."""
    prefix, dot, last = text.strip().rpartition(".")
    if prefix and last.lower() == "y":
        return None  # the component of a vector, such as imu.acceleration.y, not a position
    name = _CASE_SENSITIVE.get(last) or _SYNONYMS.get(re.sub(r"[\s-]+", "_", last.strip()).lower())
    return prefix + dot + name if name else None


def parse_heading(text: str) -> Heading:
    """Parse a heading: `pressure [kPa]`, `pressure (kPa)`, `pressure_kPa`, `Pressure / kPa` or `p`."""
    text = text.strip()
    for name, unit in _candidate_splits(text):
        return Heading(text, name, unit.strip(), True)
    name_only = find_quantity_name(text)
    return Heading(text, name_only or text, None, name_only is not None)


def _candidate_splits(text: str) -> Iterator[tuple[str, str]]:
    """Quantity and unit of a heading that states both; after a blank or underscore only a usual unit is accepted."""
    if len(text) > MAX_HEADING:
        return
    for form in _MARKED_FORMS:
        match = form.fullmatch(text)
        name = find_quantity_name(match["name"]) if match else None
        if match and name:
            yield name, match["unit"]
    match = _SUFFIX_FORM.fullmatch(text)
    name = find_quantity_name(match["name"]) if match else None
    if match and name and match["unit"] in UNIT_SPELLINGS[QUANTITIES[name.rpartition(".")[2]].unit]:
        yield name, match["unit"]


def split_unit(text: str) -> tuple[str, str | None]:
    """Name and unit of a heading with an unknown quantity, such as `height [mm]`; the unit is None if not stated."""
    forms = _MARKED_FORMS if len(text) <= MAX_HEADING else ()
    match = next((match for form in forms if (match := form.fullmatch(text.strip()))), None)
    return (match["name"].strip(), match["unit"].strip()) if match else (text.strip(), None)

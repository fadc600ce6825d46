"""What the heading of a column says: which quantity it is, and in which unit it was written."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator

from .columns import QUANTITIES

# Letters that mean something else in the other case are told apart; every other name is not.
_CASE_SENSITIVE = {"t": "time", "T": "temperature", "v": "speed", "V": "volume"}
_SYNONYMS = {
    "p": "pressure", "druck": "pressure", "gauge_pressure": "pressure",
    "f": "force", "load": "force", "tension": "force", "kraft": "force", "weight": "force",
    "k": "contraction", "eps": "contraction", "epsilon": "contraction", "ε": "contraction",
    "kontraktion": "contraction", "l": "length", "länge": "length", "y": "position",
    "displacement": "position", "velocity": "speed", "a": "acceleration", "zeit": "time",
    "temperatur": "temperature", "volumen": "volume",
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
}  # fmt: skip
"""How units of each kind are usually written: what messages suggest, and what counts in `pressure_kPa`."""

_MARKED_FORMS = tuple(
    re.compile(pattern)
    for pattern in (
        r"(?P<name>.*?)\s*\[(?P<unit>.*)\]",
        r"(?P<name>.*?)\s*\((?P<unit>.*)\)",
        r"(?P<name>.+?)\s*/\s*(?P<unit>.+)",
    )
)
_SUFFIX_FORM = re.compile(r"(?P<name>.+)[_\s](?P<unit>\S+)")


@dataclasses.dataclass(frozen=True)
class Heading:
    """A heading taken apart. `name` is a quantity's, or the whole text where no quantity is known by it."""

    text: str
    name: str
    unit: str | None
    known: bool

    @property
    def target(self) -> str | None:
        """The SI unit of the quantity; None where it is not known."""
        return QUANTITIES[self.name.rpartition(".")[2]].unit if self.known else None


def find_quantity_name(text: str) -> str | None:
    """The quantity meant by a name or a synonym in any case; `left.p` is `left.pressure`."""
    prefix, dot, last = text.strip().rpartition(".")
    found = _CASE_SENSITIVE.get(last) or _SYNONYMS.get(re.sub(r"[\s-]+", "_", last.strip()).lower())
    return prefix + dot + found if found else None


def parse_heading(text: str) -> Heading:
    """`pressure [kPa]`, `pressure (kPa)`, `pressure_kPa`, `Pressure / kPa` and `p` say that it is the pressure."""
    text = text.strip()
    for name, unit in _candidate_splits(text):
        return Heading(text, name, unit.strip(), True)
    known = find_quantity_name(text)
    return Heading(text, known or text, None, known is not None)


def _candidate_splits(text: str) -> Iterator[tuple[str, str]]:
    """Quantity and unit, where a heading holds both; after a mere blank or _ it must be a usual unit."""
    for form in _MARKED_FORMS:
        found = form.fullmatch(text)
        name = find_quantity_name(found["name"]) if found else None
        if found and name:
            yield name, found["unit"]
    found = _SUFFIX_FORM.fullmatch(text)
    name = find_quantity_name(found["name"]) if found else None
    if found and name and found["unit"] in UNIT_SPELLINGS[QUANTITIES[name.rpartition(".")[2]].unit]:
        yield name, found["unit"]


def split_unit(text: str) -> tuple[str, str | None]:
    """Name and unit of a heading whose quantity is not known, `height [mm]`; no unit where it states none."""
    found = next((found for form in _MARKED_FORMS if (found := form.fullmatch(text.strip()))), None)
    return (found["name"].strip(), found["unit"].strip()) if found else (text.strip(), None)

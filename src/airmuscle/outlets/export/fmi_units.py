"""Units of FMI: SI units as powers of the base units of the standard."""

from __future__ import annotations

import re
from collections.abc import Iterable
from xml.etree.ElementTree import Element, SubElement

BASE: dict[str, dict[str, int]] = {
    "m": {"m": 1}, "s": {"s": 1}, "kg": {"kg": 1}, "K": {"K": 1}, "rad": {"rad": 1}, "N": {"kg": 1, "m": 1, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2}, "J": {"kg": 1, "m": 2, "s": -2}, "W": {"kg": 1, "m": 2, "s": -3},
    "Hz": {"s": -1},
}  # fmt: skip
"""Powers of the base units in the units of which the units of columns and parameters consist."""
_ATOM = re.compile(r"([A-Za-z]+)(?:\^?(-?\d+))?$")


def base_powers(unit: str) -> dict[str, int] | None:
    """The powers of the base units in a unit such as `m3/(s Pa)`; None where they are not known."""
    numerator, *denominators = unit.replace("Pa(a)", "Pa").split("/")
    powers: dict[str, int] = {}
    for part, sign in ((numerator, 1), *((text.strip("()"), -1) for text in denominators)):
        for word in part.replace("*", " ").split():
            atom = _ATOM.match(word)
            if word == "1":
                continue
            if atom is None or atom[1] not in BASE:
                return None
            for base, power in BASE[atom[1]].items():
                powers[base] = powers.get(base, 0) + sign * power * int(atom[2] or 1)
    if "" in denominators:
        return None
    return {base: power for base, power in powers.items() if power}


def add_units(parent: Element, units: Iterable[str]) -> None:
    """The element UnitDefinitions with these units, each once."""
    names = sorted({unit for unit in units if has_unit(unit)})
    if not names:
        return
    definitions = SubElement(parent, "UnitDefinitions")
    for name in names:
        element, powers = SubElement(definitions, "Unit", name=name), base_powers(name)
        if powers is not None:
            SubElement(element, "BaseUnit", {base: str(power) for base, power in powers.items()})


def has_unit(unit: str) -> bool:
    """Whether a quantity has a unit in an FMU; a ratio has none."""
    return unit not in ("", "1")

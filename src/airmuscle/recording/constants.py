"""What does not change in a run: stated by the user, by a comment of the file, or by a column of one value."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..core.arrays import Array
from ..core.errors import ColumnError
from ..core.units import conversion, quantity
from .table import RawTable

CONSTANT_UNITS = {"resting_length": "m", "ambient": "Pa"}
"""The SI unit of the constants that have one."""
_NAMES = {
    "resting_length": ("resting_length", "rest_length", "initial_length", "original_length", "l0", "l_0", "ruhelänge"),
    "ambient": ("ambient", "ambient_pressure", "atmospheric_pressure", "barometer"),
}
_WITH_UNIT = re.compile(
    r"(?P<name>.*?)[\s_]*"
    r"(?:\[(?P<square>[^\]]*)\]|\((?P<round>[^)]*)\)|[\s_/](?P<loose>mm|cm|m|kPa|hPa|mbar|bar|Pa))"
)


def parse_constant_name(text: str) -> tuple[str, str] | None:
    """The constant that a heading names, and its unit or ''; None where it names none."""
    found = _WITH_UNIT.fullmatch(text.strip())
    name, unit = (found["name"], found["square"] or found["round"] or found["loose"] or "") if found else (text, "")
    for constant, names in _NAMES.items():
        if re.sub(r"[\s-]+", "_", name.strip()).lower() in names:
            return constant, unit
    return None


def collect_constants(table: RawTable, given: Mapping[str, float | str]) -> dict[str, Any]:
    """The constants of a run in SI: the file's comments, then what the user gives."""
    found: dict[str, Any] = {}
    for text, value in {**table.constants, **given}.items():
        named = parse_constant_name(text)
        if named and named[1] and not isinstance(value, str):
            value = f"{value!r} {named[1]}"
        found[named[0] if named else text] = value
    for name, unit in CONSTANT_UNITS.items():
        if name in found:
            found[name] = quantity(found[name], unit, ambient=0.0, where=f"{table.origin}: {name}")
            if not found[name] > 0:
                raise ColumnError(f"{table.origin}: {name} is {found[name]:g} {unit}; it must be greater than zero.")
    return found


def constant_from_column(table: RawTable, heading: str, unit: str | None, values: Array) -> tuple[str, float] | None:
    """The constant that a column states by holding it in every row; None where the heading names none.

    Raises ColumnError where the column changes: then it is no constant of one run.
    """
    named = parse_constant_name(heading)
    if named is None:
        return None
    name, own_unit = named
    change = conversion(
        unit or own_unit or CONSTANT_UNITS[name], CONSTANT_UNITS[name], ambient=0.0, where=f"{table.origin}: {heading}"
    )
    first = float(values[0])
    if not np.allclose(values, first, rtol=1e-9, atol=0.0):
        row = int(np.argmax(~np.isclose(values, first, rtol=1e-9, atol=0.0)))
        raise ColumnError(
            f"{table.location(row)}: {heading} changes from {first:g} to {values[row]:g}, but it is one number of a run. "
            "Put the specimens into a file each."
        )
    return name, float(change(first))

"""Constants of a run, by the user, a comment or a column with one value, and division of a table by
its specimens.
"""

import contextlib
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ....core import Array, ColumnError, UnitError, conversion, quantity
from ....core.units import AMBIENT_PRESSURE, STANDARD_GRAVITY, UnitConversion
from ....recording.columns import UNIT_SPELLINGS, Heading
from .channels import Cells, RawTable

SPECIMEN = "specimen"
"""Heading of the column that names the specimen of each row."""
MAX_SPECIMENS = 100
"""Maximum number of specimens of a file (chosen); one with more values, such as row numbers, names
none.
"""


def split_specimens(table: RawTable) -> tuple[RawTable, ...]:
    """The tables of the specimens that the column `specimen` names, each with the constant
    `specimen`; the table itself without such a column, or if it has more than `MAX_SPECIMENS`
    values."""
    names = [heading.strip().lower() for heading in table.headings]
    if names.count(SPECIMEN) != 1:
        return (table,)
    column = names.index(SPECIMEN)
    labels = label_texts(table.columns[column])
    values = list(dict.fromkeys(labels.tolist()))
    if not 0 < len(values) <= MAX_SPECIMENS:
        return (table,)
    remaining = table.of_columns([i for i in range(len(names)) if i != column])
    origins = [
        table.origin if len(values) == 1 else f"{table.origin}, specimen {value}"
        for value in values
    ]
    return tuple(
        remaining.of_rows(
            np.flatnonzero(labels == value),
            origin=origin,
            constants={**table.constants, SPECIMEN: value},
        )
        for value, origin in zip(values, origins, strict=True)
    )


def label_texts(cells: Cells) -> npt.NDArray[np.str_]:
    """The cells of a column as texts (N,); whole numbers without decimals."""
    return np.array(
        [cell.strip() if isinstance(cell, str) else f"{cell:g}" for cell in cells], dtype=str
    )


_TABLE = {
    "resting_length": (
        "m",
        "length",
        (1e-3, 20.0),
        "rest_length initial_length original_length l0 l_0 ruhelänge",
    ),
    "ambient": (
        "Pa",
        "pressure",
        (1e3, 2e5),
        "ambient_pressure atmospheric_pressure barometer umgebungsdruck luftdruck",
    ),
    "ambient_temperature": (
        "K",
        "temperature",
        (200.0, 400.0),
        "room_temperature umgebungstemperatur raumtemperatur",
    ),
    "displacement_zero": ("m", "length", (-20.0, 20.0), ""),
}
"""Of the constants that have a unit: SI unit, quantity, which has its display units, allowed range
[SI], that of the parameters of a geometry and of the ambient air, and other names."""
CONSTANT_UNITS = {name: unit for name, (unit, *_) in _TABLE.items()}
"""SI units of these constants."""
CONSTANT_QUANTITIES = {name: kind for name, (_, kind, *_) in _TABLE.items()}
"""Quantities of these constants."""
_WITH_UNIT = re.compile(
    r"(?P<name>.*?)[\s_]*"
    r"(?:\[(?P<square>[^\]]*)\]|\((?P<round>[^)]*)\)|[\s_/](?P<loose>mm|cm|m|kPa|hPa|mbar|bar|Pa))"
)


def parse_constant_name(text: str) -> tuple[str, str] | None:
    """Name and unit ('' if not stated) of the constant in a heading; None if it names no
    constant.
    """
    match = _WITH_UNIT.fullmatch(text.strip())
    name, unit = (
        (match["name"], match["square"] or match["round"] or match["loose"] or "")
        if match
        else (text, "")
    )
    word = re.sub(r"[\s-]+", "_", name.strip()).lower()
    return next(
        ((key, unit) for key, (*_, synonyms) in _TABLE.items() if word in (key, *synonyms.split())),
        None,
    )


def collect_constants(origin: str, stated: Mapping[str, float | str]) -> dict[str, Any]:
    """The constants of a run in SI units; `origin` begins the messages. Raises UnitError."""
    constants: dict[str, Any] = {}
    for text, value in stated.items():
        parsed = parse_constant_name(text)
        if parsed and parsed[1] and not isinstance(value, str):
            value = f"{value!r} {parsed[1]}"
        constants[parsed[0] if parsed else text] = value
    for name, unit in CONSTANT_UNITS.items():
        if name in constants:
            constants[name] = quantity(
                constants[name], unit, ambient=0.0, where=f"{origin}: {name}"
            )
    return constants


def check_constants(origin: str, constants: Mapping[str, Any]) -> None:
    """Raise ColumnError for a constant that is not positive, or outside its allowed range."""
    for name, (unit, _, (low, high), _) in _TABLE.items():
        value = constants.get(name, low)
        if low > 0 and not value > 0:
            raise ColumnError(f"{origin}: {name} is {value:g} {unit}; it must be positive.")
        if not low <= value <= high:
            raise ColumnError(
                f"{origin}: {name} is {value:g} {unit}; allowed range: {low:g} to {high:g} {unit}."
                " Check the unit; a number without a unit is in SI units."
            )


def file_conversion(
    unit: str, target: str, *, ambient: float = AMBIENT_PRESSURE, where: str = ""
) -> UnitConversion:
    """The conversion of a unit in a file to SI; a load in g or kg becomes a force with standard
    gravity. Raises UnitError."""
    if target == "N" and is_mass(unit):
        return UnitConversion(conversion(unit, "kg").factor * STANDARD_GRAVITY)
    return conversion(unit, target, ambient=ambient, where=where)


def is_mass(unit: str) -> bool:
    """Whether a unit of a load is one of mass."""
    with contextlib.suppress(UnitError):
        return unit not in UNIT_SPELLINGS["N"] and bool(conversion(unit, "kg"))
    return False


def held_value(heading: Heading, stated: float | str, ambient: float, where: str) -> float:
    """The value of a held quantity in SI; a force may be stated as a load in g or kg, as in a
    column.
    """
    target = heading.target or "1"
    value = f"{stated!r} {heading.unit}" if heading.unit and not isinstance(stated, str) else stated
    if target == "N" and isinstance(value, str):
        with contextlib.suppress(UnitError):
            return quantity(value, "kg") * STANDARD_GRAVITY
    return quantity(value, target, ambient=ambient, where=where)


def constant_from_column(
    table: RawTable, heading: str, unit: str | None, values: Array
) -> tuple[str, float] | None:
    """Name and SI value of the constant that a column states in every row; None if the heading
    names no constant. Raises ColumnError if the values differ between rows."""
    parsed = parse_constant_name(heading)
    if parsed is None:
        return None
    name, own_unit = parsed
    stated = unit or own_unit or CONSTANT_UNITS[name]
    target = CONSTANT_UNITS[name]
    change = conversion(stated, target, ambient=0.0, where=f"{table.origin}: {heading}")
    first = float(values[0])
    changed = ~np.isclose(values, first, rtol=1e-9, atol=0.0)
    if changed.any():
        row = int(np.argmax(changed))
        raise ColumnError(
            f"{table.location(row)}: {heading} changes from {first:g} to {values[row]:g}, but must"
            " be constant within a run. Write each specimen to a separate file."
        )
    return name, float(change(first))

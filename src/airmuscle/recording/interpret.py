"""From a table of headings and cells, whatever file it came from, to a Recording in SI units.

Here gauge is told from absolute, units are converted, and what cannot have been measured is refused.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping

import numpy as np

from ..core.arrays import Array
from ..core.errors import ColumnError, UnitError, suggestion
from ..core.units import AMBIENT_PRESSURE, UnitConversion, conversion
from .clock import seconds_from_clock
from .columns import QUANTITIES
from .constants import constant_from_column, collect_constants
from .heading import UNIT_SPELLINGS, Heading, find_quantity_name, parse_heading
from .plausibility import check_plausible
from .recording import Recording
from .table import Cells, RawTable

STANDARD_GRAVITY = 9.80665
"""What makes a load in kg a force [m/s2] (ISO 80000-3)."""


def interpret(
    table: RawTable, *, units: Mapping[str, str], constants: Mapping[str, float | str], ordered: bool = True
) -> Recording:
    """The Recording that a table holds; `units` and `constants` given by the user go before the file's own.

    Time that repeats or runs backwards is refused, unless `ordered` is false.
    Raises ColumnError or UnitError with file, row, value and remedy.
    """
    found = collect_constants(table, constants)
    headings = _resolve_headings(table, units)
    for heading, cells in zip(headings, table.columns, strict=True):
        if not heading.known and not isinstance(cells, list):
            stated = constant_from_column(table, heading.text, heading.unit, cells)
            found = {stated[0]: stated[1], **found} if stated else found
    ambient = float(found.get("ambient", AMBIENT_PRESSURE))
    columns: dict[str, Array] = {}
    notes: list[str] = [*table.notes, *_override_notes(table, headings)]
    for heading, cells in zip(headings, table.columns, strict=True):
        if heading.known:
            columns[heading.name], note = _convert_column(table, heading, cells, ambient)
        else:
            note = _keep_unknown_column(table, heading, cells, columns)
        notes += [note] if note and note not in notes else []
    check_plausible(table, columns, found.get("resting_length"), ambient, ordered=ordered)
    written = {h.name: h.unit for h in headings if h.known and h.unit}
    return Recording(columns, table.origin, found, tuple(notes), written)


def _resolve_headings(table: RawTable, units: Mapping[str, str]) -> list[Heading]:
    """The headings with their units: the user's, the unit row's or their own, in this order."""
    read = [parse_heading(text) for text in table.headings]
    stated = {find_quantity_name(key) or key: unit for key, unit in units.items()}
    keys = [key for heading in read for key in (heading.name, heading.text)]
    for key in stated:
        if key not in keys:
            known = [heading.name for heading in read]
            there = f"there are {', '.join(known)}.{suggestion(key, known)}"
            raise ColumnError(f"{table.origin}: a unit is given for '{key}', but {there}")
    row = table.units or ()
    found = [
        Heading(h.text, h.name, stated.get(h.name, stated.get(h.text)) or below or h.unit, h.known)
        for h, below in zip(read, [*row, *[""] * (len(read) - len(row))], strict=False)
    ]
    _check_unique(table, found)
    if not any(heading.known for heading in found):
        _check_any_known(table, found)
    return found


def _override_notes(table: RawTable, headings: list[Heading]) -> list[str]:
    """A word on every column whose own unit gave way to the one that the user stated."""
    row = [*(table.units or ()), *[""] * len(headings)]
    own = [below or parse_heading(h.text).unit for h, below in zip(headings, row, strict=False)]
    return [
        f"{h.name} is taken in {h.unit}, as stated, although the file says {unit}"
        for h, unit in zip(headings, own, strict=True)
        if unit and h.unit and unit != h.unit
    ]


def _check_unique(table: RawTable, headings: list[Heading]) -> None:
    seen: dict[str, str] = {}
    for heading in headings:
        if heading.name in seen and heading.text:
            raise ColumnError(
                f"{table.origin}: columns '{seen[heading.name]}' and '{heading.text}' both hold the {heading.name}. "
                f"Rename or delete one; of several muscles, write 'left.{heading.name}' and 'right.{heading.name}'."
            )
        seen[heading.name] = heading.text


def _check_any_known(table: RawTable, headings: list[Heading]) -> None:
    names = [heading.text for heading in headings]
    near = [n for name in names for n in difflib.get_close_matches(name.lower(), QUANTITIES, n=1)]
    hint = f" Did you mean '{near[0]}'?" if near else ""
    raise ColumnError(
        f"{table.origin}: none of the columns ({', '.join(names)}) is known; known are {', '.join(QUANTITIES)}.{hint}"
    )


def _convert_column(table: RawTable, heading: Heading, cells: Cells, ambient: float) -> tuple[Array, str]:
    """A known column in SI units, and a note where its unit left something open."""
    if heading.name == "time" and isinstance(cells, list):
        seconds = seconds_from_clock(cells)
        if seconds is not None:
            return seconds, f"The time is read from a clock and counted from its first instant, {cells[0]}."
    change = _conversion(table, heading, ambient)
    values = _parse_numbers(table, heading, cells)
    if change.assumed_gauge:
        said = f"unit '{heading.unit}' does not say; write bara or kPa(a) if it is absolute."
        return change(values), f"The {heading.name} is taken as gauge: its {said}"
    if heading.unit is None:
        return values, f"The {heading.name} has no unit and is taken as a ratio."
    if heading.target == "N" and _is_mass(heading.unit):
        said = f"stated in {heading.unit}; it is taken as a weight under standard gravity, {STANDARD_GRAVITY} m/s2."
        return change(values), f"The {heading.name} is {said}"
    return change(values), ""


def _conversion(table: RawTable, heading: Heading, ambient: float) -> UnitConversion:
    target = heading.target or "1"
    where = f"{table.origin}, column '{heading.text}'"
    usual = ", ".join(UNIT_SPELLINGS[target])
    if heading.unit is None:
        if target == "1":
            return UnitConversion(1.0)
        raise UnitError(
            f"{where}: no unit is stated. Head it '{heading.name} [{UNIT_SPELLINGS[target][1 % len(UNIT_SPELLINGS[target])]}]' "
            f"or give units={{'{heading.name}': ...}}; usual are {usual}."
        )
    try:
        if target == "N" and _is_mass(heading.unit):
            return UnitConversion(conversion(heading.unit, "kg").factor * STANDARD_GRAVITY)
        return conversion(heading.unit, target, ambient=ambient, where=where)
    except UnitError as reason:
        cases = {spelling.lower(): spelling for spelling in UNIT_SPELLINGS[target]}
        near = difflib.get_close_matches(heading.unit.lower(), cases, n=1)
        hint = f" Did you mean '{cases[near[0]]}'?" if near else f" The {heading.name} is usually in {usual}."
        raise UnitError(f"{reason}{hint}") from None


def _is_mass(unit: str) -> bool:
    if unit in UNIT_SPELLINGS["N"]:
        return False
    try:
        return bool(conversion(unit, "kg"))
    except UnitError:
        return False


def _parse_numbers(table: RawTable, heading: Heading, cells: Cells) -> Array:
    """The cells as numbers. Raises ColumnError at the first that is none, or not finite."""
    if isinstance(cells, list):
        for row, cell in enumerate(cells):
            try:
                float(cell)
            except ValueError:
                said = f"'{cell}' is not a number" if cell else "has an empty cell"
                raise ColumnError(
                    f"{table.location(row)}: {heading.name} {said}. Correct the cell or delete the {table.row_label}."
                ) from None
    values = np.array(cells, dtype=float)
    bad = ~np.isfinite(values)
    if bad.any():
        row = int(np.argmax(bad))
        raise ColumnError(
            f"{table.location(row)}: {heading.name} is {values[row]}, which no sensor measures (the column has "
            f"{np.count_nonzero(bad)} such cells). Delete the {table.row_label}, or fill the gap before reading."
        )
    return values


def _keep_unknown_column(table: RawTable, heading: Heading, cells: Cells, columns: dict[str, Array]) -> str:
    """Keep an unknown column as it is where it holds numbers; the note on it, if any."""
    if isinstance(cells, list):
        if not any(cells):
            return ""
        return f"Column '{heading.text}' holds text and is left out."
    stated = constant_from_column(table, heading.text, heading.unit, cells)
    if stated:
        return f"Column '{heading.text}' holds one value and states the {stated[0]}: {stated[1]:.9g} (SI)."
    columns[heading.text or "unnamed"] = cells
    near = difflib.get_close_matches(heading.text.partition(" ")[0].lower(), QUANTITIES, n=1)
    hint = f" Did you mean '{near[0]}'?" if near else ""
    return f"Column '{heading.text}' is no known quantity and is kept as it is, without conversion.{hint}"

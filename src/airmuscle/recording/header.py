"""How a table of cells is laid out: headings, a row of units, remarks in comments; the same for text and worksheets."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence

from ..core.errors import ColumnError, UnitError
from ..core.units import conversion
from .heading import parse_heading

_CONSTANT_COMMENT = re.compile(r"[#%]\s*(?P<name>[A-Za-z_]\w*)(?:\s*\[(?P<unit>[^\]]*)\])?\s*[=:]\s*(?P<value>.+)")
_TEXT_CONSTANTS = ("resting_length", "ambient", "specimen", "run")


def is_number(cell: str) -> bool:
    """Whether a cell holds a number, with a decimal point or a decimal comma."""
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True


def are_headings(cells: Sequence[str]) -> bool:
    """Whether a row of cells names columns: some cell is no number."""
    return not all(is_number(cell) for cell in cells if cell)


def missing_header_error(place: str) -> ColumnError:
    """What to raise where numbers stand in the row of the headings."""
    return ColumnError(
        f"{place}: numbers stand where the headings should. Put a line above them that names each column with its "
        "unit, like 'pressure [kPa], contraction [%], force [N]', or map the columns by their numbers: "
        "columns={1: 'pressure [kPa]', 2: 'force [N]'}."
    )


def parse_unit_row(headings: Sequence[str], cells: Sequence[str]) -> tuple[str, ...] | None:
    """The row of units below the headings, if this row is one: some unit in it, and no number but 1."""
    bare = [re.sub(r"^\[(.*)\]$|^\((.*)\)$", r"\1\2", cell) for cell in cells]
    if any(is_number(cell) and cell != "1" for cell in bare):
        return None
    telling = [pair for pair in zip(headings, bare, strict=False) if pair[1] not in ("", "1")]
    return tuple(bare) if any(_is_unit(text, cell) for text, cell in telling) else None


def _is_unit(heading: str, cell: str) -> bool:
    """Whether a cell is a unit of the quantity that its heading names; a foreign name takes any usual unit."""
    target = parse_heading(heading).target
    try:
        return target is not None and bool(conversion(cell, target))
    except UnitError:
        return False


def parse_constant_comment(line: str) -> tuple[str, float | str] | None:
    """`# resting_length [mm] = 300` or `# resting_length: 300 mm`; None for a comment that states no constant.

    Any number or quoted text in JSON is a constant of the run; plain words only where they are expected.
    """
    found = _CONSTANT_COMMENT.fullmatch(line.strip())
    if not found:
        return None
    name, said = found["name"], found["value"].strip()
    try:
        value = json.loads(said)
    except json.JSONDecodeError:
        return (name, said) if name in _TEXT_CONSTANTS else None
    if not isinstance(value, float | int | str) or isinstance(value, bool):
        return None
    return name, f"{said} {found['unit']}" if found["unit"] else value

"""Quantities and units in headings, and values in the names of files by a pattern."""

import contextlib
import itertools
import json
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from ....core import ColumnError, FileError, Hint, UnitError, conversion, listed
from ....recording.columns import parse_heading
from .constants import CONSTANT_UNITS, parse_constant_name
from .sample_rate import SAMPLE_RATE, rate_in_comment

COMMA_NUMBER = re.compile(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?")
"""A number with a decimal comma, without thousands separators."""
POINT_NUMBER = re.compile(r"[-+]?\d*\.\d+(?:[eE][-+]?\d+)?")
"""A number with a decimal point, without thousands separators."""
_CONSTANT_COMMENT = re.compile(
    r"[#%]\s*(?P<name>[^\W\d][\w -]*?)(?:\s*\[(?P<unit>[^\]]*)\])?\s*[=:]\s*(?P<value>.+)"
)
EMPTY_CORNER = "corner"
"""Heading of the first column of a grid that has none."""
MAX_PREAMBLE = 1000
"""Maximum number of lines above the headings (chosen)."""
_TEXT_CONSTANTS = ("resting_length", "ambient", "ambient_temperature", "specimen", "run")


def is_number(cell: str) -> bool:
    """Whether a cell contains a number, with a decimal point or a decimal comma."""
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True


def bare_heading(text: str) -> str:
    """A heading without the unit in brackets, `force` of `force [N]`."""
    return text.partition("[")[0].partition("(")[0].strip()


def stated_heading_row(
    rows: Iterable[tuple[int, Sequence[str]]], named: Sequence[str], skip_rows: int | None
) -> int | None:
    """The index of the row of headings that the user states, by the number of rows of the file
    above it or by headings that it contains, complete or without unit; None if nothing is stated or
    found. `rows` have numbers from 1 on.
    """
    best = None
    most = 0
    for index, (number, cells) in enumerate(
        itertools.islice(rows, None if skip_rows else MAX_PREAMBLE)
    ):
        if skip_rows is not None:
            if number > skip_rows:
                return index
            continue
        matches = len({*cells, *map(bare_heading, cells)} & set(named))
        if matches > most:
            best = index
            most = matches
        if most == len(named):
            break
    return best


def has_empty_corner(rows: Sequence[Sequence[str]]) -> bool:
    """Whether the first row of cells are the headings of a grid whose corner is empty: rising or
    falling numbers above rows of numbers that begin in the first column.
    """
    corner, *across = rows[0]
    if corner or len(across) < 2 or len(rows) < 2 or not all(map(is_number, across)):
        return False
    values = [float(cell.replace(",", ".")) for cell in across]
    is_rising = values == sorted(values)
    is_falling = values == sorted(values, reverse=True)
    if len(set(values)) < len(values) or not (is_rising or is_falling):
        return False
    return all(len(row) == len(rows[0]) and is_number(row[0]) for row in rows[1:])


def parse_headings(
    origin: str,
    place: str,
    rows: Sequence[Sequence[str]],
    headerless: bool,
    above: Sequence[str] = (),
) -> tuple[list[str], tuple[str, ...] | None, int]:
    """The headings and units of a table, and the number of rows that they occupy, from its first
    three rows of cells.

    `place` names the first row in messages; `above` are cells in a comment above it. Raises
    ColumnError for numbers without headings, unless `headerless`, and FileError without a row of
    numbers.
    """
    cells = rows[0]
    if not all(map(is_number, filter(None, cells))):
        headings = list(cells)
        count = 1
    elif len(above) == len(cells) and not all(map(is_number, filter(None, above))):
        headings = list(above)
        count = 0
    elif headerless:
        headings = [str(i) for i in range(1, len(cells) + 1)]
        count = 0
    elif has_empty_corner(rows):
        headings = [EMPTY_CORNER, *cells[1:]]
        count = 1
    else:
        mapped = {1: "pressure [kPa]", 2: "force [N]"}
        raise ColumnError(
            f"{origin}, {place}: the heading row is missing. Insert a row above the numbers with"
            " name and unit of each column, such as 'pressure [kPa], contraction [%], force [N]'.",
            hint=Hint("To map columns by their numbers", "columns", mapped, "ColumnMapping"),
        )
    units = parse_unit_row(headings, rows[count]) if len(rows) > count else None
    count += units is not None
    if len(rows) <= count:
        raise FileError(f"{origin}: no rows of numbers below the headings ({listed(headings)}).")
    return headings, units, count


def parse_unit_row(headings: Sequence[str], cells: Sequence[str]) -> tuple[str, ...] | None:
    """The units in the row below the headings; None if the row is not a unit row. A unit row
    contains at least one unit and no number except 1."""
    bare = [re.sub(r"^\[(.*)\]$|^\((.*)\)$", r"\1\2", cell) for cell in cells]
    if any(is_number(cell) and cell != "1" for cell in bare):
        return None
    for text, cell in zip(headings, bare, strict=False):
        target = parse_heading(text).target
        with contextlib.suppress(UnitError):  # it is no unit of the quantity in the heading
            if cell not in ("", "1") and target is not None and conversion(cell, target):
                return tuple(bare)
    return None


def count_cells(cells: Sequence[object]) -> int:
    """The number of cells with content."""
    return sum(cell not in (None, "") for cell in cells)


def parse_constant_cells(cells: Sequence[str]) -> tuple[str, float | str] | None:
    """A constant in two cells (`resting_length | 300 mm`), in three (`resting_length | 300 | mm`),
    or as a comment.
    """
    filled = [cell for cell in cells if cell]
    name, value = (
        (filled[0].rstrip(" :="), " ".join(filled[1:])) if len(filled) > 1 else (filled[0], "")
    )
    text = f"{name} = {value}" if value else name
    return parse_constant_comment(text if text[0] in "#%" else f"# {text}")


def parse_constant_comment(line: str) -> tuple[str, float | str] | None:
    """Name and value in `# resting_length [mm] = 300` or `# resting_length: 300 mm`; None for any
    other comment. Any number or quoted text (JSON) after one word is a constant of the run; another
    text only after a known name.
    """
    match = _CONSTANT_COMMENT.fullmatch(line.strip())
    if not match:
        return None
    name = match["name"]
    text = match["value"].strip()
    rate = rate_in_comment(name, f"{text} {match['unit'] or ''}")
    if rate is not None:
        return SAMPLE_RATE, rate
    known = name in _TEXT_CONSTANTS or parse_constant_name(name) is not None
    if not known and not name.isidentifier():
        return None
    try:
        value = json.loads(text)
    except (
        ValueError,
        RecursionError,
    ):  # no JSON, an integer of thousands of digits, or lists in lists
        stated = (
            f"{text} {match['unit']}" if match["unit"] and is_number(text) else text
        )  # `1013.` is no JSON
        return (name, stated) if known else None
    if not isinstance(value, float | int | str) or isinstance(value, bool):
        return None
    return name, f"{text} {match['unit']}" if match["unit"] else value


TEXT_NAMES = ("specimen", "run")
"""Values that are texts."""
_PLACEHOLDER = re.compile(r"\{([^{}]*)\}")
_NUMBER = r"([-+]?\d+(?:[.,]\d+)?)"


class FileNamePattern:
    """A pattern for the names of files without extension; the text around a value may be any part
    of the name.

    `{length [cm]}`, `{pressure [bar]}` or `{resting_length [mm]}` is a number in this unit,
    `{specimen}` and `{run}` are texts, `{}` is any text that is not used. Raises ColumnError for
    other placeholders.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        parts = _PLACEHOLDER.split(text)
        self._names = tuple(name.strip() for name in parts[1::2])
        expressions = [re.escape(parts[0])]
        for name, literal in zip(self._names, parts[2::2], strict=True):
            expressions += [self._expression(name), re.escape(literal)]
        named = [name for name in self._names if name]
        if not named or len(set(named)) < len(named):
            raise ColumnError(
                f"file name pattern '{text}': it must contain each value once, such as"
                " 'held{length [cm]}cm'."
            )
        self._expression_of_name = re.compile("".join(expressions))

    def _expression(self, name: str) -> str:
        if not name:
            return "(.*?)"
        if name in TEXT_NAMES:
            return "([^_ ]+?)" if not self.text.endswith(f"{{{name}}}") else "([^_ ]+)"
        heading = parse_heading(name)
        constant = parse_constant_name(name)
        unit = constant[1] if constant else heading.unit
        if not (constant or heading.known) or not (unit or heading.target == "1"):
            raise ColumnError(
                f"file name pattern '{self.text}': '{{{name}}}' is not a quantity with its unit."
                " Write '{length [cm]}',"
                f" {', '.join(f'{{{key} [{u}]}}' for key, u in CONSTANT_UNITS.items())},"
                " {specimen}, {run}, or {} for any text."
            )
        return _NUMBER

    def values(self, path: Path) -> dict[str, float | str]:
        """The values in the name of a file, by placeholder. Raises ColumnError where the name does
        not match.
        """
        match = self._expression_of_name.search(path.stem)
        if match is None:
            raise ColumnError(
                f"{path.name}: the name does not match the pattern '{self.text}'. Correct the"
                " pattern, or give the values of this file as constants."
            )
        for group, (name, text) in enumerate(zip(self._names, match.groups(), strict=True), 1):
            start = match.start(group)
            if (
                name
                and name not in TEXT_NAMES
                and text[0] == "-"
                and path.stem[start - 1 : start].isalnum()
            ):
                raise ColumnError(
                    f"{path.name}: the hyphen of '{path.stem[start - 1]}{text}' may be a minus sign"
                    f" or a separator. A separator belongs into the pattern: '-{{{name}}}'. Give a"
                    " negative value as a constant."
                )
        pairs = zip(self._names, match.groups(), strict=True)
        return {
            name: text if name in TEXT_NAMES else float(text.replace(",", "."))
            for name, text in pairs
            if name
        }

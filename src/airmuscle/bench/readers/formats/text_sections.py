"""Forms of text tables that programs of a laboratory write: cells with their names, and headings
that repeat, for each run or as often as the program was started.
"""

import dataclasses
import re
from collections.abc import Sequence

from ..tables import NumberedLines, is_number, split_cells

_NAMED_CELL = re.compile(
    r"\s*(?P<name>[^\W\d][^:=,;\t]*?)\s*[:=]\s*(?P<value>[-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*"
)
MIN_NAMED_LINES = 3
"""Least number of lines of cells with names that make a table (chosen)."""


def with_headings_of_cells(lines: NumberedLines) -> NumberedLines:
    """Lines of cells with names, `pressure:101.2,force:12.5`, as a row of headings and rows of
    numbers; other lines as they are.
    """
    if len(lines) < MIN_NAMED_LINES:
        return lines
    parsed = []
    for number, line in lines:
        cells = [_NAMED_CELL.fullmatch(part) for part in re.split(r"[,;\t]", line.strip())]
        named = [cell for cell in cells if cell is not None]
        if len(named) < len(cells):
            return lines
        parsed.append((number, named))
    names = [cell["name"] for cell in parsed[0][1]]
    if len(names) < 2 or any([cell["name"] for cell in row] != names for _, row in parsed):
        return lines
    first = parsed[0][0]
    rows = [(number, ";".join(cell["value"] for cell in row)) for number, row in parsed]
    return [(first, ";".join(names)), *rows]


@dataclasses.dataclass(frozen=True)
class TextSection:
    """The lines of one table of a file, with its title, and a note on headings left out."""

    lines: NumberedLines
    title: str = ""
    note: str = ""


def sections(lines: NumberedLines, headings: Sequence[str], delimiter: str) -> list[TextSection]:
    """The tables of a file whose headings repeat: one for each, or one in all where the first
    column goes on.
    """
    starts = [
        i
        for i, (_, line) in enumerate(lines)
        if not all(map(is_number, headings)) and split_cells(line, delimiter) == list(headings)
    ]
    if len(starts) < 2:
        return [TextSection(lines)]
    begins = [0, *(_with_title(lines, start, delimiter) for start in starts[1:])]
    parts = [lines[a:b] for a, b in zip(begins, [*begins[1:], len(lines)], strict=True)]
    has_titles = any(begin < start for begin, start in zip(begins[1:], starts[1:], strict=True))
    bodies = [[line for line in part if _starts_with_number(line[1], delimiter)] for part in parts]
    if not has_titles and _goes_on(bodies, delimiter):
        head = parts[0][: len(parts[0]) - len(bodies[0])]
        note = f"The headings stand {len(starts)} times in the file and are read once."
        return [TextSection([*head, *(line for body in bodies for line in body)], "", note)]
    titles = [
        " ".join(line for _, line in lines[begin:start]).strip(" ,;\t")
        for begin, start in zip(begins, starts, strict=True)
    ]
    return [
        TextSection(part, title)
        for part, title, body in zip(parts, titles, bodies, strict=True)
        if body
    ]


def _with_title(lines: NumberedLines, start: int, delimiter: str) -> int:
    """The index of the first line above headings that is no row of numbers."""
    while start > 1 and not _starts_with_number(lines[start - 1][1], delimiter):
        start -= 1
    return start


def _starts_with_number(line: str, delimiter: str) -> bool:
    cells = split_cells(line, delimiter)
    numbers = sum(map(is_number, cells))
    return numbers > 0 and 2 * numbers >= len([cell for cell in cells if cell])


def _goes_on(bodies: Sequence[NumberedLines], delimiter: str) -> bool:
    """Whether the first column rises from each table to the next."""
    last: float | None = None
    for body in bodies:
        cells = [split_cells(line, delimiter)[0].replace(",", ".") for _, line in body]
        if not cells or not is_number(cells[0]) or not is_number(cells[-1]):
            return False
        if last is not None and float(cells[0]) <= last:
            return False
        last = float(cells[-1])
    return True

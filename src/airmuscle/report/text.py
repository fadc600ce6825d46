"""Brief view of chapters as plain text: for each the title, the result, its quantities and tables,
and the notes.
"""

import re
import textwrap
import unicodedata
from collections.abc import Iterator, Sequence

from ..core import printable
from .chapter import Chapter, Table
from .formatting import to_plain
from .shown import shown_columns, value_cells

MAX_WORD = 14
"""Length of a word that may be broken, such as a path [characters] (chosen)."""
GAP = 3
"""Space between two columns of a table [characters]; one less where the table does not fit
otherwise (chosen).
"""
MAX_NOTES = 8
"""Maximum number of notes of a chapter (chosen)."""
_UNIT = re.compile(r"\[[^\]]*\]")


def as_text(chapters: Sequence[Chapter], width: int, rest: str = "the report") -> str:
    """The brief view of the chapters, each result once; `rest` names the place of what it leaves
    out.
    """
    texts = list[str]()
    stated = tuple[str, ...]()
    for chapter in (candidate for candidate in chapters if candidate.brief):
        result = chapter.paragraphs[:1]
        texts.append("\n".join(_lines(chapter, () if result == stated else result, width, rest)))
        stated = result
    return "\n\n".join(texts)


def _lines(chapter: Chapter, result: Sequence[str], width: int, rest: str) -> Iterator[str]:
    yield to_plain(chapter.title)
    yield from map(to_plain, result)
    values = [named for named in chapter.values if named.brief]
    cells = [
        (named.name, " ".join(filter(None, value_cells(named))), named.remark) for named in values
    ]
    widths = [max(map(cell_width, column)) for column in zip(*cells, strict=True)]
    for name, value, remark in cells:
        yield f"{_padded(name, widths[0])}   {_padded(value, widths[1])}   {remark}".rstrip()
    for table in chapter.tables:
        if table.brief_rows:
            yield from [
                "",
                *([to_plain(table.title)] if table.title else []),
                *table_lines(table, width, rest),
            ]
    remarks = [
        *(f"PROBLEM: {text}" for text in chapter.problems),
        *(f"note: {text}" for text in chapter.notes),
    ]
    if remarks and any(table.brief_rows for table in chapter.tables):
        yield ""
    yield from map(to_plain, remarks[:MAX_NOTES])
    if len(remarks) > MAX_NOTES:
        yield f"{len(remarks) - MAX_NOTES} more notes are in {rest}."


def table_lines(table: Table, width: int, rest: str) -> Iterator[str]:
    """The brief rows of a table, and the number of those that are left out between or after
    them.
    """
    columns = shown_columns(table, brief=True)
    headings = [
        _UNIT.sub(
            lambda unit: unit[0].replace(" ", "\N{NO-BREAK SPACE}"),
            printable(to_plain(column.heading)),
        )
        for column in columns
    ]
    cells = [[printable(to_plain(text)) for text in column.texts] for column in columns]
    widths, gap = _widths(headings, cells, width)
    right = [column.is_numeric for column in columns]
    yield from _row(headings, widths, right, gap)
    yield "─" * min(width, sum(widths) + gap * (len(widths) - 1))
    last = -1
    for row, texts in zip(table.brief_rows, zip(*cells, strict=True), strict=True):
        if row > last + 1:
            yield f"... {row - last - 1} more"
        yield from _row(texts, widths, right, gap)
        last = row
    if last + 1 < len(table):
        yield f"... {len(table) - last - 1} more in {rest}"


def _row(cells: Sequence[str], widths: Sequence[int], right: Sequence[bool], gap: int) -> list[str]:
    """The lines of a row; a text that is wider than its column is wrapped."""
    wrapped = [
        (
            [cell]
            if cell_width(cell) <= size
            else textwrap.wrap(cell, size, break_on_hyphens=False, break_long_words=True)
        )
        for cell, size in zip(cells, widths, strict=True)
    ]
    lines = []
    for i in range(max(map(len, wrapped), default=0)):
        parts = [
            _padded(column[i] if i < len(column) else "", size, to_right)
            for column, size, to_right in zip(wrapped, widths, right, strict=True)
        ]
        lines.append((" " * gap).join(parts).rstrip())
    return lines


def _widths(
    headings: Sequence[str], cells: Sequence[Sequence[str]], width: int
) -> tuple[list[int], int]:
    """The widths of the columns and the space between them: headings are wrapped first, then cells
    between words.
    """
    of_cells = [max(map(cell_width, texts), default=1) for texts in cells]
    widths = [
        max(cell_width(heading), size) for heading, size in zip(headings, of_cells, strict=True)
    ]
    words = [_longest_word(heading) for heading in headings]
    least = [
        max([word, *map(_longest_word, texts)]) for word, texts in zip(words, cells, strict=True)
    ]
    wrapped = [
        max(pair) for pair in zip(words, of_cells, strict=True)
    ]  # headings alone are wrapped
    if max(wrapped[0], least[0]) <= width / 2:  # the names of the first column can be copied
        least[0] = wrapped[0] = max(wrapped[0], least[0])
    gap = GAP if sum(wrapped) + GAP * (len(widths) - 1) <= width else GAP - 1
    for limits in (wrapped, least):
        while sum(widths) + gap * (len(widths) - 1) > width:
            i = max(range(len(widths)), key=lambda k: widths[k] - limits[k])
            if widths[i] <= limits[i]:
                break
            widths[i] -= 1
    return widths, gap


def _longest_word(text: str) -> int:
    return max((len(word) for word in text.split(" ") if len(word) <= MAX_WORD), default=1)


def _padded(text: str, width: int, right: bool = False) -> str:
    space = " " * (width - cell_width(text))
    return f"{space}{text}" if right else f"{text}{space}"


def cell_width(text: str) -> int:
    """The number of places that a text takes in a terminal."""
    wide = sum(unicodedata.east_asian_width(c) in "WF" for c in text) if not text.isascii() else 0
    return len(text) + wide

"""Brief view of chapters as plain text: for each the title, the result, its quantities and tables,
and the notes.
"""

import re
from collections.abc import Iterator, Sequence

from ..core import printable
from .chapter import Chapter, Table
from .formatting import to_plain
from .layout import aligned_rows, cell_width, padded
from .shown import shown_columns, value_cells

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
        yield f"{padded(name, widths[0])}   {padded(value, widths[1])}   {remark}".rstrip()
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
    head, *rows = aligned_rows(headings, cells, width, [column.is_numeric for column in columns])
    yield from head
    last = -1
    for row, lines in zip(table.brief_rows, rows, strict=True):
        if row > last + 1:
            yield f"... {row - last - 1} more"
        yield from lines
        last = row
    if last + 1 < len(table):
        yield f"... {len(table) - last - 1} more in {rest}"

"""Layout of a table of texts in a terminal of limited width."""

import textwrap
import unicodedata
from collections.abc import Sequence

MAX_WORD = 14
"""Length of a word that may be broken, such as a path [characters] (chosen)."""
GAP = 3
"""Space between two columns of a table [characters]; one less where the table does not fit
otherwise (chosen).
"""


def aligned_rows(
    headings: Sequence[str],
    columns: Sequence[Sequence[str]],
    width: int,
    right: Sequence[bool],
) -> list[list[str]]:
    """The lines of the headings, with a rule below them, and of each row of a table.

    columns  the cells of each column
    width    of the terminal [characters]
    right    whether a column is aligned on its right
    """
    widths, gap = _widths(headings, columns, width)
    rule = "─" * min(width, sum(widths) + gap * (len(widths) - 1))
    rows = [_row(cells, widths, right, gap) for cells in zip(*columns, strict=True)]
    return [[*_row(headings, widths, right, gap), rule], *rows]


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
            padded(column[i] if i < len(column) else "", size, to_right)
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


def padded(text: str, width: int, right: bool = False) -> str:
    """The text with spaces up to a width, before it where it stands on the right."""
    space = " " * (width - cell_width(text))
    return f"{space}{text}" if right else f"{text}{space}"


def cell_width(text: str) -> int:
    """The number of places that a text takes in a terminal."""
    wide = sum(unicodedata.east_asian_width(c) in "WF" for c in text) if not text.isascii() else 0
    return len(text) + wide

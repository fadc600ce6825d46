"""Terminal output: messages, tables and JSON, without raw control characters."""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Iterable, Sequence
from typing import Any

import typer

from ...core.display import chosen_scale, heading_scale, scaled_numbers
from ...core.errors import printable
from ...report.write import as_json

WIDE = 160
"""Width [characters] of a table that is written to a file or to another program."""
MAX_WORD = 14
"""Length of a word that may be broken, such as a path [characters] (chosen)."""
WIDE_GAP = 3
"""Space between two columns of a table [characters]; one less where the table does not fit otherwise (chosen)."""


def echo(text: str = "", *, err: bool = False) -> None:
    """Print a message; every message of the command line passes through this function or through `print_table`."""
    typer.echo(printable(text), err=err)


def print_json(content: Any) -> None:
    """Print standard JSON; numbers that are not finite are null."""
    lines = as_json(content).splitlines()
    typer.echo("\n".join("".join(c if printable(c) == c else json.dumps(c)[1:-1] for c in line) for line in lines))


def print_table(headers: Sequence[str], rows: Iterable[Sequence[Any]], *, right: Sequence[str] = ()) -> None:
    """Print a table; the columns named in `right` are right-aligned, a cell may be rich text."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    scales = [heading_scale(header) for header in headers]  # the units chosen for display
    cells = [[_cell(cell, factor) for cell, (factor, _) in zip(row, scales, strict=True)] for row in rows]
    console = Console(width=table_width(), highlight=False, emoji=False)
    headings = [without_markup(scale[1]) for scale in scales]
    widths, gap = _column_widths(headings, cells, console.width)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False, header_style="bold",
                  padding=(0, 1) if gap == WIDE_GAP else (0, 1, 0, 0))  # fmt: skip
    for i, heading in enumerate(headings):  # the first column is not wrapped, so that its names can be copied
        justify: Any = "right" if headers[i] in right else "left"
        table.add_column(heading, justify=justify, overflow="fold", no_wrap=i == 0, width=widths[i])
    for row in cells:
        table.add_row(*row)
    console.print(table)


def table_width() -> int:
    """The width of a table [characters]: that of the terminal, or `WIDE`."""
    return shutil.get_terminal_size().columns if sys.stdout.isatty() or "COLUMNS" in os.environ else WIDE


def _column_widths(headings: Sequence[str], cells: Sequence[Sequence[Any]], width: int) -> tuple[list[int | None], int]:
    """The widths of the columns and the space between them, so that no word of a heading and no number is broken.

    Widths are None where the table fits, or cannot fit.
    """
    columns = list(zip(headings, *([str(getattr(cell, "plain", cell)) for cell in row] for row in cells), strict=True))
    widest, count = [max(map(len, column)) for column in columns], len(headings) - 1
    least = [max((len(w) for text in column for w in text.split() if len(w) <= MAX_WORD), default=1)
             for column in columns]  # fmt: skip
    least[0] = widest[0]
    gap = WIDE_GAP if sum(least) + WIDE_GAP * count <= width else WIDE_GAP - 1
    if sum(widest) + WIDE_GAP * count <= width or sum(least) + gap * count > width:
        return [None] * len(headings), WIDE_GAP
    while sum(widest) + gap * count > width:
        widest[max(range(1, len(widest)), key=lambda i: widest[i] - least[i])] -= 1
    return list(widest), gap


def _cell(cell: Any, factor: float) -> Any:
    """A cell for rich; the numbers of a text are multiplied by a factor other than 1."""
    if hasattr(cell, "plain"):
        return cell
    return without_markup(str(cell) if factor == 1.0 else scaled_numbers(str(cell), factor))


def without_markup(text: str) -> str:
    """Printable text for rich, in which brackets are not markup."""
    from rich.markup import escape

    return escape(printable(text))


def percent(ratio: float) -> str:
    """A contraction with four significant digits: `12.5 %`, or in the unit chosen for display."""
    factor, unit = chosen_scale("1", 100.0, "%")
    return f"{factor * ratio:.4g} {'' if unit == '1' else unit}".rstrip()

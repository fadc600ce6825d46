"""Terminal output: messages, tables and JSON, without raw control characters."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterable, Sequence
from typing import Any

import typer

from ..core.errors import printable
from ..report.write import as_json

WIDE = 160
"""Width [characters] of a table that is written to a file or to another program."""


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

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False, header_style="bold")
    for i, header in enumerate(headers):  # the first column is not wrapped, so that its names can be copied
        justify: Any = "right" if header in right else "left"
        table.add_column(without_markup(header), justify=justify, overflow="fold", no_wrap=i == 0)
    for row in rows:
        table.add_row(*(cell if hasattr(cell, "plain") else without_markup(str(cell)) for cell in row))
    width = None if sys.stdout.isatty() or "COLUMNS" in os.environ else WIDE
    Console(width=width, highlight=False, emoji=False).print(table)


def without_markup(text: str) -> str:
    """Printable text for rich, in which brackets are not markup."""
    from rich.markup import escape

    return escape(printable(text))


def percent(ratio: float) -> str:
    """A ratio as a percentage with four significant digits: `12.5 %`."""
    return f"{100 * ratio:.4g} %"

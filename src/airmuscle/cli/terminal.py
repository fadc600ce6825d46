"""What commands print: tables for people, JSON for programs."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Sequence
from typing import Any

import typer

WIDE = 160
"""Columns of a table that goes to a file or another program, where no terminal says its width."""


def print_json(content: Any) -> None:
    """Print JSON that any reader takes; what is not finite is null."""
    from ..report.write import as_json

    typer.echo(as_json(content), nl=False)


def print_table(headers: Sequence[str], rows: Iterable[Sequence[Any]], *, right: Sequence[str] = ()) -> None:
    """Print a table; columns named in `right` stand flush right, a cell may be rich text."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False, header_style="bold")
    for i, header in enumerate(headers):  # what a row is about stays in one piece, so that it can be copied
        table.add_column(header, justify="right" if header in right else "left", overflow="fold", no_wrap=i == 0)
    for row in rows:
        table.add_row(*(cell if hasattr(cell, "plain") else _escaped(str(cell)) for cell in row))
    wide = None if sys.stdout.isatty() or "COLUMNS" in os.environ else WIDE
    Console(width=wide, highlight=False).print(table)


def _escaped(text: str) -> str:
    from rich.markup import escape

    return escape(text)

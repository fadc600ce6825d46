"""Terminal output: messages, tables and JSON, without raw control characters."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterable, Sequence
from typing import Any

import typer

from ...core.display import chosen_scale, heading_scale, scaled_numbers
from ...core.errors import printable
from ...report.write import as_json

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
    scales = [heading_scale(header) for header in headers]  # the units chosen for display
    for i, header in enumerate(headers):  # the first column is not wrapped, so that its names can be copied
        justify: Any = "right" if header in right else "left"
        table.add_column(without_markup(scales[i][1]), justify=justify, overflow="fold", no_wrap=i == 0)
    for row in rows:
        table.add_row(*(_cell(cell, factor) for cell, (factor, _) in zip(row, scales, strict=True)))
    width = None if sys.stdout.isatty() or "COLUMNS" in os.environ else WIDE
    Console(width=width, highlight=False, emoji=False).print(table)


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

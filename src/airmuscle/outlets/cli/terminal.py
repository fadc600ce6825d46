"""Terminal output: messages, tables and JSON, without raw control characters."""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Mapping, Sequence
from typing import Any

import typer

from ...core.errors import printable
from ...report.chapter import Table
from ...report.data import as_json
from ...report.text import table_lines

WIDE = 160
"""Width [characters] of a table that is written to a file or to another program."""


def echo(text: str = "", *, err: bool = False) -> None:
    """Print a message; every message of the command line passes through this function."""
    typer.echo("\n".join(map(printable, text.split("\n"))), err=err)


def print_json(content: Any) -> None:
    """Print standard JSON; numbers that are not finite are null."""
    lines = as_json(content).splitlines()
    typer.echo("\n".join("".join(c if printable(c) == c else json.dumps(c)[1:-1] for c in line) for line in lines))


def print_table(columns: Mapping[str, Sequence[Any]]) -> None:
    """Print a table of all its rows."""
    table = Table("table", "", columns)
    for line in table_lines(Table("table", "", columns, brief=len(table)), terminal_width(), ""):
        echo(line)


def terminal_width() -> int:
    """The width of the terminal [characters], or of a file."""
    if sys.stdout.isatty() or "COLUMNS" in os.environ:
        return shutil.get_terminal_size().columns
    return WIDE

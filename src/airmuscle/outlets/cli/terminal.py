"""Terminal output: messages, tables and JSON without raw control characters, and progress."""

import contextlib
import json
import os
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import typer

from ...core import printable
from ...report.chapter import Table
from ...report.data import as_json
from ...report.text import table_lines
from .entry_point import check_interrupted

WIDE = 160
"""Width [characters] of a table that is written to a file or to another program."""


def echo(text: str = "", *, err: bool = False) -> None:
    """Print a message; every message of the command line passes through this function."""
    typer.echo("\n".join(map(printable, text.split("\n"))), err=err)


warned: set[str] = set()
"""Texts of the warnings that this process has printed."""


def show_warning(text: str) -> None:
    """Print a warning, which the notes of a result on the same screen do not repeat."""
    warned.add(text)
    echo(f"warning: {text}", err=True)


def on_one_screen() -> bool:
    """Whether warnings and results appear on one terminal."""
    return sys.stdout.isatty() and sys.stderr.isatty()


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


@contextlib.contextmanager
def reading_progress(label: str = "reading") -> Iterator[Callable[[str, float], None]]:
    """Yield a callback (name, fraction done), such as `read(progress=...)` takes, which draws one bar per name."""
    from rich.console import Console
    from rich.progress import Progress, TaskID

    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as display:
        tasks: dict[str, TaskID] = {}

        def show(name: str, fraction: float) -> None:
            task = tasks.get(name)
            if task is None:
                task = tasks[name] = display.add_task(_without_markup(f"{label} {name}"), total=1.0)
            display.update(task, completed=fraction)

        yield show


@contextlib.contextmanager
def computation_progress(label: str) -> Iterator[Callable[[float], None]]:
    """Yield a callback (fraction done) that draws one bar."""
    with reading_progress(label) as show:
        yield lambda fraction: show("", fraction)


@contextlib.contextmanager
def counted_progress(label: str) -> Iterator[Callable[[str, int, int], None]]:
    """Yield a callback (step, done, in total) that draws one bar with the number of its runs and the time left; it
    raises KeyboardInterrupt after Ctrl-C."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as display:
        bar = display.add_task(label, total=None)

        def show(step: str, done: int, total: int) -> None:
            check_interrupted()
            display.update(bar, description=step, completed=done, total=total)

        yield show


def _without_markup(text: str) -> str:
    """Printable text for rich, in which brackets are not markup."""
    from rich.markup import escape

    return escape(printable(text))

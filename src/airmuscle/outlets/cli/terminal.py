"""Terminal output: messages, tables and JSON without control characters, progress."""

import contextlib
import json
import os
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, TextIO

from ...core.errors import printable
from ...report.json_text import as_json
from ...report.layout import aligned_rows
from .interruption import check_interrupted
from .streams import encodable

WIDE = 160
"""Width [characters] of a table that is written to a file or to another program."""


def echo(text: str = "", *, err: bool = False) -> None:
    """Print a message; every message of the command line passes through this function."""
    _print("\n".join(map(printable, text.split("\n"))), sys.stderr if err else sys.stdout)


def _print(text: str, stream: TextIO) -> None:
    """Write lines as they are; `click.echo` would write UTF-8 where ASCII is asked for."""
    stream.write(text + "\n")
    stream.flush()


warned: set[str] = set()
"""Texts of the warnings that this process has printed; the notes of a result on the same screen do
not repeat them.
"""


def on_one_screen() -> bool:
    """Whether warnings and results appear on one terminal."""
    return sys.stdout.isatty() and sys.stderr.isatty()


def print_json(content: Any) -> None:
    """Print standard JSON; numbers that are not finite are null."""
    lines = as_json(content).splitlines()
    _print("\n".join(map(_json_line, lines)), sys.stdout)


def _json_line(line: str) -> str:
    if line.isascii() and line.isprintable():
        return line
    return "".join(map(_json_character, line))


def _json_character(character: str) -> str:
    """A character of JSON, escaped where it is a control character or cannot be encoded."""
    shown = encodable(printable(character), sys.stdout)
    return character if shown == character else json.dumps(character)[1:-1]


def print_table(columns: Mapping[str, Sequence[str]]) -> None:
    """Print a table of texts."""
    cells = [list(map(printable, texts)) for texts in columns.values()]
    left = [False] * len(columns)
    for lines in aligned_rows([printable(name) for name in columns], cells, terminal_width(), left):
        for line in lines:
            echo(line)


def terminal_width() -> int:
    """The width of the terminal [characters], or of a file."""
    return (
        shutil.get_terminal_size().columns
        if sys.stdout.isatty() or "COLUMNS" in os.environ
        else WIDE
    )


def is_watched() -> bool:
    """Whether someone sees the progress of a command: whether stderr is a terminal."""
    return sys.stderr.isatty()


def _display(*columns: Any) -> Any:
    """The bars of a terminal with these columns, which disappear at the end."""
    from rich.console import Console
    from rich.progress import Progress

    return Progress(*columns, console=Console(stderr=True), transient=True)


@contextlib.contextmanager
def progress_bars(label: str = "reading") -> Iterator[Callable[[str, float], None]]:
    """Yield a callback (name, fraction done), such as `read(progress=...)` takes, which draws one
    bar per name on a terminal.
    """
    if not is_watched():
        yield lambda name, fraction: None
        return
    from rich.markup import escape
    from rich.progress import TaskID

    with _display() as display:
        tasks: dict[str, TaskID] = {}

        def show(name: str, fraction: float) -> None:
            task = tasks.get(name)
            if task is None:
                task = tasks[name] = display.add_task(
                    escape(printable(f"{label} {name}")), total=1.0
                )
            display.update(task, completed=fraction)

        yield show


@contextlib.contextmanager
def counted_progress(label: str) -> Iterator[Callable[[str, int, int], None]]:
    """Yield a callback (step, done, in total) that draws one bar on a terminal, with the number of
    its runs and the time left; it raises KeyboardInterrupt after Ctrl-C.
    """
    if not is_watched():
        yield lambda step, done, total: check_interrupted()
        return
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn

    description = TextColumn("{task.description}", markup=False)
    with _display(description, BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()) as display:
        bar = display.add_task(label, total=None)

        def show(step: str, done: int, total: int) -> None:
            check_interrupted()
            display.update(bar, description=step, completed=done, total=total)

        yield show

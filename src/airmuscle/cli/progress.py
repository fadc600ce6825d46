"""How far long work has come, on a terminal and there only."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator


@contextlib.contextmanager
def reading_progress(word: str = "reading") -> Iterator[Callable[[str, float], None]]:
    """A function for `read(progress=...)` that draws a bar on stderr while the block lasts."""
    from rich.console import Console
    from rich.progress import Progress, TaskID

    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        tasks: dict[str, TaskID] = {}

        def show(name: str, part: float) -> None:
            task = tasks.get(name)
            if task is None:
                task = tasks[name] = bar.add_task(f"{word} {name}", total=1.0)
            bar.update(task, completed=part)

        yield show


@contextlib.contextmanager
def working_progress(word: str) -> Iterator[Callable[[float], None]]:
    """A function that is told the part done, and draws a bar on stderr while the block lasts."""
    with reading_progress(word) as show:
        yield lambda part: show("", part)

"""Progress display on a terminal; nothing is shown where stderr is redirected."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

from ...core.errors import printable


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


def _without_markup(text: str) -> str:
    """Printable text for rich, in which brackets are not markup."""
    from rich.markup import escape

    return escape(printable(text))

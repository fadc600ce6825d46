"""Threads that share one queue of work, its progress bar, and interruption by the user."""

import contextlib
import contextvars
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

BAR_DELAY = 2.0
"""Seconds after which a progress bar is drawn, on a terminal."""
_hidden = contextvars.ContextVar("hidden", default=False)


class Queue:
    """Items of work that threads take one after the other; `stop` is a flag that kernels check."""

    def __init__(self, items: int) -> None:
        self.stop: npt.NDArray[np.int64] = np.zeros(1, dtype=np.int64)
        self.done = 0
        self.error: BaseException | None = None
        self._items = iter(range(items))
        self._lock = threading.Lock()

    def _take(self) -> int | None:
        with self._lock:
            return None if self.stop[0] else next(self._items, None)

    def work(self, worker: Callable[[int], Any]) -> None:
        """Take items until there are none, or until a worker failed or the queue was stopped."""
        try:
            while (item := self._take()) is not None:
                worker(item)
                with self._lock:
                    self.done += 1
        except BaseException as error:
            self.error = error
            self.stop[0] = 1


def run_workers(queue: Queue, workers: list[Callable[[int], Any]], advanced: Callable[[int], None]) -> bool:
    """Run each worker on its own thread until the queue is empty; False where the user interrupted it."""
    threads = [threading.Thread(target=queue.work, args=(worker,), daemon=True) for worker in workers]
    for thread in threads:
        thread.start()
    interrupted = False
    try:
        for thread in threads:
            while thread.is_alive():
                thread.join(0.05)
                advanced(queue.done)
    except KeyboardInterrupt:
        interrupted = True
        queue.stop[0] = 1
        for thread in threads:
            thread.join()
    if queue.error is not None:
        raise queue.error
    return not interrupted


@contextlib.contextmanager
def hidden_progress() -> Iterator[None]:
    """A block without progress bars, for a caller that draws its own."""
    token = _hidden.set(True)
    try:
        yield
    finally:
        _hidden.reset(token)


@contextlib.contextmanager
def progress(what: str, total: int) -> Iterator[Callable[[int], None]]:
    """A function that takes the number of items done and draws a bar on a terminal once that takes long."""
    started, bar = time.monotonic(), _Bar(what, total)

    def advanced(done: int) -> None:
        if time.monotonic() - started > BAR_DELAY and sys.stderr.isatty() and not _hidden.get():
            bar.show(done)

    try:
        yield advanced
    finally:
        bar.close()


class _Bar:
    """A bar of rich, which is imported only when it is drawn."""

    def __init__(self, what: str, total: int) -> None:
        self.what, self.total = what, total
        self._drawn: Any = None

    def show(self, done: int) -> None:
        from rich.console import Console
        from rich.progress import Progress

        if self._drawn is None:
            self._drawn = Progress(console=Console(stderr=True), transient=True)
            self._task = self._drawn.add_task(self.what, total=self.total)
            self._drawn.start()
        self._drawn.update(self._task, completed=done)

    def close(self) -> None:
        if self._drawn is not None:
            self._drawn.stop()

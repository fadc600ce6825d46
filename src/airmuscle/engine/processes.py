"""Pools of local processes: started afresh, stopped on interruption, and ended together with their parent."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from typing import Any

from ..core.display import current_units, display
from ..core.errors import InputError

_stop_event: Any = None
_BLAS_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""Environment variables that limit the threads of linear algebra, which a process reads when it loads the library."""


def available_cores() -> int:
    """The number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextlib.contextmanager
def process_pool(workers: int, *, one_thread_each: bool = False, terminate: bool = False) -> Iterator[Executor | None]:
    """A context manager for an executor with `workers` local processes; None for one worker, the process itself.

    `one_thread_each` limits the linear algebra of each worker to one thread, unless the environment states a number.
    If the block is left by an exception, the workers stop between two runs, or at once with `terminate`, for tasks
    that write nothing; if this process is killed, they exit.
    Raises InputError for a number of workers below 1.
    """
    if workers < 1:
        raise InputError(f"workers is {workers}; it must be at least 1.")
    if workers == 1:
        yield None
        return
    context = multiprocessing.get_context("spawn")  # a forked copy of a process with threads may deadlock
    stop_event = context.Event()
    executor = _ProcessPool(workers, mp_context=context, initializer=_initialise_worker,
                            initargs=(stop_event, current_units()))  # fmt: skip
    try:
        with _one_thread_each() if one_thread_each else contextlib.nullcontext():
            executor.submit(os.getpid)  # starts the workers
        yield executor
    except BaseException:
        stop_event.set()
        if terminate:
            executor.terminate()
        raise
    finally:
        executor.shutdown(cancel_futures=True)


@contextlib.contextmanager
def _one_thread_each() -> Iterator[None]:
    """One thread for linear algebra in the processes that are started in the block."""
    added = [name for name in _BLAS_THREADS if name not in os.environ]
    os.environ.update(dict.fromkeys(added, "1"))
    try:
        yield
    finally:
        for name in added:
            del os.environ[name]


class _ProcessPool(ProcessPoolExecutor):
    """A pool that blocks SIGINT while a worker starts, until the worker ignores the signal.

    A terminal sends SIGINT to all processes: a worker interrupted during its imports would print a traceback. And if
    `submit` were interrupted before it starts the thread that manages the workers, the workers would never exit.
    """

    def submit(self, *task: Any, **arguments: Any) -> Future[Any]:
        with _sigint_blocked():
            return super().submit(*task, **arguments)

    def terminate(self) -> None:
        """End all workers at once; their tasks are lost."""
        for process in list((self._processes or {}).values()):
            process.terminate()


@contextlib.contextmanager
def _sigint_blocked() -> Iterator[None]:
    """Block SIGINT within the block, in this process and in the processes started in it."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _initialise_worker(stop_event: Any, units: tuple[str, ...] | None) -> None:
    """Make a worker ignore SIGINT, which its parent handles, exit with its parent, and have its display units."""
    if units is not None:
        display(*units)
    global _stop_event  # noqa: PLW0603  set once, at the start of the worker
    _stop_event = stop_event
    threading.Thread(target=_exit_with_parent, name="parent watchdog", daemon=True).start()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def _exit_with_parent() -> None:
    """End this worker as soon as its parent has ended; a killed parent cannot stop its workers.

    The parent holds the other end of a pipe, which the operating system closes when the parent ends.
    """
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def check_running() -> None:
    """Raise KeyboardInterrupt in a worker whose pool has been stopped."""
    if _stop_event is not None and _stop_event.is_set():
        raise KeyboardInterrupt

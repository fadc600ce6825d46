"""Executors: the process itself, local processes, or a Dask cluster.

Each function provides an executor of `concurrent.futures`, or None for the process itself; any other executor of this
interface may be used as well.
"""

from __future__ import annotations

import contextlib
import importlib
import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from typing import Any

from ..core.errors import InputError

CONNECT_TIMEOUT = 10.0
"""Time limit for the first response of a scheduler [s] (chosen)."""
_stop_event: Any = None


def available_cores() -> int:
    """The number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextlib.contextmanager
def process_pool(workers: int) -> Iterator[Executor | None]:
    """A context manager for an executor with `workers` local processes; None for one worker, the process itself.

    If the block is left by an exception, the workers stop between two runs; if this process is killed, they exit.
    Raises InputError for a number of workers below 1.
    """
    if workers < 1:
        raise InputError(f"workers is {workers}; it must be at least 1.")
    if workers == 1:
        yield None
        return
    context = multiprocessing.get_context("spawn")  # a forked copy of a process with threads may deadlock
    stop_event = context.Event()
    executor = _ProcessPool(workers, mp_context=context, initializer=_initialise_worker, initargs=(stop_event,))
    try:
        yield executor
    except BaseException:
        stop_event.set()
        raise
    finally:
        executor.shutdown(cancel_futures=True)


class _ProcessPool(ProcessPoolExecutor):
    """A pool that blocks SIGINT while a worker starts, until the worker ignores the signal.

    A terminal sends SIGINT to all processes: a worker interrupted during its imports would print a traceback. And if
    `submit` were interrupted before it starts the thread that manages the workers, the workers would never exit.
    """

    def submit(self, *task: Any, **arguments: Any) -> Future[Any]:
        with _sigint_blocked():
            return super().submit(*task, **arguments)


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


def _initialise_worker(stop_event: Any) -> None:
    """Make a worker ignore SIGINT, which its parent handles, and exit together with its parent."""
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


@contextlib.contextmanager
def dask_cluster(address: str) -> Iterator[Executor]:
    """A context manager for the workers of a running Dask cluster, given the address of its scheduler.

    The workers read the study from the same path and need the same version of airmuscle. Raises InputError if the
    scheduler does not respond or has no workers.
    """
    try:
        distributed = importlib.import_module("distributed")
    except ImportError:
        raise InputError(
            "a Dask cluster requires the packages dask and distributed. Install them: pip install airmuscle[cluster]"
        ) from None
    try:
        client = distributed.Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(
            f"no response from a Dask scheduler at '{address}' ({type(error).__name__}). Start one with "
            "`dask scheduler` and specify the address that it prints, such as tcp://host:8786."
        ) from None
    with client, client.get_executor(pure=False) as executor:
        if not client.scheduler_info()["workers"]:
            raise InputError(f"the Dask cluster at '{address}' has no workers. Start one: dask worker {address}")
        yield executor

"""Where runs are carried out: in this process, in others on this machine, or on a Dask cluster.

Each gives an executor of `concurrent.futures`, or None for this very process; any other executor serves as well.
"""

from __future__ import annotations

import contextlib
import importlib
import multiprocessing
import os
import signal
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from typing import Any

from ..core.errors import InputError

CONNECT_TIMEOUT = 10.0
"""Seconds that a scheduler has for its first answer (chosen)."""
_stop: Any = None


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextlib.contextmanager
def process_pool(workers: int) -> Iterator[Executor | None]:
    """As many processes on this machine; one needs none but this. Leaving by an error stops them between two runs."""
    if workers < 1:
        raise InputError(f"workers is {workers}; at least one is needed.")
    if workers == 1:
        yield None
        return
    context = multiprocessing.get_context("spawn")  # a copy of a process that has threads may hang
    stop = context.Event()
    executor = _ProcessPool(workers, mp_context=context, initializer=_initialise_worker, initargs=(stop,))
    try:
        yield executor
    except BaseException:
        stop.set()
        raise
    finally:
        executor.shutdown(cancel_futures=True)


class _ProcessPool(ProcessPoolExecutor):
    """Ctrl-C waits while a worker is started, as `submit` does, and until the worker can say that it does not listen.

    A terminal tells all processes: one that is still importing would die with a traceback of its own. And a worker
    without the thread that tells workers to leave, which `submit` starts after it, would never end.
    """

    def submit(self, *task: Any, **named: Any) -> Future[Any]:
        with _sigint_blocked():
            return super().submit(*task, **named)


@contextlib.contextmanager
def _sigint_blocked() -> Iterator[None]:
    """Ctrl-C waits until the block is left, here and in the processes that begin in it."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _initialise_worker(stop: Any) -> None:
    """A worker leaves Ctrl-C to the process that it works for."""
    global _stop  # noqa: PLW0603  a worker is told once, when it begins
    _stop = stop
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def check_running() -> None:
    """Raise KeyboardInterrupt in a worker that is to stop."""
    if _stop is not None and _stop.is_set():
        raise KeyboardInterrupt


@contextlib.contextmanager
def dask_cluster(address: str) -> Iterator[Executor]:
    """The workers of a running Dask cluster, by its scheduler's address. Raises InputError where none answers.

    Workers read the study from the same path, and need the same airmuscle.
    """
    try:
        distributed = importlib.import_module("distributed")
    except ImportError:
        raise InputError(
            "a Dask cluster needs the packages dask and distributed. Install them: pip install airmuscle[cluster]"
        ) from None
    try:
        client = distributed.Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(
            f"no Dask scheduler answers at '{address}' ({type(error).__name__}). Start one, `dask scheduler`, and "
            "name its address as it prints it, like tcp://host:8786."
        ) from None
    with client, client.get_executor(pure=False) as executor:
        if not client.scheduler_info()["workers"]:
            raise InputError(f"the Dask cluster at '{address}' has no workers. Start one: dask worker {address}")
        yield executor

"""Executors beyond the processes of one machine: a Dask cluster, and a folder that processes share
without a server.

An executor has the interface of `concurrent.futures`; local processes are those of
`engine.processes`.
"""

import contextlib
import contextvars
import hashlib
import importlib
import math
import os
import pickle
import socket
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from pathlib import Path
from typing import Any, NamedTuple

from ..core import FileError, InputError, atomic_file, check_writable, program_fingerprint
from .distribution import Claims
from .processes import available_cores, process_pool, stop_events

CONNECT_TIMEOUT = 10.0
"""Time limit for the first response of a scheduler [s] (chosen)."""
_POLL = 0.1
"""Interval at which the folder is read [s] (chosen)."""


@contextlib.contextmanager
def dask_cluster(address: str) -> Iterator[Executor]:
    """A context manager for the workers of a running Dask cluster, given the address of its
    scheduler.

    The workers read the study from the same path and need the same version of airmuscle. Raises
    InputError if the scheduler does not respond or has no workers.
    """
    try:
        distributed = importlib.import_module("distributed")
    except ImportError:
        raise InputError(
            "a Dask cluster requires the packages dask and distributed. Install them: pip install"
            " airmuscle[cluster]"
        ) from None

    async def connect() -> None:
        client = distributed.Client(
            address, timeout=CONNECT_TIMEOUT, set_as_default=False, asynchronous=True
        )
        try:
            await client
        finally:
            await client.close()

    # A client that fails to connect is closed only where it is asynchronous. The thread is for
    # notebooks, whose own has a running loop.
    try:
        with ThreadPoolExecutor(1) as thread:
            thread.submit(importlib.import_module("asyncio").run, connect()).result()
    except (OSError, ValueError, TypeError, ImportError) as error:
        raise InputError(
            f"no response from a Dask scheduler at '{address}' ({type(error).__name__}: {error})."
            " Start one with `dask scheduler` and specify the address that it prints, such as"
            " tcp://host:8786."
        ) from None
    client = distributed.Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False)
    with client, client.get_executor(pure=False) as executor:
        if not client.scheduler_info()["workers"]:
            raise InputError(
                f"the Dask cluster at '{address}' has no workers. Start one: dask worker {address}"
            )
        yield executor


@contextlib.contextmanager
def shared_folder(folder: Path | str, workers: int | None = None) -> "Iterator[SharedFolder]":
    """A context manager for the executor of a folder that several processes share, on any machines.

    folder   a folder of a file system that all processes see; it is created if it is missing
    workers  number of local processes of this one, by default one per core; 1: a thread of this
             process itself

    Each process runs the same program with the same input. Each task is computed by the process
    that claims it first; its result is stored in the folder, where the others read it. The claim of
    a process that has ended is taken over after 6 s. As results are addressed by the content of the
    task and by the version of the program, they do not depend on the number of processes, and a
    later call continues where all processes were ended. Raises FileError for a folder that cannot
    be written to, InputError for a number of workers below 1.
    """
    count = available_cores() if workers is None else workers
    check_writable(folder, shared=True)
    with _own_thread() if count == 1 else process_pool(count, one_thread_each=True) as local:
        assert local is not None
        executor = SharedFolder(Path(folder), local, count)
        try:
            yield executor
        except BaseException:
            executor.shutdown(cancel_futures=True)
            raise
        executor.shutdown()


@contextlib.contextmanager
def _own_thread() -> Iterator[Executor]:
    """A context manager for a thread that computes; if the block is left by an exception, it stops
    between two runs.
    """
    stop_events.append(stopped := threading.Event())
    context = contextvars.copy_context()  # with the display units of a block
    executor = ThreadPoolExecutor(
        1, "worker", lambda: [name.set(value) for name, value in context.items()]
    )
    try:
        yield executor
    except BaseException:
        stopped.set()
        raise
    finally:
        executor.shutdown(cancel_futures=True)
        stop_events.remove(stopped)


class _Task(NamedTuple):
    """A submitted call, and its future for the caller."""

    key: str
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    named: Mapping[str, Any]
    future: Future[Any]


class SharedFolder(Executor):
    """An executor whose tasks are distributed among the processes that have opened the same folder.

    `contributions` states how many results came from whom: the machine and process number, and the
    count.

    Results are pickled Python objects: a file that belongs to another user of the machine is
    refused, and whoever can write to the folder can run code in the processes that read it.
    """

    def __init__(self, folder: Path, local: Executor, slots: int) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._folder = folder
        self._local = local
        self._slots = slots
        self._name = f"{socket.gethostname()}:{os.getpid()}"
        self._claims = Claims(folder, self._name)
        self._pending: list[_Task] = []
        self._running: dict[Future[Any], _Task] = {}
        self._read_at = -math.inf
        self._changed = threading.Condition()
        self._closed = self._stopped = False
        self._thread: threading.Thread | None = None
        self.contributions: Counter[str] = Counter()

    @property
    def left(self) -> int:
        """Number of submitted tasks without a result."""
        return len(self._pending) + len(self._running)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Schedule `fn(*args, **kwargs)`; the future has its result, whichever process computed
        it.
        """
        code = getattr(
            getattr(fn, "__code__", None), "co_code", b""
        )  # of a function that is not of this program
        content = (
            program_fingerprint(),
            fn.__module__,
            fn.__qualname__,
            code,
            args,
            sorted(kwargs.items()),
        )
        task = _Task(
            hashlib.sha256(pickle.dumps(content, protocol=5)).hexdigest(),
            fn,
            args,
            kwargs,
            Future(),
        )
        with self._changed:
            if self._closed:
                raise RuntimeError("the executor of the shared folder is closed")
            self._pending.append(task)
            if self._thread is None:
                self._thread = threading.Thread(
                    target=self._serve, name="shared folder", daemon=True
                )
                self._thread.start()
            self._changed.notify()
        return task.future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the executor when its tasks are completed; with `cancel_futures`, release its claims
        at once.
        """
        with self._changed:
            self._closed = True
            self._stopped = self._stopped or cancel_futures
            self._changed.notify()
        if self._thread is not None and wait:
            self._thread.join()

    def _serve(self) -> None:
        """Claim, compute and collect tasks until the executor is closed."""
        try:
            while self._wait():
                self._collect_results()
                self._start_tasks()
                self._store_results()
                self._claims.renew()
        except BaseException as error:  # handed on to the callers, who wait for it
            for task in [*self._pending, *self._running.values()]:
                if not task.future.done():
                    task.future.set_exception(error)
        finally:
            for future, task in self._running.items():
                future.cancel()
                task.future.cancel()
            for task in self._pending:
                task.future.cancel()
            self._claims.release_all()

    def _wait(self) -> bool:
        """Wait for a change, a completed task or the next reading of the folder; false if there is
        nothing left.
        """
        with self._changed:
            if not self._pending and not self._running and not self._closed:
                self._changed.wait()
            if self._stopped or (self._closed and not self._pending and not self._running):
                return False
        if self._running:
            wait(self._running, timeout=_POLL, return_when=FIRST_COMPLETED)
        else:
            time.sleep(_POLL if self._claims.contended else 0.0)
        return True

    def _collect_results(self) -> None:
        """Complete the tasks whose results are in the folder, which is read at intervals."""
        if time.monotonic() - self._read_at < _POLL:
            return
        self._read_at = time.monotonic()
        stored = {entry.name for entry in os.scandir(self._folder)}
        for task in list(self._pending):
            if task.future.cancelled():
                self._pending.remove(task)
            elif f"{task.key}.result" in stored and (found := self._read(task.key)) is not None:
                self._pending.remove(task)
                source, result = found
                self._complete(task, source, result)

    def _start_tasks(self) -> None:
        """Claim pending tasks for all free slots."""
        self._claims.contended = False
        for task in list(self._pending):
            if len(self._running) >= self._slots:
                return
            if not self._claims.take(task.key):
                continue
            self._pending.remove(task)
            if (found := self._read(task.key)) is not None:  # completed since the folder was read
                self._complete(task, *found)
                self._claims.release(task.key)
            else:
                self._running[self._local.submit(task.function, *task.arguments, **task.named)] = (
                    task
                )
        self._claims.contended = bool(self._pending)

    def _store_results(self) -> None:
        """Store the results of completed tasks, and hand them on."""
        for future in [each for each in self._running if each.done()]:
            task = self._running.pop(future)
            try:
                result = future.result()
                with atomic_file(self._path(task.key)) as unfinished:
                    unfinished.write_bytes(pickle.dumps((self._name, result), protocol=5))
            except OSError as error:
                reason = error.strerror or str(error)
                task.future.set_exception(
                    FileError(f"{self._folder}: cannot be written to: {reason}. Free space.")
                )
            except BaseException as error:
                task.future.set_exception(error)
            else:
                self._complete(task, self._name, result)
            self._claims.release(task.key)

    def _complete(self, task: _Task, source: str, result: Any) -> None:
        self.contributions[source] += 1
        if task.future.set_running_or_notify_cancel():
            task.future.set_result(result)

    def _path(self, key: str) -> Path:
        return self._folder / f"{key}.result"

    def _read(self, key: str) -> tuple[str, Any] | None:
        """The source and the result of a task; None where there is none, or a damaged one, which is
        computed again.
        """
        path = self._path(key)
        try:
            if hasattr(os, "getuid") and path.stat().st_uid != os.getuid():
                raise FileError(
                    f"{path}: belongs to another user. Specify a folder to which only you can"
                    " write."
                )
            source, result = pickle.loads(path.read_bytes())
        except (
            OSError,
            EOFError,
            pickle.UnpicklingError,
            ValueError,
            AttributeError,
            ImportError,
            IndexError,
        ):
            return None
        return source, result

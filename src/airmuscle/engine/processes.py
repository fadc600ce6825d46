"""Local processes: a pool for many equal runs, and a worker for single tasks with a limit of time.

They are started afresh, not as copies of this process, and end together with it.
"""

import atexit
import contextlib
import contextvars
import multiprocessing
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from typing import IO, Any

from ..core import BLAS_THREADS, AirmuscleError, InputError, current_units, one_thread
from ..core.display import display

Workers = int | Executor
"""Number of local processes, or an executor of `concurrent.futures`."""
stop_events: list[Any] = []
"""Events that stop what this process computes for a pool, between two runs."""
_share: list[int | None] = [None]
"""Cores of a worker: those of its parent, divided among its workers."""
START_LIMIT = 60.0
"""Limit [s] of the start of a worker with its imports (chosen)."""
_START = (
    f"import sys; sys.path[:] = sys.argv[1:]; from {__name__} import serve_tasks; serve_tasks()"
)
Report = Callable[..., None]
"""Receives the progress of a task, with the arguments that the task states."""


def available_cores() -> int:
    """The number of cores that this process may use; that of a worker is its share of those of its
    parent.
    """
    if _share[0] is not None:
        return _share[0]
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextlib.contextmanager
def process_pool(
    workers: Workers, *, one_thread_each: bool = False, terminate: bool = False
) -> Iterator[Executor | None]:
    """A context manager for an executor with `workers` local processes; None for one worker, the
    process itself.

    If `workers` is an executor, such as that of a cluster, it is yielded and remains open.
    `one_thread_each` limits the linear algebra of each worker to one thread, also of the process
    itself, unless the environment states a number. If the block is left by an exception, the
    workers stop between two runs, or at once with `terminate`, for tasks that write nothing; if
    this process is killed, they exit. Raises InputError for a number of workers below 1.
    """
    if isinstance(workers, Executor):
        yield workers
        return
    if workers < 1:
        raise InputError(f"workers is {workers}; it must be at least 1.")
    if workers == 1:
        with one_thread() if one_thread_each else contextlib.nullcontext():
            yield None
        return
    context = multiprocessing.get_context(
        "spawn"
    )  # a forked copy of a process with threads may deadlock
    stop_event = context.Event()
    executor = _ProcessPool(
        workers,
        mp_context=context,
        initializer=_initialise_worker,
        initargs=(stop_event, current_units(), max(1, available_cores() // workers)),
    )
    added = [name for name in BLAS_THREADS if one_thread_each and name not in os.environ]
    try:
        os.environ.update(dict.fromkeys(added, "1"))
        try:
            for _ in range(workers):  # each starts a worker, as none is idle yet
                executor.submit(os.getpid)
        finally:
            for name in added:
                del os.environ[name]
        yield executor
    except BaseException:
        stop_event.set()
        if terminate:
            executor.terminate()
        raise
    finally:
        executor.shutdown(cancel_futures=True)


@contextlib.contextmanager
def thread_pool(threads: int) -> Iterator[Executor]:
    """A context manager for an executor with threads of this process, whose tasks call
    `check_running`; if the block is left by an exception, they stop there.
    """
    stop_events.append(stopped := threading.Event())
    executor = _ContextThreads(threads, "worker")
    try:
        yield executor
    except BaseException:
        stopped.set()
        raise
    finally:
        executor.shutdown(cancel_futures=True)
        stop_events.remove(stopped)


class _ContextThreads(ThreadPoolExecutor):
    """Threads whose tasks have the context of their caller: the store of results, the watch over
    searches."""

    def submit(self, *task: Any, **arguments: Any) -> Future[Any]:
        return super().submit(contextvars.copy_context().run, *task, **arguments)


class _ProcessPool(ProcessPoolExecutor):
    """A pool that blocks SIGINT while a worker starts, until the worker ignores the signal.

    A terminal sends SIGINT to all processes: a worker interrupted during its imports would print a
    traceback. And if `submit` were interrupted before it starts the thread that manages the
    workers, the workers would never exit.
    """

    def submit(self, *task: Any, **arguments: Any) -> Future[Any]:
        if not hasattr(signal, "pthread_sigmask"):  # Windows
            return super().submit(*task, **arguments)
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            return super().submit(*task, **arguments)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def terminate(self) -> None:
        """End all workers at once; their tasks are lost."""
        for process in list((self._processes or {}).values()):
            process.terminate()


def _initialise_worker(stop_event: Any, units: tuple[str, ...] | None, share: int) -> None:
    """Make a worker ignore SIGINT, which its parent handles, exit with its parent, and have its
    units and cores.
    """
    if units is not None:
        display(*units)
    stop_events.append(stop_event)
    _share[0] = share
    threading.Thread(target=_exit_with_parent, name="parent watchdog", daemon=True).start()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def _exit_with_parent() -> None:
    """End this worker as soon as its parent has ended; a killed parent cannot stop its workers."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        # until the operating system closes a pipe, of which the parent holds the other end
        parent.join()
        os._exit(1)


def check_running() -> None:
    """Raise KeyboardInterrupt in a worker whose pool has been stopped."""
    if any(event.is_set() for event in stop_events):
        raise KeyboardInterrupt


class WorkerError(AirmuscleError):
    """The process of a worker ended without a result; `late` if because it exceeded the limit of
    time.
    """

    def __init__(
        self, message: str = "the process ended without a result.", *, late: bool = False
    ) -> None:
        super().__init__(message)
        self.late = late


class Worker:
    """A process that runs one task at a time; if it has ended, the next task starts another one.

    prepare  function that a new process calls before its first task
    quiet    whether what the process writes to the standard error is discarded

    Unlike those of `process_pool` and of pebble, the process does not import the program of the
    caller, a file of a user that may call this one without `if __name__ == "__main__"`.
    """

    def __init__(self, prepare: Callable[[], object] | None = None, *, quiet: bool = False) -> None:
        self._prepare = prepare
        self._quiet = quiet
        self._process: Any = None
        self._lock = threading.Lock()

    def call(
        self,
        task: Callable[..., Any],
        arguments: tuple[Any, ...],
        limit: float,
        report: Report | None = None,
    ) -> Any:
        """The result of `task(*arguments)`. Raises what the task raises; WorkerError after `limit`
        [s].

        With `report`, the task receives as last argument a function for its progress, and `report`
        what it is told. Functions, arguments and results are pickled.
        """
        process = self._process
        if process is None or process.poll() is not None:
            process = self._start()
        if report is not None:
            report(
                0.0, "starting"
            )  # a task that was cancelled while the process was started ends here
        return self._ask(process, (task, arguments, report is not None), limit, report)

    def _start(self) -> Any:
        self.stop()
        with self._lock:
            self._process = process = subprocess.Popen(
                [sys.executable, "-c", _START, *sys.path],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL if self._quiet else None,
            )
        atexit.register(self.stop)
        self._ask(process, (self._prepare or os.getpid, (), False), START_LIMIT)
        return process

    def _ask(
        self, process: Any, request: tuple[Any, ...], limit: float, report: Report | None = None
    ) -> Any:
        expired = threading.Event()
        timer = threading.Timer(limit, _end, (process, expired))
        timer.start()
        try:
            _write(pickle.dumps(request), process.stdin)
            while True:
                is_progress, content = pickle.loads(pickle.load(process.stdout))
                if not is_progress:
                    break
                if report is not None:
                    report(*content)
        except (
            EOFError,
            OSError,
            ValueError,
            pickle.UnpicklingError,
        ):  # ValueError: another thread closed the pipe
            self.stop()
            raise WorkerError(late=expired.is_set()) from None
        except (
            BaseException
        ):  # an interruption, after which the answer would be that to the next request
            self.stop()
            raise
        finally:
            timer.cancel()
        result, error = content
        if error is not None:
            raise error
        return result

    def kill(self) -> None:
        """End the process from another thread; the call that waits for it raises WorkerError."""
        with self._lock:
            process = self._process
        if process is not None:
            _end(process)

    def stop(self) -> None:
        """End the process; several threads may do so, of which one closes its pipes."""
        with self._lock:
            process = self._process
            self._process = None
        if process is None:
            return
        atexit.unregister(self.stop)
        _end(process)
        for pipe in (process.stdin, process.stdout):
            with contextlib.suppress(OSError):
                pipe.close()


def _end(process: Any, ended: threading.Event | None = None) -> None:
    if ended is not None:
        ended.set()
    process.kill()
    process.wait()


def _write(content: bytes, stream: Any) -> None:
    pickle.dump(content, stream)
    stream.flush()


def serve_tasks() -> None:
    """Run the tasks that arrive at the standard input; what they print goes to the standard
    error.
    """
    signal.signal(
        signal.SIGINT, signal.SIG_IGN
    )  # a terminal sends it to all processes; the parent ends this one
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    requests: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_receive, args=(requests,), name="requests", daemon=True).start()
    while True:
        _write(_answer(requests.get(), answers), answers)


def _receive(requests: queue.SimpleQueue[bytes]) -> None:
    """Pass on requests; end the process, also during a task, when the parent closes the pipe or
    ends.
    """
    with contextlib.suppress(EOFError, OSError):
        while True:
            requests.put(pickle.load(sys.stdin.buffer))
    os._exit(0)


def _answer(request: bytes, answers: IO[bytes]) -> bytes:
    """The pickled result of a task, or the exception that it raised."""
    try:
        task, arguments, reports = pickle.loads(request)
        if reports:
            arguments = (
                *arguments,
                lambda *progress: _write(pickle.dumps((True, progress)), answers),
            )
        return pickle.dumps((False, (task(*arguments), None)), protocol=pickle.HIGHEST_PROTOCOL)
    except Exception as error:  # raised by the caller
        return pickle.dumps((False, (None, error)))

"""Workers of a Dask cluster as an executor of `concurrent.futures`.

The cluster runs already, and is named by the address of its scheduler or by its scheduler file; or
a TOML file names a class of `dask.distributed` or `dask_jobqueue` that starts it.
"""

import contextlib
import importlib
import json
import logging
import sys
import threading
import tomllib
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

from ..core import (
    AirmuscleError,
    FileError,
    InputError,
    SimulationError,
    install_command,
    program_fingerprint,
)

CONNECT_TIMEOUT = 10.0
"""Time limit for the first response of a scheduler [s] (chosen)."""
NO_WORKERS_INTERVAL = 10.0
"""Interval at which it is said that a cluster has no workers [s] (chosen)."""
CLUSTER_MODULES = ("dask.distributed", "dask_jobqueue")
"""Modules whose classes a TOML file may name."""
CLUSTER_KEYS = ("class", "workers", "arguments")
OTHER_VERSION = (
    "a worker of the cluster runs another version of airmuscle or of its packages than this"
    " command. Install the same version where the workers run, and start them again."
)

Say = Callable[[str], object]


def _print_error(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


class ClusterFile(NamedTuple):
    """A cluster that is started for one command: the class, the number of its workers, and the
    arguments of the class.
    """

    module: str
    name: str
    workers: int
    arguments: Mapping[str, Any]


@contextlib.contextmanager
def dask_cluster(where: str | Path, say: Say = _print_error) -> Iterator[Executor]:
    """A context manager for the workers of a Dask cluster.

    where  address of a scheduler, such as tcp://host:8786 or tls://host:8786; a scheduler file
           (.json), which `dask scheduler --scheduler-file` writes; or a TOML file with `class`, a
           cluster class of dask.distributed or dask_jobqueue, `workers` and the table `arguments`,
           whose cluster ends with the block
    say    called every 10 s with a sentence while tasks wait and there is no worker

    The workers read files from the same paths and need the same version of airmuscle. Keys and
    certificates of tls:// are those of Dask's own configuration. Raises InputError if the scheduler
    does not respond, FileError for a file that names no cluster. A future raises SimulationError
    if the scheduler is lost, or if a task ends the workers that compute it.
    """
    distributed = _import_distributed()
    name = str(where)
    with contextlib.ExitStack() as stack:
        stack.enter_context(_without_client_logs())
        if name.endswith(".toml"):
            target: Any = stack.enter_context(_started(read_cluster_file(Path(name))))
            start = f"see the jobs that {name} describes"
        elif name.endswith(".json"):
            target = _address_in(Path(name))
            start = f"start one: dask worker --scheduler-file {name}"
        else:
            target = name
            start = f"start one: dask worker {name}"
        if isinstance(target, str):
            _check_response(distributed, target)
        client = stack.enter_context(
            distributed.Client(target, timeout=CONNECT_TIMEOUT, set_as_default=False)
        )
        executor = ClusterExecutor(client, name, start, say)
        try:
            yield executor
        except BaseException:
            executor.shutdown(wait=False, cancel_futures=True)
            raise
        executor.shutdown(wait=False)


@contextlib.contextmanager
def _without_client_logs() -> Iterator[None]:
    """A context manager without the tracebacks that Dask logs where this module raises an error."""
    loggers = [logging.getLogger(name) for name in ("distributed.client", "distributed.core")]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, before, strict=True):
            logger.setLevel(level)


def _import_distributed() -> Any:
    try:
        return importlib.import_module("distributed")
    except ImportError:
        raise InputError(
            "a Dask cluster requires the packages dask and distributed. Install them:"
            f" {install_command('cluster')}"
        ) from None


def _check_response(distributed: Any, address: str) -> None:
    """Raise InputError unless a scheduler responds."""

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


def _address_in(path: Path) -> str:
    """The address in a scheduler file. Raises FileError."""
    try:
        address = json.loads(path.read_text(encoding="utf-8"))["address"]
    except OSError as error:
        raise FileError(
            f"{path}: cannot be read ({error.strerror or error}). Start a scheduler that writes it:"
            f" dask scheduler --scheduler-file {path}"
        ) from None
    except (ValueError, KeyError, TypeError):
        address = None
    if not isinstance(address, str):
        raise FileError(
            f"{path}: is no scheduler file of Dask, which states an address. Write one: dask"
            f" scheduler --scheduler-file {path}"
        )
    return address


def read_cluster_file(path: Path) -> ClusterFile:
    """The cluster that a TOML file describes. Raises FileError."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise FileError(f"{path}: cannot be read ({error.strerror or error}).") from None
    except ValueError as error:
        raise FileError(f"{path}: is not valid TOML ({error}).") from None
    allowed = " or ".join(f"{module}.NAME" for module in CLUSTER_MODULES)
    if unknown := sorted(set(content) - set(CLUSTER_KEYS)):
        raise FileError(
            f"{path}: unknown key '{unknown[0]}'; the keys are {', '.join(CLUSTER_KEYS)}."
        )
    full = content.get("class")
    module, _, name = full.rpartition(".") if isinstance(full, str) else ("", "", "")
    if module not in CLUSTER_MODULES or not name.endswith("Cluster"):
        raise FileError(
            f"{path}: class is {full!r}; it must be a cluster class, {allowed}, such as"
            ' "dask_jobqueue.SLURMCluster" or "dask.distributed.LocalCluster".'
        )
    workers = content.get("workers")
    if isinstance(workers, bool) or not isinstance(workers, int) or workers < 1:
        raise FileError(
            f"{path}: workers is {workers!r}; it must be the number of workers, 1 or more."
        )
    arguments = content.get("arguments", {})
    if not isinstance(arguments, dict):
        raise FileError(
            f"{path}: arguments is {arguments!r}; it must be a table, [arguments], of the arguments"
            f" of {full}."
        )
    return ClusterFile(module, name, workers, arguments)


@contextlib.contextmanager
def _started(described: ClusterFile) -> Iterator[Any]:
    """A context manager for a cluster that is started, and ended with the block."""
    full = f"{described.module}.{described.name}"
    try:
        module = importlib.import_module(described.module)
    except ImportError:
        package = described.module.replace("_", "-")
        raise InputError(
            f"{full} requires the package {package}. Install it: pip install {package}"
        ) from None
    base = importlib.import_module("distributed.deploy").Cluster
    kind = getattr(module, described.name, None)
    if not isinstance(kind, type) or not issubclass(kind, base):
        raise InputError(f"{described.module} has no cluster class {described.name}.")
    # Local workers are started at once, so that wrong arguments are an error here.
    is_local = described.name == "LocalCluster"
    at_once = {"n_workers": described.workers} if is_local else {}
    try:
        cluster = kind(**{**described.arguments, **at_once})
    except Exception as error:  # of the class, by the arguments of a user
        raise InputError(
            f"{full} cannot be started with these arguments ({type(error).__name__}: {error})."
            " Correct the table [arguments]."
        ) from None
    with cluster:
        if not is_local:
            cluster.scale(described.workers)
        yield cluster


class ClusterExecutor(Executor):
    """An executor whose tasks run on the workers of a Dask cluster; its futures are those of
    `concurrent.futures`, with one sentence for each failure of the cluster.
    """

    def __init__(self, client: Any, name: str, start: str, say: Say) -> None:
        self._client = client
        self._name = name
        self._start = start
        self._say = say
        self._pending: dict[Future[Any], Any] = {}
        self._closed = threading.Event()
        self._watch = threading.Thread(target=self._say_no_workers, name="workers", daemon=True)
        self._watch.start()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Schedule `fn(*args, **kwargs)` on a worker."""
        future: Future[Any] = Future()
        try:
            program = program_fingerprint(())
            task = self._client.submit(_call_same_version, program, fn, args, kwargs, pure=False)
        except Exception as error:  # the client has lost its scheduler
            future.set_exception(self._failure(error))
            return future
        self._pending[future] = task
        task.add_done_callback(lambda done: self._complete(future, done))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the executor; the cluster remains."""
        self._closed.set()
        for future, task in list(self._pending.items()) if cancel_futures else []:
            future.cancel()
            with contextlib.suppress(Exception):  # the scheduler is lost
                task.cancel()
        if wait:
            self._watch.join()

    def _complete(self, future: Future[Any], task: Any) -> None:
        self._pending.pop(future, None)
        if not future.set_running_or_notify_cancel():
            with contextlib.suppress(Exception):  # the scheduler is lost
                task.cancel()
            return
        try:
            result = task.result()
        except BaseException as error:
            future.set_exception(self._failure(error))
        else:
            future.set_result(result)

    def _failure(self, error: BaseException) -> BaseException:
        """What is raised for the failure of a task: its own exception, or a sentence for one of the
        cluster.
        """
        kinds = {kind.__name__ for kind in type(error).__mro__}
        if isinstance(error, AirmuscleError | KeyboardInterrupt):
            return error
        if "KilledWorker" in kinds:
            return SimulationError(
                "a task ended every worker of the cluster that computed it, possibly for lack of"
                " memory. Give the workers more memory, or fewer tasks at a time, and run the same"
                " command again."
            )
        if kinds & {"CancelledError", "CommClosedError", "FutureCancelledError", "TimeoutError"}:
            return SimulationError(
                f"the scheduler of the cluster '{self._name}' was lost. Start it again, and run the"
                " same command again."
            )
        if kinds & {"ImportError", "AttributeError", "UnpicklingError"} or "deserializ" in str(
            error
        ):
            return FileError(
                f"{OTHER_VERSION} (The worker reports: {type(error).__name__}: {error})"
            )
        return error

    def _say_no_workers(self) -> None:
        """Say at intervals that tasks wait for a worker."""
        while not self._closed.wait(NO_WORKERS_INTERVAL):
            with contextlib.suppress(Exception):  # the scheduler is lost, which the futures say
                if self._pending and not self._client.scheduler_info()["workers"]:
                    self._say(
                        f"the cluster '{self._name}' has no workers, {len(self._pending)} tasks"
                        f" wait: {self._start}"
                    )


def _call_same_version(
    program: str, function: Callable[..., Any], arguments: Any, named: Mapping[str, Any]
) -> Any:
    """The result of a call, in a worker that runs the same program."""
    if program_fingerprint(()) != program:
        raise FileError(OTHER_VERSION)
    return function(*arguments, **named)

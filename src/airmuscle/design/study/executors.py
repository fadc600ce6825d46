"""Executors of a study beyond local processes: a Dask cluster.

An executor has the interface of `concurrent.futures`; local processes are those of `engine.processes`.
"""

from __future__ import annotations

import contextlib
import importlib
from collections.abc import Iterator
from concurrent.futures import Executor

from ...core.errors import InputError

CONNECT_TIMEOUT = 10.0
"""Time limit for the first response of a scheduler [s] (chosen)."""


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

"""Distribution of independent calls by an executor, with input that they have in common."""

from __future__ import annotations

import functools
import pickle
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, as_completed
from typing import Any

from ..core.errors import SimulationError
from .processes import check_running

Call = Callable[[Any, Any], Any]


class DistributedCalls:
    """Calls `function(common, task)` by an executor, or one after the other in this process without one.

    `common` is pickled once, when the first call is sent, and loaded once by each worker. The function is one of a
    module; its result must not depend on which worker computes it, nor on the calls before.
    """

    def __init__(self, executor: Executor | None, function: Call, common: Any) -> None:
        self._executor, self._function, self._common = executor, function, common

    @functools.cached_property
    def _pickled(self) -> bytes:
        return pickle.dumps(self._common, protocol=5)

    def completed(self, tasks: Sequence[Any]) -> Iterator[tuple[int, Any]]:
        """The index of each task and its result, as they are completed. Raises what a call raises, SimulationError if a
        worker dies."""
        if self._executor is None:
            yield from ((i, self._function(self._common, task)) for i, task in enumerate(tasks))
            return
        futures: dict[Future[Any], int] = {}
        try:
            for i, task in enumerate(tasks):
                futures[self._executor.submit(_call, self._function, self._pickled, task)] = i
            for future in as_completed(futures):
                yield futures.pop(future), future.result()  # removed at once, to bound the memory of a long study
        except BrokenExecutor:
            raise SimulationError(
                "a worker process died, possibly for lack of memory. Run the same command again, with fewer workers."
            ) from None
        finally:
            for future in futures:
                future.cancel()

    def results(self, tasks: Sequence[Any], done: Callable[[int], object] = lambda count: None) -> list[Any]:
        """The results in the order of the tasks; `done` is called with the number of those that are completed."""
        found: list[Any] = [None] * len(tasks)
        for count, (i, result) in enumerate(self.completed(tasks), 1):
            found[i] = result
            done(count)
        return found


def _call(function: Call, pickled: bytes, task: Any) -> Any:
    check_running()
    return function(_load(pickled), task)


@functools.lru_cache(maxsize=1)
def _load(pickled: bytes) -> Any:
    return pickle.loads(pickled)

"""Distribution of independent calls by an executor, whose results a store may hold already."""

import functools
import pickle
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, as_completed
from typing import Any, TypeVar

from ..core import SimulationError
from .content import function_name
from .processes import check_running
from .result_store import TaskKeys, current_store

MAX_SUBMISSIONS = 512
"""Number of submissions into which many tasks are grouped (chosen: a submission to a cluster takes
milliseconds, whatever its tasks take)."""
Call = Callable[[Any, Any], Any]
Indexed = Iterator[tuple[int, Any]]
T = TypeVar("T")


class DistributedCalls:
    """Calls `function(common, task)` by an executor, or one after the other in this process without
    one.

    `common` is pickled once, when the first call is sent, and loaded once by each worker. The
    function is one of a module; its result must not depend on which worker computes it, nor on the
    calls before. Within `result_store`, results are taken from the store and added to it.
    """

    def __init__(
        self, executor: Executor | None, function: Call, common: Any, *, content: Any = None
    ) -> None:
        """`content` is what determines the results beside function and task, where `common` has
        more, such as a function for the progress.
        """
        self._executor = executor
        self._function = function
        self._common = common
        self._content = common if content is None else content

    @functools.cached_property
    def _pickled(self) -> bytes:
        return pickle.dumps(self._common, protocol=5)

    @functools.cached_property
    def _keys(self) -> TaskKeys:
        return TaskKeys(function_name(self._function), self._content)

    def completed(self, tasks: Sequence[Any], keys: Sequence[str | None] | None = None) -> Indexed:
        """Index and result of each task, as completed. Raises what a call raises; SimulationError
        at a crash.

        keys  those of the tasks in a store, where the result depends on less than function, common
        argument and task
        """
        store = current_store()
        if store is None:
            yield from self._computed(tasks)
            return
        keys = self._keys.of(tasks) if keys is None else keys
        missing = []
        for i, key in enumerate(keys):
            stored = None if key is None else store.load(key)
            if stored is None:
                missing.append(i)
            else:
                yield i, stored.value
        for place, result in self._computed([tasks[i] for i in missing]):
            key = keys[missing[place]]
            if key is not None:
                store.save(key, result)
            yield missing[place], result

    def _computed(self, tasks: Sequence[Any]) -> Indexed:
        """Index and result of each task, computed by the executor or here."""
        if self._executor is None:
            yield from ((i, self._function(self._common, task)) for i, task in enumerate(tasks))
            return
        size = -(-len(tasks) // MAX_SUBMISSIONS) or 1
        futures: dict[Future[Any], int] = {}
        try:
            for i in range(0, len(tasks), size):
                group = tasks[i : i + size]
                future = self._executor.submit(_call_each, self._function, self._pickled, group)
                futures[future] = i
            for future in as_completed(futures):
                # removed at once, to bound the memory of a long study
                yield from enumerate(future.result(), futures.pop(future))
        except BrokenExecutor:
            raise SimulationError(
                "a worker process died, possibly for lack of memory. Run the same command again,"
                " with fewer workers."
            ) from None
        finally:
            for future in futures:
                future.cancel()

    def results(
        self, tasks: Sequence[Any], done: Callable[[int], object] = lambda count: None
    ) -> list[Any]:
        """The results in the order of the tasks; `done` is called with the number of those that are
        completed.
        """
        results_of_tasks: list[Any] = [None] * len(tasks)
        for count, (i, result) in enumerate(self.completed(tasks), 1):
            results_of_tasks[i] = result
            done(count)
        return results_of_tasks


def stored_result(name: str, content: Any, compute: Callable[[], T]) -> T:
    """The result of a computation in this process: that in the store of the present block, if there
    is one, or that of `compute`, which is then stored.

    name, content  of the computation, and all that determines its result
    """
    store = current_store()
    (key,) = (None,) if store is None else TaskKeys(name, None).of([content])
    if store is None or key is None:
        return compute()
    stored = store.load(key)
    if stored is not None:
        result: T = stored.value
        return result
    result = compute()
    store.save(key, result)
    return result


def _call_each(function: Call, pickled: bytes, tasks: Sequence[Any]) -> list[Any]:
    """The results of a group of tasks, in a worker."""
    common = _load(pickled)
    results = []
    for task in tasks:
        check_running()
        results.append(function(common, task))
    return results


@functools.lru_cache(maxsize=1)
def _load(pickled: bytes) -> Any:
    return pickle.loads(pickled)

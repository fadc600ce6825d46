"""Watch over the searches of a fit: their progress, a budget of time, and checkpoints from which a
search that was killed goes on.

Every search of the bench asks `goes_on` at each of its evaluations. Within `watched_searches` these
are reported, and a search ends at the best values that it has found when the budget is spent.
Checkpoints are kept in the store of results (`engine.result_store`) of the present block: a search
that goes on from one ends at the same values, to the last bit, as one that was never killed.
"""

import contextlib
import dataclasses
import functools
import math
import time
import warnings
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from typing import Any

from ...core import AirmuscleWarning, ParameterError, abridged
from ...engine.processes import check_running
from ...engine.result_store import CHECKPOINT, TaskKeys, current_store

CHECKPOINT_INTERVAL = 5.0
"""Minimum time between two checkpoints of a search [s] (chosen: a checkpoint takes about 1 ms)."""


@dataclasses.dataclass(eq=False)
class SearchWatch:
    """What the searches of a block report to, and when they end."""

    report: Callable[[str, float], None]
    end: float
    """Time at which the budget is spent, of `time.monotonic` [s]."""
    stopped: set[str] = dataclasses.field(default_factory=set)
    """Searches that the budget ended."""

    @property
    def is_over(self) -> bool:
        """Whether the budget is spent."""
        return time.monotonic() >= self.end


_current: ContextVar[SearchWatch | None] = ContextVar("search_watch", default=None)


@contextlib.contextmanager
def watched_searches(
    report: Callable[[str, float], None] = lambda name, fraction: None,
    budget: float = math.inf,
) -> Iterator[SearchWatch]:
    """A context manager within which the searches of all fits report, and end after a time.

    report  called with the name of a search and the fraction of its evaluations, of which a search
            that converges needs a part only
    budget  time from the start of the block [s], after which a search ends at the best values that
            it has found; a warning names the searches that have not converged

    Searches in other processes do not report and have no budget. Raises ParameterError for a budget
    that is not positive.
    """
    if not budget > 0:
        raise ParameterError(
            f"watched_searches: the budget is {abridged(budget)}; it must be a positive time in s."
        )
    watch = SearchWatch(report, time.monotonic() + budget)
    token = _current.set(watch)
    try:
        yield watch
    finally:
        _current.reset(token)
    if watch.stopped:
        names = ", ".join(sorted(watch.stopped))
        number = "a search" if len(watch.stopped) == 1 else f"{len(watch.stopped)} searches"
        text = (
            f"the budget of {budget:g} s ended {number} before convergence ({names}): the result"
            " has the best values found until then, and its standard errors are not those of an"
            " optimum. Give a longer budget; a search with a store of results goes on from there."
        )
        warnings.warn(AirmuscleWarning(text), stacklevel=3)


def goes_on(name: str, fraction: float) -> bool:
    """Whether a search may go on; reports the fraction of its evaluations. Raises KeyboardInterrupt
    where its pool has been stopped."""
    check_running()
    watch = _current.get()
    if watch is None:
        return True
    watch.report(name, min(fraction, 1.0))
    if not watch.is_over:
        return True
    watch.stopped.add(name)
    return False


def is_budget_spent() -> bool:
    """Whether the budget of the present block is spent."""
    watch = _current.get()
    return watch is not None and watch.is_over


class Checkpoint:
    """The last state of a search in the store of the present block; without a store nothing is
    kept.
    """

    def __init__(self, name: str, content: Any) -> None:
        """`name` begins with the module of the search, `content` determines its result."""
        self._store = current_store()
        self._name = name
        self._content = content
        self._last = time.monotonic()
        self._is_kept = False

    @functools.cached_property
    def _key(self) -> str | None:
        (digest,) = TaskKeys(f"{self._name}:checkpoint", None).of([self._content])
        return None if digest is None else f"{CHECKPOINT}{digest}"

    def load(self) -> Any:
        """The state that was kept; None where there is none."""
        store = self._store
        if store is None or not store.has_checkpoints or self._key is None:
            return None
        stored = store.load(self._key)
        self._is_kept = stored is not None
        return None if stored is None else stored.value

    def save(self, state: Callable[[], Any], *, last: bool = False) -> None:
        """Keep a state, if the last one was kept long ago; also the `last` of a search of which
        one was kept.
        """
        if self._store is None:
            return
        is_due = time.monotonic() - self._last >= CHECKPOINT_INTERVAL
        if not is_due and not (last and self._is_kept):
            return
        if self._key is not None:
            self._store.save(self._key, state())
            self._is_kept = True
            self._last = time.monotonic()

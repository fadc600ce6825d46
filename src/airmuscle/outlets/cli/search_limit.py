"""Limit of the searches of a fit, --budget, with their progress and their checkpoints."""

import contextlib
import math
from collections.abc import Callable, Iterator
from pathlib import Path

from ...bench.estimation import watched_searches
from ..requests.declaration import optional, request
from .delivery import stored_results
from .terminal import progress_bars


@request
class SearchLimit:
    """The time that the searches of a fit may take."""

    budget: float | None = optional(
        "Time for the searches of a fit, after which each ends at the best values that it has"
        " found, with a warning: '10 min'.",
        unit="s",
        metavar="TIME",
        bounds=(1e-3, 1e9),
    )

    @contextlib.contextmanager
    def searches(
        self, out: Path | None, show: Callable[[str, float], None] | None = None
    ) -> Iterator[None]:
        """A context manager within which searches show their progress on a terminal, in bars of
        their own unless `show` draws it, end with the budget, and go on from their checkpoints
        beside the output, `out`, after an interruption.
        """
        limit = math.inf if self.budget is None else self.budget
        bars = progress_bars("search") if show is None else contextlib.nullcontext(show)
        with stored_results(out), bars as report, watched_searches(report, limit):
            yield

"""RunCache: what the runs of one system leave for the next one, so that a run like the last one repeats no work."""

import dataclasses
from collections.abc import Hashable
from typing import Any

from ...core import Array


class Pool:
    """Objects that one run at a time may use, by a key; with more keys than `max_keys` all of them are dropped."""

    def __init__(self, max_keys: int = 1_000) -> None:
        self._idle: dict[Hashable, list[Any]] = {}
        self._max_keys = max_keys

    def __len__(self) -> int:
        """The number of keys."""
        return len(self._idle)

    def borrow(self, key: Hashable) -> Any:
        """An object that no other run uses; None where there is none."""
        try:
            return self._idle[key].pop()
        except (KeyError, IndexError):  # none, or another thread was quicker
            return None

    def give_back(self, key: Hashable, used: Any) -> None:
        """Keep an object for the next run."""
        if key not in self._idle and len(self._idle) >= self._max_keys:
            self._idle.clear()
        self._idle.setdefault(key, []).append(used)


@dataclasses.dataclass(eq=False)
class RunCache:
    """What runs of one system leave for the next one; it belongs to the system's description.

    A run takes over what the last one checked or computed if its arguments are the same, and borrows bound kernels.

    default_state  the default initial state (n,), once it has been found
    checked_state  the last initial state that was checked and found possible
    checked_input  the last segments of inputs that were found within their ranges, what output times a run with them
                   asked for, and these times, if nobody can write to the arrays
    sources        sources of the models and of an integrator, by the integrator
    integrators    integrators bound to the system, by their integrator
    holders        the same for steps with held inputs
    recorders      kernels of the rows bound to the system, under None
    loops          runs of control loops, by the form of the loop
    """

    default_state: Array | None = None
    checked_state: list[float] | None = None
    checked_input: tuple[Any, Any, Any] = None, None, None
    sources: dict[Any, tuple[Any, ...]] = dataclasses.field(default_factory=dict)
    integrators: Pool = dataclasses.field(default_factory=Pool)
    holders: Pool = dataclasses.field(default_factory=Pool)
    recorders: Pool = dataclasses.field(default_factory=Pool)
    loops: Pool = dataclasses.field(default_factory=lambda: Pool(max_keys=4))

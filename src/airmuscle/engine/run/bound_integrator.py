"""Integrator bound to a compiled system: its kernel with all arguments, run after run."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ...core import Array, Status, flat_view
from ..compile.cache.kernel import Kernel
from ..compile.functions import ArraySizes
from ..loop.inputs import PiecewiseLinear

INTERRUPT_CHECK_STEPS = 100_000
"""Steps between two checks whether the user wants to stop, or the state is impossible."""
MAX_STEPS = 50_000_000
"""Steps of one run, by default."""
_PAUSED, _TOO_MANY = Status.PAUSED.value, Status.TOO_MANY_STEPS.value


class RawSolution(NamedTuple):
    """Result of an integrator: rows (N, n), number of rows reached, end time, status and counts."""

    rows: Array
    reached: int
    time: float
    state: Array
    status: Status
    steps: int
    rejected: int


class Binding(NamedTuple):
    """Binding of an integrator to a system: kernel, arguments before and after those of a run, workspace size."""

    kernel: Kernel
    leading: tuple[Any, ...]
    trailing: tuple[Any, ...]
    work: int


class BoundIntegrator:
    """An integrator bound to one compiled system, with its workspace. For one thread at a time."""

    def __init__(self, binding: Binding, sizes: ArraySizes) -> None:
        self.state, self._progress = np.zeros(sizes.states), np.zeros(7, dtype=np.int64)
        self.clock: Array = self._progress[:3].view(np.float64)
        """Time, next step, start of the current segment."""
        self.count = self._progress[3:]
        """Segment, next row, steps, rejected steps."""
        self._duration = 1.0
        self._end, inputs, slopes = np.ones(1), np.zeros((1, sizes.inputs)), np.zeros((1, sizes.inputs))
        self.held: Array = inputs[0]
        """The inputs (m,) of `proceed`."""
        no_rows = np.zeros(0), np.zeros((0, sizes.states))
        work = np.zeros(max(binding.work, 1))
        run = (self.state, self._end, inputs, slopes, *no_rows)
        end = (self.clock, self.count, INTERRUPT_CHECK_STEPS, work)
        self._bound_values = (*binding.leading, *binding.trailing)
        self._kernel = binding.kernel.bind(*binding.leading, *run, *binding.trailing, *end)
        self._run, self._first = self._kernel.runner, len(binding.leading) + 1
        self._clock_view, self._count_view = flat_view(self.clock), flat_view(self.count)
        self.places = np.array([self._kernel.slot_of(self._first + i) for i in range(5)], dtype=np.int64)
        """The places in the slots of ends, values and slopes of segments, and of times and rows (5,)."""
        self._words = None if self._kernel.entry_address is None else flat_view(self._kernel.slots)
        self._budget = len(binding.leading) + len(run) + len(binding.trailing) + 2

    def rebind(self, binding: Binding) -> None:
        """Take the values of the same integrator at a system of the same structure with other parameters."""
        for own, other in zip(self._bound_values, (*binding.leading, *binding.trailing), strict=True):
            if isinstance(own, np.ndarray):
                own[...] = other

    def run(
        self, segments: PiecewiseLinear, start: float, state: Array, times: Array, max_steps: int = MAX_STEPS,
        rows: Array | None = None, check: Callable[[Array, float], Status] | None = None,
    ) -> RawSolution:  # fmt: skip
        """Integrate from `state` (n,) at `start` [s] through the segments; rows (N, n) at rising `times` (N,).

        `check` states for a state (n,) and a time [s], DONE or why the run ends there; it is called between packets of
        many steps, because the steps can become endlessly many where the model does not hold.
        """
        rows = np.empty((times.size, self.state.size)) if rows is None else rows
        self.state[:] = state
        for i, argument in enumerate((segments.ends, segments.values, segments.slopes, times), self._first):
            self._kernel.replace_input(i, argument)
        self._kernel.replace(self._first + 4, rows)
        return self._solve(start, rows, max_steps, check)

    def hold(self, state: Array, inputs: Array, duration: float) -> Status:
        """Advance `state` (n,) in place by `duration` [s] with the inputs (m,) held. Not to be mixed with `run`."""
        self.state[:] = state
        self.held[:] = inputs
        status = self.proceed(duration)
        state[:] = self.state
        return status

    def proceed(self, duration: float) -> Status:
        """Advance `self.state` by `duration` [s] with `self.held` held. Not to be mixed with `run`."""
        if duration != self._duration:
            self._end[0] = self._duration = duration
        self._progress.fill(0)
        status = self._run()
        if status == _PAUSED:
            status = self._continue(status, MAX_STEPS)
        return Status.DONE if status == 0 else Status(status)

    def run_part(self) -> Status:
        """Go on through the segments and rows in the slots, for a kernel that cannot call this one itself."""
        a, b, c, d, e = self.places.tolist()
        if self._words is None:
            slots = self.slots.tolist()
            self._kernel.point(self._first, (slots[a], slots[b], slots[c]), slots[a + 1])
            self._kernel.point(self._first + 3, (slots[d], slots[e]), slots[d + 1])
        before = self._count_view[2]
        status = self._run()
        if status == _PAUSED:
            status = self._continue(status, before + MAX_STEPS)
            self._kernel.replace(self._budget, INTERRUPT_CHECK_STEPS)
        return Status(status)

    @property
    def entry_address(self) -> int | None:
        """The address of the kernel's entry point, for a kernel that calls it; None without machine code."""
        return self._kernel.entry_address

    @property
    def slots(self) -> Any:
        """The slots of the kernel's arguments."""
        return self._kernel.slots

    def _solve(
        self, start: float, rows: Array, max_steps: int, check: Callable[[Array, float], Status] | None
    ) -> RawSolution:
        clock, count = self._clock_view, self._count_view
        clock[0], clock[1], clock[2] = start, 0.0, start
        count[0] = count[1] = count[2] = count[3] = 0
        if max_steps < INTERRUPT_CHECK_STEPS:
            self._kernel.replace(self._budget, max_steps)
        try:
            status = self._kernel()
            if status == _PAUSED:
                status = self._continue(status, max_steps, check)
        except KeyboardInterrupt:
            status = Status.INTERRUPTED.value
        self._kernel.replace(self._budget, INTERRUPT_CHECK_STEPS)
        reached, ended = count[1], Status.DONE if status == 0 else Status(status)
        if reached < len(rows):
            rows[reached:] = np.nan
        return RawSolution(rows, reached, clock[0], self.state.copy(), ended, count[2], count[3])

    def _continue(self, status: int, max_steps: int, check: Callable[[Array, float], Status] | None = None) -> int:
        """Go on where the kernel paused so that an interruption or an impossible state can be noticed."""
        while status == _PAUSED:
            if check is not None and (outcome := check(self.state, self._clock_view[0])) != Status.DONE:
                return outcome.value
            left = max_steps - int(self.count[2])
            if left <= 0:
                return _TOO_MANY
            self._kernel.replace(self._budget, min(INTERRUPT_CHECK_STEPS, left))
            status = self._kernel()
        return status

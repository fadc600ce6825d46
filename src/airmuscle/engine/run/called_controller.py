"""Controller of a prepared loop that is called from Python at each sample."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...core.errors import ParameterError
from ..loop.controller import Measurement
from .sampled_loop import SampledLoop


class CalledController:
    """The controller of a prepared loop with what it needs at each sample; its memory belongs to the run."""

    def __init__(self, prepared: SampledLoop) -> None:
        loop = prepared.loop
        self._controller, self._sample_time, self._ranges = loop.controller, loop.sample_time, prepared.ranges
        self._columns, self._names = loop.controller.measured_columns, loop.controller.setpoints
        self._inputs = tuple(prepared.ranges)
        self._rows = prepared.setpoints
        self._last: tuple[list[float], dict[str, float]] = [], {}

    def step(self, memory: Any, measured: Sequence[float], interval: int) -> tuple[list[float], Any]:
        """The commands of a sample at the start of an interval, not limited, and the memory after it.

        Raises ParameterError where the controller does not give a number for each input.
        """
        row = self._rows[interval]
        if row != self._last[0]:
            self._last = row, dict(zip(self._names, row, strict=True))
        columns = dict(zip(self._columns, measured, strict=True))
        measurement = Measurement(columns, self._last[1], self._ranges)
        commands, memory = self._controller.step(memory, measurement, self._sample_time)
        try:
            return [0.0 + commands[name] for name in self._inputs], memory
        except (KeyError, TypeError, ValueError):
            raise ParameterError(
                f"{type(self._controller).__name__} commands {commands!r}; it must give a number for each of "
                f"{', '.join(self._inputs)}."
            ) from None

"""ControlLaw: a controller that is written over `ops`, so that a whole loop runs as compiled code."""

from __future__ import annotations

import abc
from collections.abc import Mapping

from ...core.ops import Value
from .controller import Controller, Measurement


class ControlLaw(Controller):
    """A sampled controller whose `step` is written over `airmuscle.core.ops`, as the laws of muscles and valves are.

    Its declared parameters are numbers of the compiled program, its memory has named values. `step` is called with
    floats, arrays or symbols, therefore it chooses by `ops.where` and does not use `if` on a measurement.
    A controller that cannot be written in this way derives from Controller, and is called at each sample.
    """

    @property
    @abc.abstractmethod
    def initial_memory(self) -> Mapping[str, float]:
        """The values that are stored from one sample to the next, by name, with their initial values."""

    def init(self) -> dict[str, Value]:
        return dict(self.initial_memory)

    @abc.abstractmethod
    def step(
        self, memory: Mapping[str, Value], measurement: Measurement, dt: Value
    ) -> tuple[Mapping[str, Value], Mapping[str, Value]]:
        """The command of every input until the next sample, `dt` [s] later, and the memory for that sample."""

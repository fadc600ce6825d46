"""A controller that calls another one, and is therefore no control law: for runs that call it at
each sample.
"""

from __future__ import annotations

import dataclasses
from typing import Any

from airmuscle.engine import Controller


@dataclasses.dataclass(frozen=True)
class Called(Controller):
    """A controller that calls another one."""

    inner: Controller

    measured_columns = property(lambda self: self.inner.measured_columns)
    setpoints = property(lambda self: self.inner.setpoints)
    inputs = property(lambda self: self.inner.inputs)

    def init(self) -> Any:
        return self.inner.init()

    def step(self, memory: Any, measurement: Any, dt: float) -> Any:
        return self.inner.step(memory, measurement, dt)

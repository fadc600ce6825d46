"""WithStuckValve: a control law one of whose valves sticks from a given time on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...core import ops
from ...core.declaration import model, parameter
from ...core.errors import ParameterError, suggestion
from ...core.ops import Value
from ...core.system import select_prefix, with_prefix
from ...engine.loop.control_law import ControlLaw, EnclosingLaw
from ...engine.loop.controller import Measurement


@model
class WithStuckValve(EnclosingLaw):
    """u_i = law for t < t_f,   u_i = u_f for t >= t_f:  a fault that the law does not know.

    t time since the first sample, u_i the command of one input. With u_f = 0 a valve remains closed, with a small u_f
    it leaks. All other inputs receive what the law commands.
    """

    simulated: ClassVar[bool] = True

    law: ControlLaw
    stuck_input: str
    stuck_time: float = parameter("s", "t_f", "time from which the valve sticks", bounds=(0.0, 1e9), fitted=False)
    stuck_opening: float = parameter("1", "u_f", "opening of the stuck valve", bounds=(-1.0, 1.0), default=0.0)

    def check(self) -> None:
        if self.stuck_input not in self.law.inputs:
            raise ParameterError(
                f"WithStuckValve: the law does not command '{self.stuck_input}'; it commands "
                f"{', '.join(self.law.inputs)}.{suggestion(self.stuck_input, self.law.inputs)}"
            )

    @property
    def initial_memory(self) -> dict[str, float]:
        """The number of samples so far, and the values of the law."""
        return {"samples": 0.0, **with_prefix("law.", self.law.initial_memory)}

    def step(
        self, memory: Mapping[str, Value], measurement: Measurement, dt: Value
    ) -> tuple[dict[str, Value], dict[str, Value]]:
        wanted, later = self.law.step(select_prefix("law.", memory), measurement, dt)
        sticks = (memory["samples"] + 1e-6) * dt > self.stuck_time  # the product is rounded
        held = ops.where(sticks, self.stuck_opening, wanted[self.stuck_input])
        return {**wanted, self.stuck_input: held}, {"samples": memory["samples"] + 1.0, **with_prefix("law.", later)}

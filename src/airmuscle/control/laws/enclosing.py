"""Laws around another one: delay of its set points, and the fault of a valve."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...core import ops
from ...core.declaration import model, parameter
from ...core.errors import ParameterError, suggestion
from ...core.ops import Value
from ...core.reference import Reference
from ...core.system import select_prefix, with_prefix
from ...engine.loop.control_law import ControlLaw, EnclosingLaw
from ...engine.loop.controller import Measurement
from .pid import ASTROM_HAGGLUND1995

MAX_SAMPLES = 1000


@model
class WithSetpointDelay(EnclosingLaw):
    """u_k = law(y_k, r_(k-n)): every set point reaches the law n samples later; before, the first set point.

    y measurements that are n samples old, r set points, n `samples`. Set point and measurement that the law compares
    then belong to one instant. Without the delay the error of a motion with the speed r' contains n h r', h sample
    time, which feedback cannot remove and integral action turns into a lead of the motion. It is the set-point part of
    a controller with two degrees of freedom, for the feedback beside a feed-forward.
    Reference: Åström and Hägglund (1995), chapter 7.
    """

    references: ClassVar[tuple[Reference, ...]] = (ASTROM_HAGGLUND1995,)

    law: ControlLaw
    samples: int

    def check(self) -> None:
        if not 0 <= self.samples <= MAX_SAMPLES:
            raise ParameterError(f"WithSetpointDelay: samples is {self.samples}; allowed range: 0 to {MAX_SAMPLES}.")

    @property
    def initial_memory(self) -> dict[str, float]:
        """Whether it has started (0 or 1), the waiting set points, the oldest first, and the values of the law."""
        waiting = {f"{name}.delayed{i}": 0.0 for name in self.setpoints for i in range(self.samples)}
        return {"started": 0.0, **waiting, **with_prefix("law.", dict(self.law.initial_memory))}

    def step(
        self, memory: Mapping[str, Value], measurement: Measurement, dt: Value
    ) -> tuple[Mapping[str, Value], dict[str, Value]]:
        delayed: dict[str, Value] = {}
        later: dict[str, Value] = {"started": 1.0}
        for name in self.setpoints:
            now = measurement.setpoints[name]
            waiting = [ops.where(memory["started"] > 0, memory[f"{name}.delayed{i}"], now) for i in range(self.samples)]
            moved = [*waiting, now]
            delayed[name] = moved[0]
            later |= {f"{name}.delayed{i}": each for i, each in enumerate(moved[1:])}
        commands, law = self.law.step(select_prefix("law.", memory), measurement._replace(setpoints=delayed), dt)
        return commands, {**later, **with_prefix("law.", law)}


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

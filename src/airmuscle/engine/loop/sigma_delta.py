"""SigmaDelta: commands of a control law as the positions 0 and 1 of on/off valves, by sigma-delta modulation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...core import ops
from ...core.declaration import model, parameter
from ...core.ops import Value
from ...core.reference import Reference
from ...core.system import select_prefix, with_prefix
from .control_law import ControlLaw
from .controller import Measurement
from .enclosing_law import EnclosingLaw

INOSE1962 = Reference(
    key="inose-1962",
    authors="Inose, H., Yasuda, Y., Murakami, J.",
    title="A telemetering system by code modulation - Δ-Σ modulation",
    where="IRE Transactions on Space Electronics and Telemetry SET-8(3):204-209",
    year=1962,
    doi="10.1109/IRET-SET.1962.5008839",
    note="first-order modulator",
)


@model
class SigmaDelta(EnclosingLaw):
    """v_k = s_(k-1) + u_k,   position_k = 1 where v_k >= 1/2, else 0,   s_k = v_k - position_k.

    u command of the inner law for an input, 0 to 1, s sum of what has not been applied, by which the mean of the
    positions follows u: the sums of both differ by at most 1/2 at any time. Unlike PWM it has no period; for small u
    the valve opens seldom. A valve with a dead time needs a sample time that is longer than it. Commands below u_min
    count as 0, which stops single openings at rest.
    Reference: Inose, Yasuda and Murakami (1962).
    """

    references: ClassVar[tuple[Reference, ...]] = (INOSE1962,)

    law: ControlLaw
    minimum: float = parameter("1", "u_min", "command below which a valve is closed", bounds=(0.0, 1.0), default=0.0)

    @property
    def initial_memory(self) -> dict[str, float]:
        """The sum of each input, `sum.fill`, and the values of the law."""
        sums = dict.fromkeys(self.inputs, 0.0)
        return {**with_prefix("sum.", sums), **with_prefix("law.", self.law.initial_memory)}

    def step(
        self, memory: Mapping[str, Value], measurement: Measurement, dt: Value
    ) -> tuple[dict[str, Value], dict[str, Value]]:
        wanted, law = self.law.step(select_prefix("law.", memory), measurement, dt)
        positions: dict[str, Value] = {}
        sums: dict[str, Value] = {}
        for name, before in select_prefix("sum.", memory).items():
            command = ops.clip(wanted[name], 0.0, 1.0)
            total = before + ops.where(command >= self.minimum, command, 0.0)
            positions[name] = ops.where(total >= 0.5, 1.0, 0.0)
            sums[name] = total - positions[name]
        return positions, {**with_prefix("sum.", sums), **with_prefix("law.", law)}

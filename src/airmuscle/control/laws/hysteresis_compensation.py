"""HysteresisCompensation: the commands of a law through the inverse of a hysteresis operator."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...core.declaration import model
from ...core.errors import ParameterError, suggestion
from ...core.ops import Value
from ...core.reference import Reference
from ...core.system import select_prefix, with_prefix
from ...engine.loop.control_law import ControlLaw, EnclosingLaw
from ...engine.loop.controller import Measurement
from ...physics.muscle.friction.prandtl_ishlinskii import KUHNEN2003
from .hysteresis_operator import InverseHysteresisOperator


@model
class HysteresisCompensation(EnclosingLaw):
    """u_k = Gamma^-1[v]_k: an input receives the command v of a law through an inverse hysteresis operator.

    If the plant responds to u as to Gamma[u] without hysteresis, the hysteresis cancels. Where the
    input is limited to its range, the plays follow the command v as if it were not. A law with integral action sees the
    range of u.
    Reference: Kuhnen (2003).
    """

    references: ClassVar[tuple[Reference, ...]] = (KUHNEN2003,)

    law: ControlLaw
    commanded: str
    inverse: InverseHysteresisOperator

    def check(self) -> None:
        if self.commanded not in self.law.inputs:
            raise ParameterError(
                f"HysteresisCompensation: the law does not command '{self.commanded}'; it commands "
                f"{', '.join(self.law.inputs)}.{suggestion(self.commanded, self.law.inputs)}"
            )

    @property
    def initial_memory(self) -> dict[str, float]:
        """The plays of the inverse, `hysteresis.play0`, and the values of the law with the prefix `law.`."""
        return {
            **with_prefix("hysteresis.", self.inverse.initial_memory),
            **with_prefix("law.", dict(self.law.initial_memory)),
        }

    def step(
        self, memory: Mapping[str, Value], measurement: Measurement, dt: Value
    ) -> tuple[dict[str, Value], dict[str, Value]]:
        commands, kept = self.law.step(select_prefix("law.", memory), measurement, dt)
        value, plays = self.inverse.step(select_prefix("hysteresis.", memory), commands[self.commanded])
        later = {**with_prefix("hysteresis.", plays), **with_prefix("law.", kept)}
        return {**commands, self.commanded: value}, later

"""FrictionFeedForward: control law whose command compensates Coulomb friction along a wanted motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...core import ops
from ...core.declaration import Parameter, model, parameter
from ...core.ops import Value
from ...core.reference import Reference
from .open_loop_law import OpenLoopLaw

ARMSTRONG1994 = Reference(
    key="armstrong-1994",
    authors="Armstrong-Hélouvry, B., Dupont, P., Canudas de Wit, C.",
    title="A survey of models, analysis tools and compensation methods for the control of machines with friction",
    where="Automatica 30(7), 1083-1138",
    year=1994,
    doi="10.1016/0005-1098(94)90209-7",
    note="compensation of Coulomb friction by a model in the feed-forward",
)


@model
class FrictionFeedForward(OpenLoopLaw):
    """u = A clip(v_r/v_0, -1, 1).

    v_r set point of the speed of a wanted motion, A command that balances Coulomb friction, v_0 speed below which the
    command is proportional to the speed, so that it does not jump at a reversal. It is the feed-forward law of
    `WithFeedForward` beside that of the model without friction.
    Reference: Armstrong-Hélouvry, Dupont and Canudas de Wit (1994).
    """

    references: ClassVar[tuple[Reference, ...]] = (ARMSTRONG1994,)

    speed: str
    commanded: str
    amplitude: float = parameter("u", "A", "command that balances the friction", bounds=(0.0, 1e9))
    boundary_speed: float = parameter("SI", "v_0", "speed from which on it is constant", bounds=(1e-9, 1e9))

    def unit_of(self, declared: Parameter, index: int, units: Mapping[str, str]) -> str:
        """The unit of a parameter; that of v_0 is that of the speed."""
        if declared.name == "boundary_speed":
            return units[self.speed] or "1"
        return super().unit_of(declared, index, units)

    @property
    def setpoints(self) -> tuple[str, ...]:
        return (self.speed,)

    @property
    def inputs(self) -> tuple[str, ...]:
        return (self.commanded,)

    def command(self, setpoints: Mapping[str, Value]) -> dict[str, Value]:
        return {self.commanded: self.amplitude * ops.clip(setpoints[self.speed] / self.boundary_speed, -1.0, 1.0)}

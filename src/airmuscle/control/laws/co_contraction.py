"""CoContraction: pressures of two antagonistic muscles from their mean and half their difference."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...core.declaration import model, parameter
from ...core.errors import ParameterError
from ...core.ops import Value
from ...core.reference import Reference
from ...physics.muscle.characteristic.tondu_lopez2000 import TONDU_LOPEZ_2000
from .open_loop_law import OpenLoopLaw

DIFFERENCE = "difference"
"""Name of the set point that an outer controller commands: half the difference of both pressures [Pa]."""


@model
class CoContraction(OpenLoopLaw):
    """p_1 = p_0 + d,   p_2 = p_0 - d.

    d half the pressure difference, which turns the joint: the set point `difference`; p_0 mean pressure, which stiffens
    it: the set point that `mean_setpoint` names, else the parameter `mean`. In a `Cascade` an outer controller of the
    angle commands d, and the two pressures are the set points of regulators or of inner pressure controllers. Neither
    needs a model of the muscles.
    Reference: Tondu and Lopez (2000).
    """

    references: ClassVar[tuple[Reference, ...]] = (TONDU_LOPEZ_2000,)

    commanded: tuple[str, ...]
    mean: float = parameter("Pa", "p_0", "mean gauge pressure where it is no set point", bounds=(0.0, 1e7), default=0.0)
    mean_setpoint: str = ""

    def check(self) -> None:
        if len(self.commanded) != 2:
            raise ParameterError(
                f"CoContraction: {len(self.commanded)} commanded pressures; name two, such as ('left.pressure', "
                "'right.pressure')."
            )

    @property
    def setpoints(self) -> tuple[str, ...]:
        return (DIFFERENCE, *((self.mean_setpoint,) if self.mean_setpoint else ()))

    @property
    def signal_units(self) -> dict[str, str]:
        return {DIFFERENCE: "Pa", **({self.mean_setpoint: "Pa"} if self.mean_setpoint else {})}

    @property
    def inputs(self) -> tuple[str, ...]:
        return self.commanded

    def command(self, setpoints: Mapping[str, Value]) -> dict[str, Value]:
        mean = setpoints[self.mean_setpoint] if self.mean_setpoint else self.mean
        first, second = self.commanded
        return {first: mean + setpoints[DIFFERENCE], second: mean - setpoints[DIFFERENCE]}

"""StaticFeedForward: the pressure for a wanted position and load, by the static inverse of the muscle."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...core.declaration import model, parameter
from ...core.ops import Value
from ...core.reference import Reference
from ...physics.muscle.geometry.meridian import SAGA_2007
from .open_loop_law import OpenLoopLaw
from .static_inverse import StaticInverse


@model
class StaticFeedForward(OpenLoopLaw):
    """u = p(eps_0 + x_r/L_0, F_r + m a_r): the pressure of the static inverse for the wanted position and load.

    x_r set point of the position, F_r wanted load: a set point where `load_setpoint` names one, else the parameter
    `load`; a_r set point of the acceleration where `acceleration_setpoint` names one. Nothing is measured. The input
    is a pressure: the set point of a pressure regulator, or that of an inner pressure controller (`Cascade`). Beside
    feedback it is used in `WithFeedForward`. Friction, heat and the pressure's delay are not compensated.
    Reference: Saga et al. (2007), whose static model is meant for feed-forward control.
    """

    references: ClassVar[tuple[Reference, ...]] = (SAGA_2007,)

    inverse: StaticInverse
    commanded: str
    resting_length: float = parameter("m", "L_0", "resting length of the muscle", bounds=(1e-3, 100.0))
    load: float = parameter("N", "F_r", "wanted load where it is no set point", bounds=(-1e6, 1e6), default=0.0)
    mass: float = parameter("kg", "m", "mass that follows the wanted acceleration", bounds=(0.0, 1e6), default=0.0)
    offset: float = parameter("1", "eps_0", "contraction at position 0", bounds=(-0.5, 0.9), default=0.0)
    position: str = "position"
    load_setpoint: str = ""
    acceleration_setpoint: str = ""

    @property
    def setpoints(self) -> tuple[str, ...]:
        return (self.position, *(name for name in (self.load_setpoint, self.acceleration_setpoint) if name))

    @property
    def signal_units(self) -> dict[str, str]:
        named = {self.load_setpoint: "N", self.acceleration_setpoint: "m/s2"}
        return {name: unit for name, unit in named.items() if name}

    @property
    def inputs(self) -> tuple[str, ...]:
        return (self.commanded,)

    def command(self, setpoints: Mapping[str, Value]) -> dict[str, Value]:
        force = setpoints[self.load_setpoint] if self.load_setpoint else self.load
        if self.acceleration_setpoint:
            force = force + self.mass * setpoints[self.acceleration_setpoint]
        contraction = self.offset + setpoints[self.position] / self.resting_length
        return {self.commanded: self.inverse.pressure(contraction, force)}

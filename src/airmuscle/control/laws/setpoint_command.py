"""SetpointCommand: control law whose commands are its set points."""

from __future__ import annotations

from collections.abc import Mapping

from ...core.declaration import model
from ...core.errors import ParameterError
from ...core.ops import Value
from .open_loop_law import OpenLoopLaw


@model
class SetpointCommand(OpenLoopLaw):
    """u = r: the command of each input is a set point, such as a learned or precomputed feed-forward signal.

    setpoint_names and commanded have the same length and order; without setpoint_names they are the inputs' names.
    """

    commanded: tuple[str, ...]
    setpoint_names: tuple[str, ...] = ()

    def check(self) -> None:
        if self.setpoint_names and len(self.setpoint_names) != len(self.commanded):
            raise ParameterError(
                f"SetpointCommand: {len(self.setpoint_names)} set points for {len(self.commanded)} inputs; give one "
                "set point for each input."
            )

    @property
    def setpoints(self) -> tuple[str, ...]:
        return self.setpoint_names or self.commanded

    @property
    def inputs(self) -> tuple[str, ...]:
        return self.commanded

    def command(self, setpoints: Mapping[str, Value]) -> dict[str, Value]:
        names = zip(self.commanded, self.setpoints, strict=True)
        return {name: setpoints[setpoint] for name, setpoint in names}

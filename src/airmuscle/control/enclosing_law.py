"""EnclosingLaw: a control law around another one, with its measurements, set points and inputs."""

from __future__ import annotations

from .control_law import ControlLaw


class EnclosingLaw(ControlLaw):
    """A control law that changes the measurements, the commands or a parameter of its field `law`."""

    law: ControlLaw

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return self.law.measured_columns

    @property
    def setpoints(self) -> tuple[str, ...]:
        return self.law.setpoints

    @property
    def inputs(self) -> tuple[str, ...]:
        return self.law.inputs

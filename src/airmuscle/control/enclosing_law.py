"""EnclosingLaw: a control law around another one, with its measurements, set points and inputs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from .control_law import ControlLaw


class EnclosingLaw(ControlLaw):
    """A control law that changes the measurements, the commands or the numbers of another one, its `law`."""

    if TYPE_CHECKING:  # a field of a model, or designed

        @property
        def law(self) -> ControlLaw:
            """The law inside."""

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return self.law.measured_columns

    @property
    def setpoints(self) -> tuple[str, ...]:
        return self.law.setpoints

    @property
    def inputs(self) -> tuple[str, ...]:
        return self.law.inputs

    @property
    def initial_memory(self) -> Mapping[str, float]:
        """That of the law, unless the enclosing law stores further values."""
        return self.law.initial_memory

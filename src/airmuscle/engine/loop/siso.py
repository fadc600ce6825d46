"""SisoController: base class of controllers of one column, by one input or by two in split range."""

from __future__ import annotations

from .control_law import ControlLaw
from .split_range import Commanded, inputs_of


class SisoController(ControlLaw):
    """A control law that compares one column, `measured`, with its set point; `commanded` is the manipulated input."""

    measured: str
    commanded: Commanded

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return (self.measured,)

    @property
    def setpoints(self) -> tuple[str, ...]:
        return (self.measured,)

    @property
    def inputs(self) -> tuple[str, ...]:
        return inputs_of(self.commanded)

"""Controllers that follow one column, by one input or by two that work against each other."""

from __future__ import annotations

from .controller import Controller
from .split_range import Commanded, inputs_of


class SisoController(Controller):
    """A controller that compares one column with its set point: `measured` names it, `commanded` what it acts on."""

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

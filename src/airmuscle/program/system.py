"""What can be turned into a program: named states, named inputs, rates and outputs written over `ops`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from ..ops import Value
from ..variables import StateVariable


class System(Protocol):
    """Ordinary differential equations of a frozen model; its declared leaves are the program's parameters.

    Every mapping is keyed by the names that `states` and `inputs` list. Rates must be continuous in the states.
    """

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """The states, in the order of their vector."""

    @property
    def inputs(self) -> tuple[str, ...]:
        """The names of the inputs, each linear in time between instants."""

    def rates(self, state: Mapping[str, Value], inputs: Mapping[str, Value]) -> Mapping[str, Value]:
        """The time derivative of every state."""

    def outputs(self, state: Mapping[str, Value], inputs: Mapping[str, Value]) -> Mapping[str, Value]:
        """Further quantities of interest at a state."""

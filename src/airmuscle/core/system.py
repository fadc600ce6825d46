"""What can be turned into a program: named states, named inputs, rates and outputs written over `ops`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

from .ops import Value
from .variables import StateVariable


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


@runtime_checkable
class SensitivitySystem(System, Protocol):
    """A system that carries another's states, then their derivatives along columns, state by state.

    It is a System like any other; its program is printed from the inner one, which costs less than its own rates.
    """

    @property
    def inner(self) -> System:
        """The system whose states come first."""

    @property
    def parameter_indices(self) -> tuple[tuple[int, ...], ...]:
        """For every column the places among the inner leaves that move together."""

    @property
    def observed_names(self) -> tuple[str, ...]:
        """Inner states and outputs that are given as outputs."""

    @property
    def output_names(self) -> tuple[str, ...]:
        """Values of what is observed, the derivatives of each, their slopes in time."""

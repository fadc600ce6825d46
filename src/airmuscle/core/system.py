"""System interface: named states and inputs, with rates and outputs written over `ops`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

from .ops import Value
from .variables import StateVariable


class System(Protocol):
    """Ordinary differential equations of a frozen model; its declared leaves are the parameters of the program.

    Mappings are keyed by the names listed in `states` and `inputs`. Rates must be continuous in the states.
    """

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """The states, in the order of the state vector."""

    @property
    def inputs(self) -> tuple[str, ...]:
        """The names of the inputs, each piecewise linear in time."""

    def rates(self, state: Mapping[str, Value], inputs: Mapping[str, Value]) -> Mapping[str, Value]:
        """The time derivative of every state."""

    def outputs(self, state: Mapping[str, Value], inputs: Mapping[str, Value]) -> Mapping[str, Value]:
        """Output quantities at a state."""


@runtime_checkable
class SensitivitySystem(System, Protocol):
    """A system augmented by its sensitivities: the inner states, then their derivatives, column by column, per state.

    Its compiled program is generated from the inner system, which costs less than its own rates.
    """

    @property
    def inner(self) -> System:
        """The system that is differentiated; its states come first."""

    @property
    def parameter_indices(self) -> tuple[tuple[int, ...], ...]:
        """For every column, the indices of the inner leaves that vary together."""

    @property
    def observed_names(self) -> tuple[str, ...]:
        """Inner states and outputs that are returned as outputs."""

    @property
    def output_names(self) -> tuple[str, ...]:
        """Observed values, the derivatives of each, and their time derivatives."""

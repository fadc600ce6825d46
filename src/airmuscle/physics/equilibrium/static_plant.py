"""Interface between a plant and its equilibria: the parts and methods that these depend on."""

from __future__ import annotations

import abc
from collections.abc import Mapping, Sequence
from typing import Any

from ...core.ops import Value
from ...core.system import System
from ..mechanism import Mechanism
from ..muscle import Muscle
from ..pneumatics.gas import Ambient, Gas


class StaticPlant(System):
    """A system of muscles that act on a mechanism; its only implementation is the Plant, which imports this package."""

    mechanism: Mechanism
    gas: Gas
    ambient: Ambient

    @property
    @abc.abstractmethod
    def muscles(self) -> tuple[Muscle, ...]:
        """The muscles, one or more."""

    @property
    @abc.abstractmethod
    def prefixes(self) -> tuple[str, ...]:
        """Prefixes of the names of each muscle's quantities."""

    @property
    @abc.abstractmethod
    def resting_lengths(self) -> list[Value]:
        """Resting length [m] of each muscle."""

    @abc.abstractmethod
    def muscle_states(self, state: Mapping[str, Value]) -> tuple[Any, ...]:
        """Every muscle at a state."""

    @abc.abstractmethod
    def state_at(self, *, pressure: float | str | Sequence[float | str], **values: float | str) -> dict[str, float]:
        """A state by the gauge pressure of each muscle, and by states by name."""

    @abc.abstractmethod
    def settle_muscles(
        self, pressures: Sequence[Value], state: Mapping[str, Value]
    ) -> tuple[dict[str, Value], list[Value]]:
        """`state` with the muscles' own states in steady state, and the volume [m3] of each muscle."""

    @abc.abstractmethod
    def fill_muscles(
        self, pressures: Sequence[Value], volumes: Sequence[Value], state: Mapping[str, Value]
    ) -> dict[str, Value]:
        """`state` with air at these gauge pressures [Pa] in these volumes [m3], and circuits settled."""

"""What lies between a valve and a muscle, seen from both ends."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import Any, ClassVar

from ..core.ops import Value
from ..core.reference import Reference
from ..core.variables import StateVariable
from .gas import Air, Ambient, Flow


class TubeModel(abc.ABC):
    """A tube of one model or another. States are mappings by the names of `states`."""

    references: ClassVar[tuple[Reference, ...]] = ()
    segment_count: int

    @property
    def prefixes(self) -> tuple[str, ...]:
        """What the names of each piece's states begin with, from the valve to the muscle."""
        return ("tube.",) if self.segment_count == 1 else tuple(f"tube{i}." for i in range(1, self.segment_count + 1))

    @abc.abstractmethod
    def states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        """What its pieces hold, and what flows in it where that is a state."""

    @abc.abstractmethod
    def steady_state(self, air: Air, ambient: Ambient) -> dict[str, Value]:
        """Its states at rest at the pressure of the muscle."""

    @abc.abstractmethod
    def air_states(self, state: Mapping[str, Value], ambient: Ambient) -> tuple[Air, ...]:
        """The air in every piece, from the valve to the muscle."""

    @abc.abstractmethod
    def rates(
        self, state: Mapping[str, Value], airs: tuple[Air, ...], flow: Flow, muscle: Air, ambient: Ambient
    ) -> tuple[dict[str, Value], Flow]:
        """Rates of its states while `flow` comes in from the valve, and the flow into the muscle."""

    def validity_warnings(self, columns: Mapping[str, Any], ambient: Ambient) -> dict[str, str]:
        """Where a run, columns (N,) by its names, went beyond what its law describes: in words, by piece."""
        return {}

"""TubeModel (interface): the flow at both ends of a tube between valve and muscle."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import Any, ClassVar

from ...core.ops import Value
from ...core.reference import Reference
from ...core.variables import StateVariable
from .gas import Air, Ambient, Flow


class TubeModel(abc.ABC):
    """Tube between valve and muscle (interface). States are mappings from the names in `states` to values."""

    references: ClassVar[tuple[Reference, ...]] = ()
    segment_count: int

    @property
    def prefixes(self) -> tuple[str, ...]:
        """Prefixes of the state names of each segment, from valve to muscle."""
        if self.segment_count == 1:
            return ("tube.",)
        return tuple(f"tube{i}." for i in range(1, self.segment_count + 1))

    @abc.abstractmethod
    def states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        """State variables of all segments."""

    @abc.abstractmethod
    def steady_state(self, air: Air, ambient: Ambient) -> dict[str, Value]:
        """Steady state without flow at the pressure of the air in the muscle."""

    @abc.abstractmethod
    def air_states(self, state: Mapping[str, Value], ambient: Ambient) -> tuple[Air, ...]:
        """Air state of each segment, from valve to muscle."""

    @abc.abstractmethod
    def rates(
        self, state: Mapping[str, Value], air_states: tuple[Air, ...], flow: Flow, muscle: Air, ambient: Ambient
    ) -> tuple[dict[str, Value], Flow]:
        """Time derivatives of the states for a flow from the valve, and the flow into the muscle."""

    def validity_warnings(self, columns: Mapping[str, Any], ambient: Ambient) -> dict[str, str]:
        """Warnings by segment prefix where a run left the validity range; `columns` are arrays (N,) by name."""
        return {}

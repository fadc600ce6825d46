"""PlantEvaluation: everything that the rates and the outputs of a plant have in common, at one state and input."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from ...core.ops import Value
from ..pneumatics import CircuitFlows
from ..pneumatics.gas import Flow
from .muscle_state import MuscleState


class PlantEvaluation(NamedTuple):
    """Muscles and circuits of a plant at one instant; forces [N] or [N m] and accelerations by coordinate."""

    muscles: tuple[MuscleState, ...]
    circuits: tuple[CircuitFlows, ...]
    forces: Mapping[str, Value]
    accelerations: Mapping[str, Value]

    @property
    def flows(self) -> list[Flow]:
        """The flow into every muscle."""
        return [flow for circuit in self.circuits for flow in circuit.flows]

"""Creep elements: Maxwell elements in parallel with the muscle."""

from __future__ import annotations

from collections.abc import Mapping

from ...core.declaration import model, parameter
from ...core.errors import ParameterError
from ...core.ops import Value
from ...core.variables import StateVariable


@model
class CreepElements:
    """Maxwell elements: F = Sum k_i z_i,  z_i' = v - z_i/tau_i; each is a spring in series with a damper.

    z_i stretch of spring i [m], k_i its stiffness, tau_i its relaxation time. After a step in length the force relaxes
    to that of the muscle without these elements; under a constant load the contraction increases with time. Passive.
    """

    stiffnesses: tuple[float, ...] = parameter("N/m", "k_i", "stiffness of each spring", bounds=(0.0, 1e7), default=())
    relaxation_times: tuple[float, ...] = parameter(
        "s", "tau_i", "relaxation time of each element", bounds=(1e-3, 1e5), default=()
    )

    def check(self) -> None:
        if len(self.stiffnesses) != len(self.relaxation_times):
            raise ParameterError(
                f"CreepElements: {len(self.stiffnesses)} stiffnesses and {len(self.relaxation_times)} relaxation times "
                "are given; give one of each for every element."
            )

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """Stretch of each spring [m]."""
        count = range(1, len(self.relaxation_times) + 1)
        return tuple(
            StateVariable(f"creep{i}", "m", 1e-3, f"stretch of the spring of creep element {i}") for i in count
        )

    def force(self, state: Mapping[str, Value]) -> Value:
        """Force against contraction [N]."""
        return sum((k * state[s.name] for k, s in zip(self.stiffnesses, self.states, strict=True)), 0.0)

    def rates(self, state: Mapping[str, Value], speed: Value) -> dict[str, Value]:
        """Time derivative of each stretch [m/s] at a speed of shortening [m/s]."""
        return {s.name: speed - state[s.name] / tau for s, tau in zip(self.states, self.relaxation_times, strict=True)}

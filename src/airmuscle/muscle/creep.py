"""Creep of a muscle: springs that relax, in parallel with it."""

from __future__ import annotations

from collections.abc import Mapping

from ..core.declaration import model, parameter
from ..core.errors import ParameterError
from ..core.ops import Value
from ..core.variables import StateVariable


@model
class CreepElements:
    """F = Sum k_i z_i,  z_i' = v - z_i/tau_i: Maxwell elements, each a spring in series with a damper.

    z_i stretch of spring i [m], k_i its stiffness, tau_i its time of relaxation. After a step the force relaxes to
    that of the muscle without them; under a constant load the muscle goes on to contract. Passive.
    """

    stiffnesses: tuple[float, ...] = parameter("N/m", "k_i", "stiffness of each spring", bounds=(0.0, 1e7), default=())
    times: tuple[float, ...] = parameter("s", "tau_i", "time of relaxation of each", bounds=(1e-3, 1e5), default=())

    def check(self) -> None:
        if len(self.stiffnesses) != len(self.times):
            raise ParameterError(
                f"CreepElements: {len(self.stiffnesses)} stiffnesses and {len(self.times)} times; give one of each for "
                "every element."
            )

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """The stretch of every spring."""
        count = range(1, len(self.times) + 1)
        return tuple(StateVariable(f"creep{i}", "m", 1e-3, f"stretch of the creeping spring {i}") for i in count)

    def force(self, state: Mapping[str, Value]) -> Value:
        """Force against contraction [N]."""
        return sum((k * state[s.name] for k, s in zip(self.stiffnesses, self.states, strict=True)), 0.0)

    def rates(self, state: Mapping[str, Value], speed: Value) -> dict[str, Value]:
        """The time derivative of every stretch, at a speed of shortening [m/s]."""
        return {s.name: speed - state[s.name] / tau for s, tau in zip(self.states, self.times, strict=True)}

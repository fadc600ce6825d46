"""Maxwell-slip friction model: parallel springs, each sliding at its deflection limit."""

from typing import Any, ClassVar, Self

from ....core import ParameterError, Reference, StateVariable, Value, Values, model, ops, parameter, published
from .base import Friction
from .path import LoopScales, stop_operators


def element_rate(deflection: Value, limit: Value, transition: Value, speed: Value) -> Value:
    """Deflection rate [m/s] of an element that slides at its limit [m], with a continuous onset of sliding.

    d(delta)/dt = v (1 - s),  s = (|delta|/Delta - 1 + eta)/eta limited to 0..1 if v increases |delta|, else s = 0.
    """
    forward = (deflection / limit - 1.0 + transition) / transition
    backward = (-deflection / limit - 1.0 + transition) / transition
    sliding_forward = ops.maximum(speed, 0.0) * ops.clip(forward, 0.0, 1.0)
    sliding_backward = ops.minimum(speed, 0.0) * ops.clip(backward, 0.0, 1.0)
    return speed - sliding_forward - sliding_backward


class SlipElements(Friction):
    """Friction of parallel springs, each sliding at its deflection limit (interface)."""

    element: ClassVar[tuple[str, str]] = ("bristle", "element")
    """Beginning of the names of the states, and what an element is called."""
    stiffnesses: tuple[float, ...]
    limits: tuple[float, ...]
    transition: float

    def check(self) -> None:
        if len(self.stiffnesses) != len(self.limits) or not self.limits:
            raise ParameterError(
                f"{type(self).__name__}: {len(self.stiffnesses)} stiffnesses and {len(self.limits)} limits; give one "
                "stiffness and one limit per element."
            )

    @property
    def states(self) -> tuple[StateVariable, ...]:
        elements = enumerate(zip(self._names, self.limits, strict=True), 1)
        return tuple(StateVariable(n, "m", limit, f"deflection of {self.element[1]} {i}") for i, (n, limit) in elements)

    @property
    def presliding_distance(self) -> float:
        return max(self.limits)

    def rates(self, bristles: Values, speed: Value) -> dict[str, Value]:
        limits = zip(self._names, self.limits, strict=True)
        return {name: element_rate(bristles[name], limit, self.transition, speed) for name, limit in limits}

    def force(self, bristles: Values, speed: Value) -> Value:
        return sum(k * bristles[name] for name, k in zip(self._names, self.stiffnesses, strict=True))

    @property
    def _names(self) -> list[str]:
        return [f"{self.element[0]}{i}" for i in range(1, len(self.limits) + 1)]


@model
class MaxwellSlip(SlipElements):
    """Maxwell-slip model: F = Sum k_i delta_i,  d(delta_i)/dt = v, but 0 if |delta_i| = Delta_i and v increases it.

    delta_i: deflection of element i [m]; k_i: stiffness; Delta_i: deflection limit; k_i Delta_i: Coulomb force of the
    element. `force_along` is exact. In a plant, sliding begins gradually over the last fraction eta (`transition`) of
    the deflection: d(delta)/dt = v (1 - s), where s increases linearly (chosen) from 0 at (1 - eta) Delta to 1 at
    Delta. The deflection then differs from the exact one by at most eta Delta, and the friction remains passive.
    All loops close, including inner loops, and each extremum erases the memory of smaller previous ones (Masing's
    rules). Reference: Iwan (1966); Goldfarb and Celanovic (1997); for muscles Vo-Minh et al. (2011).
    """

    references: ClassVar[tuple[Reference, ...]] = (
        published("iwan-1966"),
        published("goldfarb-celanovic-1997"),
        published("vo-minh-2011"),
    )
    linear_in: ClassVar[str | None] = "stiffnesses"

    stiffnesses: tuple[float, ...] = parameter("N/m", "k_i", "stiffness of each element", bounds=(0.0, 1e9))
    limits: tuple[float, ...] = parameter(
        "m", "Delta_i", "deflection limit of each element", bounds=(1e-9, 1.0), fitted=False
    )
    transition: float = parameter(
        "1", "eta", "fraction of the deflection over which sliding begins in a plant", bounds=(1e-4, 1.0),
        fitted=False, default=0.05,
    )  # fmt: skip

    @classmethod
    def guess(cls, scales: LoopScales) -> Self:
        return cls(scales.element_stiffnesses, scales.element_limits)

    def element_deflections(self, displacement: Any) -> Any:
        """Exact deflection [m] of every element along a displacement path [m], shape (N, elements)."""
        return stop_operators(displacement, self.limits)

    def force_along(self, displacement: Any, time: Any = None) -> Any:
        return self.element_deflections(displacement) @ self.stiffnesses

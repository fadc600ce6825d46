"""Friction of parallel elements that slide at their limits: Maxwell slip, and the model of Prandtl
and Ishlinskii.
"""

from typing import Any, ClassVar, Self

from ....core import (
    ParameterError,
    Reference,
    StateVariable,
    Value,
    Values,
    model,
    ops,
    parameter,
    published,
)
from .base import Friction
from .path import LoopScales, stop_operators

KUHNEN2003 = published("kuhnen-2003")


def element_rate(deflection: Value, limit: Value, transition: Value, speed: Value) -> Value:
    """Deflection rate [m/s] of an element that slides at its limit [m], with a continuous onset of
    sliding.

    d(delta)/dt = v (1 - s),  s = (|delta|/Delta - 1 + eta)/eta limited to 0..1 if v increases
                              |delta|, else s = 0.
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
                f"{type(self).__name__}: {len(self.stiffnesses)} stiffnesses and {len(self.limits)}"
                " limits; give one stiffness and one limit per element."
            )

    @property
    def states(self) -> tuple[StateVariable, ...]:
        elements = enumerate(zip(self._names, self.limits, strict=True), 1)
        return tuple(
            StateVariable(n, "m", limit, f"deflection of {self.element[1]} {i}")
            for i, (n, limit) in elements
        )

    @property
    def presliding_distance(self) -> float:
        return max(self.limits)

    def rates(self, bristles: Values, speed: Value) -> dict[str, Value]:
        limits = zip(self._names, self.limits, strict=True)
        return {
            name: element_rate(bristles[name], limit, self.transition, speed)
            for name, limit in limits
        }

    def force(self, bristles: Values, speed: Value) -> Value:
        return sum(
            k * bristles[name] for name, k in zip(self._names, self.stiffnesses, strict=True)
        )

    @property
    def _names(self) -> list[str]:
        return [f"{self.element[0]}{i}" for i in range(1, len(self.limits) + 1)]


@model
class MaxwellSlip(SlipElements):
    """Maxwell-slip model: F = Sum k_i delta_i,  d(delta_i)/dt = v, but 0 if |delta_i| = Delta_i and
    v increases it.

    delta_i: deflection of element i [m]; k_i: stiffness; Delta_i: deflection limit; k_i Delta_i:
    Coulomb force of the element. `force_along` is exact. In a plant, sliding begins gradually over
    the last fraction eta (`transition`) of the deflection: d(delta)/dt = v (1 - s), where s
    increases linearly (chosen) from 0 at (1 - eta) Delta to 1 at Delta. The deflection then differs
    from the exact one by at most eta Delta, and the friction remains passive. All loops close,
    including inner loops, and each extremum erases the memory of smaller previous ones (Masing's
    rules). Reference: Iwan (1966); Goldfarb and Celanovic (1997); for muscles Vo-Minh et al.
    (2011).
    """

    references: ClassVar[tuple[Reference, ...]] = (
        published("iwan-1966"),
        published("goldfarb-celanovic-1997"),
        published("vo-minh-2011"),
    )
    linear_in: ClassVar[str | None] = "stiffnesses"

    stiffnesses: tuple[float, ...] = parameter(
        "N/m", "k_i", "stiffness of each element", bounds=(0.0, 1e9)
    )
    limits: tuple[float, ...] = parameter(
        "m", "Delta_i", "deflection limit of each element", bounds=(1e-9, 1.0), fitted=False
    )
    transition: float = parameter(
        "1",
        "eta",
        "fraction of the deflection over which sliding begins in a plant",
        bounds=(1e-4, 1.0),
        fitted=False,
        default=0.05,
    )

    @classmethod
    def guess(cls, scales: LoopScales) -> Self:
        return cls(scales.element_stiffnesses, scales.element_limits)

    def element_deflections(self, displacement: Any) -> Any:
        """Exact deflection [m] of every element along a displacement path [m], shape (N,
        elements).
        """
        return stop_operators(displacement, self.limits)

    def force_along(self, displacement: Any, time: Any = None) -> Any:
        return self.element_deflections(displacement) @ self.stiffnesses


@model
class PrandtlIshlinskii(SlipElements):
    """Modified Prandtl-Ishlinskii model: F = S(Sum k_i E_ri[x]),  S(u) = u + Sum w_j S_dj(u).

    E_r: stop operator, which follows the displacement x within the limits -r..r. S_d: dead zone,
    max(u - d, 0) for d > 0 and min(u - d, 0) for d < 0. S must be increasing, otherwise friction
    would supply energy: on either side, one plus the sum of the active weights must not be
    negative. Without dead zones the model is the Maxwell-slip model. `force_along` is exact; in a
    plant a stop begins to slide over the last fraction eta of its deflection, as in MaxwellSlip.
    Stop operators instead of Kuhnen's play operators give a force that saturates; the remainder x -
    E_r[x] belongs to the parallel spring of the muscle. Reference: Kuhnen (2003); Al Janaideh et
    al. (2011).
    """

    references: ClassVar[tuple[Reference, ...]] = (KUHNEN2003, published("al-janaideh-2011"))
    element: ClassVar[tuple[str, str]] = ("stop", "stop")

    stiffnesses: tuple[float, ...] = parameter(
        "N/m", "k_i", "stiffness of each stop", bounds=(0.0, 1e9)
    )
    limits: tuple[float, ...] = parameter(
        "m", "r_i", "deflection limit of each stop", bounds=(1e-9, 1.0), fitted=False
    )
    thresholds: tuple[float, ...] = parameter(
        "N",
        "d_j",
        "threshold force of each dead zone",
        bounds=(-1e5, 1e5),
        fitted=False,
        default=(),
    )
    weights: tuple[float, ...] = parameter(
        "1", "w_j", "weight of each dead zone", bounds=(-1.0, 100.0), default=()
    )
    transition: float = parameter(
        "1",
        "eta",
        "fraction of the deflection over which sliding begins in a plant",
        bounds=(1e-4, 1.0),
        fitted=False,
        default=0.05,
    )

    @classmethod
    def guess(cls, scales: LoopScales) -> Self:
        return cls(
            scales.element_stiffnesses,
            scales.element_limits,
            (0.1 * scales.amplitude, -0.1 * scales.amplitude),
            (0.0, 0.0),
        )

    def check(self) -> None:
        super().check()
        if len(self.thresholds) != len(self.weights) or 0.0 in self.thresholds:
            raise ParameterError(
                f"PrandtlIshlinskii: {len(self.thresholds)} thresholds and {len(self.weights)}"
                " weights; give one threshold, other than 0, and one weight per dead zone."
            )
        for sign in (1.0, -1.0):
            slope = 1.0
            for threshold, weight in sorted(
                zip(self.thresholds, self.weights, strict=True), key=lambda z: abs(z[0])
            ):
                slope += weight if sign * threshold > 0 else 0.0
                if slope < 0:
                    raise ParameterError(
                        f"PrandtlIshlinskii: with the weight {weight:g} at {threshold:g} N the"
                        " force would decrease with deflection, and friction would supply energy."
                        " On either side of zero force, the sum of the weights must not be less"
                        " than -1."
                    )

    def force(self, bristles: Values, speed: Value) -> Value:
        return self.apply_dead_zones(super().force(bristles, speed))

    def apply_dead_zones(self, force: Value) -> Value:
        """S(u): force [N] after the dead zones, from the force u [N] of the stops."""
        total = force
        for threshold, weight in zip(self.thresholds, self.weights, strict=True):
            excess = force - threshold
            total = total + weight * ops.where(
                threshold > 0, ops.maximum(excess, 0.0), ops.minimum(excess, 0.0)
            )
        return total

    def force_along(self, displacement: Any, time: Any = None) -> Any:
        return self.apply_dead_zones(stop_operators(displacement, self.limits) @ self.stiffnesses)

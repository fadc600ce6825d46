"""Maxwell slip: springs in parallel, each of which slides once it is bent to its limit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from ..core import ops
from ..core.declaration import model, parameter
from ..core.errors import ParameterError
from ..core.ops import Value
from ..core.reference import Reference
from ..core.variables import StateVariable
from .base import Friction
from .path import stop_operators

IWAN1966 = Reference(
    key="iwan-1966",
    authors="Iwan, W. D.",
    title="A distributed-element model for hysteresis and its steady-state dynamic response",
    where="Journal of Applied Mechanics 33(4), 893-900",
    year=1966,
    doi="10.1115/1.3625199",
    note="springs with Coulomb sliders, in parallel",
)
GOLDFARB_CELANOVIC1997 = Reference(
    key="goldfarb-celanovic-1997",
    authors="Goldfarb, M., Celanovic, N.",
    title="Modeling piezoelectric stack actuators for control of micromanipulation",
    where="IEEE Control Systems Magazine 17(3), 69-79",
    year=1997,
    doi="10.1109/37.588158",
    note="the same elements for the hysteresis of an actuator",
)
VO_MINH2011 = Reference(
    key="vo-minh-2011",
    authors="Vo-Minh, T., Tjahjowidodo, T., Ramon, H., Van Brussel, H.",
    title="A new approach to modeling hysteresis in a pneumatic artificial muscle using the Maxwell-slip model",
    where="IEEE/ASME Transactions on Mechatronics 16(1), 177-186",
    year=2011,
    doi="10.1109/TMECH.2009.2038373",
    note="the same elements for the hysteresis of a pneumatic artificial muscle; its numbers were not taken",
)


def element_rate(bend: Value, limit: Value, transition: Value, speed: Value) -> Value:
    """The rate [m/s] of a bristle that slides at its limit [m], with a continuous start of sliding.

    d(delta)/dt = v (1 - s),  s = (|delta|/Delta - 1 + eta)/eta within 0..1 where v bends it further, else 0.
    """
    onward = (bend / limit - 1.0 + transition) / transition
    backward = (-bend / limit - 1.0 + transition) / transition
    sliding = ops.maximum(speed, 0.0) * ops.clip(onward, 0.0, 1.0)
    sliding_back = ops.minimum(speed, 0.0) * ops.clip(backward, 0.0, 1.0)
    return speed - sliding - sliding_back


def check_equal_lengths(owner: str, stiffnesses: Sequence[Value], limits: Sequence[Value]) -> None:
    """Raise ParameterError unless every element has a stiffness and a limit, one element at least."""
    if len(stiffnesses) != len(limits) or not limits:
        raise ParameterError(
            f"{owner}: {len(stiffnesses)} stiffnesses and {len(limits)} limits; give one of each for every element."
        )


@model
class MaxwellSlip(Friction):
    """F = Sum k_i delta_i,  d(delta_i)/dt = v, but 0 where |delta_i| = Delta_i and v would bend it further.

    delta_i deflection of element i [m], k_i its stiffness, Delta_i the deflection at which it slides; so k_i Delta_i
    is its Coulomb force. `replay` is exact. In a plant sliding starts over the last part eta (`transition`) of the
    deflection, by d(delta)/dt = v (1 - s) with s rising from 0 at (1 - eta) Delta to 1 at Delta (chosen: linearly):
    the deflection is then never farther than eta Delta from the exact one, and the friction stays passive.
    Loops close, inner loops too, and each extremum wipes out the smaller ones before it (Masing's rules).
    Reference: Iwan (1966); Goldfarb and Celanovic (1997); for muscles Vo-Minh et al. (2011).
    """

    references: ClassVar[tuple[Reference, ...]] = (IWAN1966, GOLDFARB_CELANOVIC1997, VO_MINH2011)
    linear_in: ClassVar[str | None] = "stiffnesses"

    stiffnesses: tuple[float, ...] = parameter("N/m", "k_i", "stiffness of each element", bounds=(0.0, 1e9))
    limits: tuple[float, ...] = parameter(
        "m", "Delta_i", "deflection at which each element slides", bounds=(1e-9, 10.0), fitted=False
    )
    transition: float = parameter(
        "1", "eta", "share of the deflection over which sliding starts in a plant", bounds=(1e-4, 1.0),
        fitted=False, default=0.05,
    )  # fmt: skip

    def check(self) -> None:
        check_equal_lengths("MaxwellSlip", self.stiffnesses, self.limits)

    @property
    def states(self) -> tuple[StateVariable, ...]:
        return tuple(
            StateVariable(f"bristle{i}", "m", limit, f"deflection of element {i}")
            for i, limit in enumerate(self.limits, 1)
        )

    @property
    def presliding_distance(self) -> float:
        return max(self.limits)

    def rates(self, bristles: Mapping[str, Value], speed: Value) -> dict[str, Value]:
        elements = enumerate(self.limits, 1)
        return {
            f"bristle{i}": element_rate(bristles[f"bristle{i}"], limit, self.transition, speed) for i, limit in elements
        }

    def force(self, bristles: Mapping[str, Value], speed: Value) -> Value:
        return sum(k * bristles[f"bristle{i}"] for i, k in enumerate(self.stiffnesses, 1))

    def element_deflections(self, displacement: Any) -> Any:
        """The exact deflection [m] of every element along a path, shape (N, elements)."""
        return stop_operators(displacement, self.limits)

    def force_along(self, displacement: Any, time: Any = None) -> Any:
        return self.element_deflections(displacement) @ self.stiffnesses

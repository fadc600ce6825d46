"""The modified Prandtl-Ishlinskii hysteresis: stop operators, and dead zones that make its loops lopsided."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from ..core import ops
from ..core.declaration import model, parameter
from ..core.errors import ParameterError
from ..core.ops import Value
from ..core.reference import Reference
from ..core.variables import StateVariable
from .base import Friction
from .maxwell_slip import check_equal_lengths, element_rate
from .path import stop_operators

KUHNEN2003 = Reference(
    key="kuhnen-2003",
    authors="Kuhnen, K.",
    title="Modeling, identification and compensation of complex hysteretic nonlinearities: a modified "
    "Prandtl-Ishlinskii approach",
    where="European Journal of Control 9(4), 407-418",
    year=2003,
    doi="10.3166/ejc.9.407-418",
    note="superposition of dead-zone operators behind a Prandtl-Ishlinskii operator; there made of play operators",
)
AL_JANAIDEH2011 = Reference(
    key="al-janaideh-2011",
    authors="Al Janaideh, M., Rakheja, S., Su, C.-Y.",
    title="An analytical generalized Prandtl-Ishlinskii model inversion for hysteresis compensation in "
    "micropositioning control",
    where="IEEE/ASME Transactions on Mechatronics 16(4), 734-744",
    year=2011,
    doi="10.1109/TMECH.2010.2052366",
    note="lopsided and saturating loops of actuators",
)


@model
class PrandtlIshlinskii(Friction):
    """F = S(Sum k_i E_ri[x]),  S(u) = u + Sum w_j S_dj(u).

    E_r stop operator: it follows x, held within -r..r. S_d dead zone: max(u - d, 0) for d > 0, min(u - d, 0) for
    d < 0. x displacement [m], k_i stiffness and r_i limit of each stop, d_j [N] and w_j [1] threshold and weight of
    each dead zone. The weights must leave S rising, else friction would drive: 1 + the sum of the weights at work on
    either side stays positive. Without dead zones the law is Maxwell slip. `replay` is exact; in a plant a stop yields
    over the last part eta of its deflection as in MaxwellSlip. Stops in place of Kuhnen's plays make it a force that
    saturates; the play part x - E_r[x] is the muscle's spring.
    Reference: Kuhnen (2003); Al Janaideh et al. (2011).
    """

    references: ClassVar[tuple[Reference, ...]] = (KUHNEN2003, AL_JANAIDEH2011)

    stiffnesses: tuple[float, ...] = parameter("N/m", "k_i", "stiffness of each stop", bounds=(0.0, 1e9))
    limits: tuple[float, ...] = parameter(
        "m", "r_i", "deflection at which each stop slides", bounds=(1e-9, 10.0), fitted=False
    )
    thresholds: tuple[float, ...] = parameter(
        "N", "d_j", "force from which each dead zone lets through", bounds=(-1e5, 1e5), fitted=False, default=()
    )
    weights: tuple[float, ...] = parameter("1", "w_j", "weight of each dead zone", bounds=(-1.0, 100.0), default=())
    transition: float = parameter(
        "1", "eta", "share of the deflection over which sliding starts in a plant", bounds=(1e-4, 1.0),
        fitted=False, default=0.05,
    )  # fmt: skip

    def check(self) -> None:
        check_equal_lengths("PrandtlIshlinskii", self.stiffnesses, self.limits)
        if len(self.thresholds) != len(self.weights) or 0.0 in self.thresholds:
            raise ParameterError(
                f"PrandtlIshlinskii: {len(self.thresholds)} thresholds and {len(self.weights)} weights; give one of "
                "each for every dead zone, no threshold 0."
            )
        for sign in (1.0, -1.0):
            slope = 1.0
            for threshold, weight in sorted(zip(self.thresholds, self.weights, strict=True), key=lambda z: abs(z[0])):
                slope += weight if sign * threshold > 0 else 0.0
                if slope < 0:
                    raise ParameterError(
                        f"PrandtlIshlinskii: with the weight {weight:g} at {threshold:g} N the force would fall as the "
                        "stops bend further, and friction would drive. Sums of weights on either side must exceed -1."
                    )

    @property
    def states(self) -> tuple[StateVariable, ...]:
        return tuple(
            StateVariable(f"stop{i}", "m", limit, f"deflection of stop {i}") for i, limit in enumerate(self.limits, 1)
        )

    @property
    def presliding_distance(self) -> float:
        return max(self.limits)

    def rates(self, bristles: Mapping[str, Value], speed: Value) -> dict[str, Value]:
        elements = enumerate(self.limits, 1)
        return {f"stop{i}": element_rate(bristles[f"stop{i}"], limit, self.transition, speed) for i, limit in elements}

    def force(self, bristles: Mapping[str, Value], speed: Value) -> Value:
        return self.apply_dead_zones(sum(k * bristles[f"stop{i}"] for i, k in enumerate(self.stiffnesses, 1)))

    def apply_dead_zones(self, force: Value) -> Value:
        """S(u): the force [N] of the stops after the dead zones."""
        total = force
        for threshold, weight in zip(self.thresholds, self.weights, strict=True):
            beyond = force - threshold
            total = total + weight * ops.where(threshold > 0, ops.maximum(beyond, 0.0), ops.minimum(beyond, 0.0))
        return total

    def force_along(self, displacement: Any, time: Any = None) -> Any:
        return self.apply_dead_zones(stop_operators(displacement, self.limits) @ self.stiffnesses)

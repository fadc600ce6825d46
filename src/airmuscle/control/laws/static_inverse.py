"""Static inverse of a muscle: the pressure for a contraction and a tension, and feed-forward by it."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ...core import ParameterError, Reference, Value, model, ops, parameter, published, within
from ...physics.muscle.characteristic.base import ForceLaw
from ...physics.muscle.geometry.meridian import SAGA_2007
from ...physics.muscle.muscle import Muscle
from ...physics.muscle.series import ElasticSeriesElement
from .open_loop import OpenLoopLaw


@model
class StaticInverse:
    """Static inverse p(eps, F): the gauge pressure with F_0(p, eps) = F, limited to p_min to p_max.

    F_0 is the force law without its limits, or the static force of a muscle (contractile element, parallel spring, end
    stop). It must increase with p. The root is found by n steps of the secant method of Anderson and Björck between
    p_min and p_max, so that the inverse is an expression that can be compiled. One step is exact for a law that is
    affine in p. For n = 10 the force at the returned pressure differs from F by less than 1e-9 of the force range for
    the laws of this package (tested). A force that no pressure in the range produces gives the nearer limit.

    A characteristic that is not a traceable force law is approximated first: `as_force_law(law, validity_range)`. Its
    estimated `max_error` [N] divided by dF/dp estimates the maximum error of the inverse [Pa]. A muscle with a series
    spring is refused.
    References: Saga et al. (2007) for the purpose; Anderson and Björck (1973) for the root.
    """

    references: ClassVar[tuple[Reference, ...]] = (SAGA_2007, published("anderson-bjorck-1973"))

    law: ForceLaw | Muscle
    min_pressure: float = parameter(
        "Pa", "p_min", "minimum gauge pressure of the inverse", bounds=(-1e5, 1e7), fitted=False, default=0.0
    )
    max_pressure: float = parameter(
        "Pa", "p_max", "maximum gauge pressure of the inverse", bounds=(1.0, 1e7), fitted=False, default=6e5
    )
    steps: int = within(1, 40, default=10)

    def check(self) -> None:
        check_invertible("StaticInverse", self.law)

    def force(self, pressure: Value, contraction: Value) -> Value:
        """Tension [N] that is inverted, at a gauge pressure [Pa] and a contraction [1]; arrays broadcast."""
        return static_force(self.law, pressure, contraction)

    def pressure(self, contraction: Value, force: Value) -> Value:
        """Gauge pressure [Pa] at a contraction [1] and a tension [N]; arrays broadcast."""
        with np.errstate(over="ignore", invalid="ignore"):  # beyond the range of tensions, where no iterate is used
            return pressure_between(self.min_pressure, self.max_pressure, self.law, contraction, force, self.steps)


def pressure_between(
    low: Value, high: Value, law: ForceLaw | Muscle, contraction: Value, force: Value, steps: int
) -> Value:
    """Gauge pressure [Pa] from `low` to `high` at which a law has a tension [N] at a contraction [1]."""
    at_low, at_high = (static_force(law, p, contraction) - force for p in (low, high))
    a, b, at_a, at_b = low, high, at_low, at_high
    for _ in range(steps):
        difference = at_b - at_a
        c = b - at_b * (b - a) / ops.where(difference == 0.0, 1.0, difference)
        at_c = static_force(law, c, contraction) - force
        crossed = at_c * at_b < 0.0
        share = 1.0 - at_c / ops.where(at_b == 0.0, 1.0, at_b)
        a = ops.where(crossed, b, a)
        at_a = ops.where(crossed, at_b, at_a * ops.where(share > 0.0, share, 0.5))
        b, at_b = c, at_c
    return ops.where(at_low >= 0.0, low, ops.where(at_high <= 0.0, high, b))


def static_force(law: ForceLaw | Muscle, pressure: Value, contraction: Value) -> Value:
    """Static tension [N] without lower limit at a gauge pressure [Pa] and a contraction [1]."""
    if isinstance(law, Muscle):
        elements = law.contractile.unclamped_force(pressure, contraction)
        length = law.geometry.resting_length
        spring = law.spring.force(pressure, contraction, length)
        return elements - spring - law.stop.force(contraction, 0.0, length)
    return law.unclamped_force(pressure, contraction)


def check_invertible(owner: str, law: ForceLaw | Muscle) -> None:
    """Raise ParameterError for a law that cannot be traced, or a muscle with a series spring."""
    contractile = law.contractile if isinstance(law, Muscle) else law
    if not contractile.traceable:
        raise ParameterError(
            f"{owner}: {type(contractile).__name__} has no closed form. Approximate it first: "
            "as_force_law(law, ValidityRange(...)) estimates its error."
        )
    if isinstance(law, Muscle) and isinstance(law.series, ElasticSeriesElement):
        raise ParameterError(
            f"{owner}: the muscle has a series spring, whose stretch the inverse does not contain. Give the muscle "
            "without it, replace(muscle, series=RigidSeriesElement())."
        )


@model
class StaticFeedForward(OpenLoopLaw):
    """u = p(eps_0 + x_r/L_0, F_r + m a_r): the pressure of the static inverse for the wanted position and load.

    x_r set point of the position, F_r wanted load: a set point where `load_setpoint` names one, else the parameter
    `load`; a_r set point of the acceleration where `acceleration_setpoint` names one. Nothing is measured. The input
    is a pressure: the set point of a pressure regulator, or that of an inner pressure controller (`Cascade`). Beside
    feedback it is used in `WithFeedForward`. Friction, heat and the pressure's delay are not compensated.
    Reference: Saga et al. (2007), whose static model is meant for feed-forward control.
    """

    references: ClassVar[tuple[Reference, ...]] = (SAGA_2007,)

    inverse: StaticInverse
    commanded: str
    resting_length: float = parameter("m", "L_0", "resting length of the muscle", bounds=(1e-3, 100.0))
    load: float = parameter("N", "F_r", "wanted load where it is no set point", bounds=(-1e6, 1e6), default=0.0)
    mass: float = parameter("kg", "m", "mass that follows the wanted acceleration", bounds=(0.0, 1e6), default=0.0)
    offset: float = parameter("1", "eps_0", "contraction at position 0", bounds=(-0.5, 0.9), default=0.0)
    position: str = "position"
    load_setpoint: str = ""
    acceleration_setpoint: str = ""

    @property
    def setpoints(self) -> tuple[str, ...]:
        return (self.position, *(name for name in (self.load_setpoint, self.acceleration_setpoint) if name))

    @property
    def signal_units(self) -> dict[str, str]:
        named = {self.load_setpoint: "N", self.acceleration_setpoint: "m/s2"}
        return {name: unit for name, unit in named.items() if name}

    def command(self, setpoints: Mapping[str, Value]) -> dict[str, Value]:
        force = setpoints[self.load_setpoint] if self.load_setpoint else self.load
        if self.acceleration_setpoint:
            force = force + self.mass * setpoints[self.acceleration_setpoint]
        contraction = self.offset + setpoints[self.position] / self.resting_length
        return {self.commanded: self.inverse.pressure(contraction, force)}

"""Friction (interface): hysteresis models with internal bristle states, and the wrappers of a
law.
"""

import abc
from typing import Any, ClassVar, NamedTuple, Self

from ....core import Reference, StateVariable, Value, Values, model, ops, parameter, published
from ....core.declaration import forwarded
from .path import LoopScales


class IdentifiedRange(NamedTuple):
    """Lower and upper limits of the gauge pressure [Pa] and of the speed [m/s] in the data of a
    friction law.
    """

    pressure: tuple[float, float]
    speed: tuple[float, float]


class Friction(abc.ABC):
    """Friction force that depends on the history of the displacement.

    Bristle deflections are mappings keyed by the names of `states`. `speed` [m/s] and force [N] are
    positive in the direction of shortening, and the force is subtracted from the tension of the
    muscle. No model uses the sign of the speed, so that the rates are continuous and can be
    integrated with large steps. The friction of a muscle is `force` times `pressure_factor`.
    """

    references: ClassVar[tuple[Reference, ...]] = ()
    rate_independent: ClassVar[bool] = True
    """Whether the force depends on the path only, not on the speed."""
    linear_in: ClassVar[str | None] = None
    """The field in which the force of `force_along` is linear, or None; a fit solves for it by
    linear least squares.
    """

    @classmethod
    def guess(cls, scales: LoopScales) -> Self | None:
        """The law with initial parameters for a fit to a loop of these scales; None for a law that
        is not fitted.
        """
        return None

    @property
    @abc.abstractmethod
    def states(self) -> tuple[StateVariable, ...]:
        """The bristle deflections; all are zero in the relaxed state."""

    @abc.abstractmethod
    def rates(self, bristles: Values, speed: Value) -> dict[str, Value]:
        """Time derivative of every bristle deflection at a speed [m/s]."""

    @abc.abstractmethod
    def force(self, bristles: Values, speed: Value) -> Value:
        """Friction force [N] at a speed [m/s]."""

    @abc.abstractmethod
    def force_along(self, displacement: Any, time: Any = None) -> Any:
        """Force [N] along a displacement path [m] that starts with relaxed bristles; NumPy arrays
        of shape (N,).

        The motion is assumed linear between rows, so that every turning point must be a row. `time`
        [s] is used by rate-dependent models; without it the motion is quasi-static.
        """

    @property
    @abc.abstractmethod
    def presliding_distance(self) -> float:
        """Characteristic displacement of presliding [m], used for plots and nominal sizes."""

    @property
    def identified_range(self) -> IdentifiedRange | None:
        """The range of the data to which the parameters were fitted; None if it is not known."""
        return None

    def pressure_factor(self, pressure: Value) -> Value:
        """Factor of the force at a gauge pressure [Pa]; 1 unless the friction depends on the
        pressure.
        """
        return 1.0


@model
class NoFriction(Friction):
    """No friction: F = 0."""

    states = ()

    def rates(self, bristles: Values, speed: Value) -> dict[str, Value]:
        return {}

    def force(self, bristles: Values, speed: Value) -> Value:
        return 0.0

    def force_along(self, displacement: Any, time: Any = None) -> Any:
        return 0.0 * displacement

    presliding_distance = 0.0


class FrictionWrapper(Friction):
    """Wrapper that forwards everything to the inner friction law; subclasses override single
    properties.
    """

    inner: Friction

    rate_independent = forwarded("inner.rate_independent")
    states = forwarded("inner.states")
    presliding_distance = forwarded("inner.presliding_distance")
    identified_range = forwarded("inner.identified_range")
    pressure_factor = forwarded("inner.pressure_factor")
    rates = forwarded("inner.rates")
    force = forwarded("inner.force")
    force_along = forwarded("inner.force_along")


@model
class IdentifiedFriction(FrictionWrapper):
    """Friction law with the range of its data; a simulation reports when and how far the range is
    left.

    The force is that of the inner law, inside and outside the range. There is no lower limit of the
    speed, because every motion begins and ends at rest.
    """

    inner: Friction
    min_pressure: float = parameter(
        "Pa",
        "p_low",
        "lower limit of the gauge pressure in the data",
        bounds=(-101325.0, 1e7),
        fitted=False,
    )
    max_pressure: float = parameter(
        "Pa",
        "p_high",
        "upper limit of the gauge pressure in the data",
        bounds=(-101325.0, 1e7),
        fitted=False,
    )
    max_speed: float = parameter(
        "m/s",
        "v_high",
        "maximum speed in the data; 100 m/s where it is not known",
        bounds=(1e-9, 100.0),
        fitted=False,
        default=100.0,
    )

    @property
    def identified_range(self) -> IdentifiedRange | None:
        return IdentifiedRange(
            (self.min_pressure, self.max_pressure), (-self.max_speed, self.max_speed)
        )


TONDU_LOPEZ2000 = published(
    "tondu-lopez-2000",
    "dry friction between the threads, proportional to the contact pressure; the affine form is"
    " chosen here",
)


@model
class PressureScaledFriction(FrictionWrapper):
    """Friction with a force scale: F = s(p) F_1,  s(p) = max(a + (1 - a) p/p_r, 0).

    F_1: force of the inner law, which is the friction at the reference pressure p_r; p: gauge
    pressure; a: ratio of the friction at ambient pressure to that at p_r. a = 0 is a friction
    proportional to the pressure between the threads, as in Tondu and Lopez (2000) and Davis and
    Caldwell (2006); a = 1 does not depend on the pressure. The affine form (chosen) adds the
    friction of the unpressurised braid. All terms of the inner law are scaled, so that the
    presliding distance does not depend on the pressure (chosen).
    """

    references: ClassVar[tuple[Reference, ...]] = (
        TONDU_LOPEZ2000,
        published("davis-caldwell-2006"),
    )

    inner: Friction
    ambient_ratio: float = parameter(
        "1",
        "a",
        "friction at ambient pressure relative to that at the reference pressure",
        bounds=(0.0, 10.0),
        default=0.0,
    )
    reference_pressure: float = parameter(
        "Pa",
        "p_r",
        "gauge pressure at which the scale is 1",
        bounds=(1e3, 1e7),
        fitted=False,
        default=1e5,
    )

    def pressure_factor(self, pressure: Value) -> Value:
        scale = self.ambient_ratio + (1.0 - self.ambient_ratio) * pressure / self.reference_pressure
        return ops.maximum(scale, 0.0) * self.inner.pressure_factor(pressure)

"""A wrapper: one force law for muscles of one type and different length, whose ends do not take part."""

from __future__ import annotations

import dataclasses
from typing import Any

from ..core.declaration import model, parameter
from ..core.errors import ParameterError
from ..core.ops import Value
from .base import ForceLaw

_RANGE_FACTOR = 2.0
"""Widening of a surface's validity range: so much more than the whole muscle its middle may contract (chosen)."""


@model
class EffectiveLength(ForceLaw):
    """F = F_inner(p, (eps L_0 + d)/(L_0 - l_d)).

    eps contraction of the whole muscle, L_0 its length between the fittings. The ends take l_d of it that does not
    contract; d is the length by which they give under pressure or the zero of a bench is off. Short muscles so
    contract less. `with_resting_length` gives the law of another muscle of the type. Made for this program; that a dead
    length at the ends limits short muscles is Tondu and Lopez (2000), whose end correction is L_0/(L_0 - l_d).
    """

    inner: ForceLaw
    resting_length: float = parameter(
        "m", "L_0", "length between the fittings, unpressurised and unloaded", bounds=(1e-3, 20.0), fitted=False
    )
    dead_length: float = parameter("m", "l_d", "length of the ends that does not contract", bounds=(-1.0, 1.0))
    end_shift: float = parameter("m", "d", "length by which the ends give", bounds=(-0.1, 0.1), default=0.0)

    def check(self) -> None:
        if not self.dead_length < self.resting_length:
            raise ParameterError(
                f"EffectiveLength: dead_length {self.dead_length:g} m must lie below resting_length "
                f"{self.resting_length:g} m."
            )

    @property
    def contraction_range(self) -> tuple[float, float]:
        low, high = self.inner.contraction_range
        length, active = self.resting_length, self.resting_length - self.dead_length
        return ((low * active - self.end_shift) / length, (high * active - self.end_shift) / length)

    @property
    def linear_in(self) -> tuple[str, ...]:
        """What the inner law is linear in; the lengths are not among it."""
        named = getattr(self.inner, "linear_in", ())
        return tuple(f"inner.{field}" for field in ((named,) if isinstance(named, str) else named))

    def with_resting_length(self, resting_length: float) -> EffectiveLength:
        """The law of a muscle of the same type with this length [m] between the fittings."""
        return dataclasses.replace(self, resting_length=resting_length)

    def with_validity_range(self, pressure: tuple[float, float], contraction: tuple[float, float]) -> EffectiveLength:
        """The law with its inner surface on a validity range that leaves room for the middle to contract more."""
        inner: Any = self.inner
        if not hasattr(inner, "with_validity_range"):
            return self
        low, high = contraction
        room = (_RANGE_FACTOR - 1) * (high - low) / 2
        return dataclasses.replace(self, inner=inner.with_validity_range(pressure, (low - room, high + room)))

    def force(self, pressure: Value, contraction: Value) -> Value:
        return self.inner.force(pressure, self._active_contraction(contraction))

    def unclamped_force(self, pressure: Value, contraction: Value) -> Value:
        return self.inner.unclamped_force(pressure, self._active_contraction(contraction))

    def _active_contraction(self, contraction: Value) -> Value:
        shortening = contraction * self.resting_length + self.end_shift
        return shortening / (self.resting_length - self.dead_length)

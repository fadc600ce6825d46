"""Wrappers: one force law for muscles of one type and different length, as a law plus a share of its change."""

from __future__ import annotations

import abc
import dataclasses
from typing import Any, Self

from ..core import ops
from ..core.declaration import model, parameter
from ..core.ops import Value
from .base import ForceLaw


@model
class LengthFamily(ForceLaw):
    """F = max(0, F_inner(p, eps) + s(L_0) F_change(p, eps)), with a share s that is zero at the reference length.

    L_0 length between the fittings. Each family says how its share depends on it; clamps inside do not act.
    """

    inner: ForceLaw
    change: ForceLaw
    resting_length: float = parameter(
        "m", "L_0", "length between the fittings, unpressurised and unloaded", bounds=(1e-3, 20.0), fitted=False
    )
    reference_length: float = parameter(
        "m", "L_ref", "length at which the inner law is the whole", bounds=(1e-3, 20.0), fitted=False
    )

    @property
    def contraction_range(self) -> tuple[float, float]:
        return self.inner.contraction_range

    @property
    def linear_in(self) -> tuple[str, ...]:
        """Where both parts are linear in their coefficients, the whole is."""
        parts: tuple[tuple[str, Any], ...] = (("inner", self.inner), ("change", self.change))
        fields = [f"{name}.{part.linear_in}" for name, part in parts if hasattr(part, "linear_in")]
        return tuple(fields) if len(fields) == len(parts) else ()

    def with_resting_length(self, resting_length: float) -> Self:
        """The law of a muscle of the same type with this length [m] between the fittings."""
        return dataclasses.replace(self, resting_length=resting_length)

    def with_validity_range(self, pressure: tuple[float, float], contraction: tuple[float, float]) -> Self:
        """The law with its surfaces on another validity range."""
        parts: dict[str, Any] = {"inner": self.inner, "change": self.change}
        boxed = {
            n: p.with_validity_range(pressure, contraction)
            for n, p in parts.items()
            if hasattr(p, "with_validity_range")
        }
        return dataclasses.replace(self, **boxed)

    def force(self, pressure: Value, contraction: Value) -> Value:
        return ops.maximum(self.unclamped_force(pressure, contraction), 0.0)

    @abc.abstractmethod
    def length_factor(self) -> Value:
        """s [1] at this muscle's length."""

    def unclamped_force(self, pressure: Value, contraction: Value) -> Value:
        whole = self.inner.unclamped_force(pressure, contraction)
        return whole + self.length_factor() * self.change.unclamped_force(pressure, contraction)


@model
class InverseLength(LengthFamily):
    """F = max(0, F_inner(p, eps) + (L_ref/L_0 - 1) F_change(p, eps)).

    L_0 length between the fittings, L_ref the length at which F_inner is the whole law; clamps inside do not act.
    If both are surfaces, every coefficient has a term in 1/L_0: what ends of a fixed size do. `with_resting_length` gives
    the law of another muscle of the type. Made for this program.
    """

    def length_factor(self) -> Value:
        return self.reference_length / self.resting_length - 1.0


@model
class LogarithmicLength(LengthFamily):
    """F = max(0, F_inner(p, eps) + ln(L_0/L_ref) F_change(p, eps)).

    L_0 length between the fittings, L_ref the length at which F_inner is the whole law; clamps inside do not act.
    Between a term in 1/L_0, which is all but gone in long muscles, and one in L_0, which has no end. `with_resting_length`
    gives the law of another muscle of the type. Made for this program, after measured muscles of 83 to 382 mm whose
    force grew about as much with the first doubling of their length as with the second.
    """

    def length_factor(self) -> Value:
        return ops.log(self.resting_length / self.reference_length)

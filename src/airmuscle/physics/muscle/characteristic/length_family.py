"""Wrappers for muscles of one type and different lengths: a force law plus a length-dependent correction."""

import abc
import dataclasses
from collections.abc import Callable
from typing import Any, ClassVar, Self

from ....core import Value, model, ops, parameter
from .base import Characteristic, ForceLaw
from .data_scales import DataScales, MeasuredPoints


@model
class LengthFamily(ForceLaw):
    """Base class: F = max(0, F_inner(p, eps) + s(L_0) F_change(p, eps)), with s = 0 at the reference length.

    L_0: length between the fittings; s: length factor, defined by the subclass. Force limits of the inner models are
    not applied.
    """

    term: ClassVar[str]
    """The length factor as a text, in the names of `variants`."""

    inner: ForceLaw
    change: ForceLaw
    resting_length: float = parameter(
        "m", "L_0", "length between the fittings, unpressurised and unloaded", bounds=(1e-3, 20.0), fitted=False
    )
    reference_length: float = parameter(
        "m", "L_ref", "reference length, at which the correction is zero", bounds=(1e-3, 20.0), fitted=False
    )

    @classmethod
    def variants(cls, data: MeasuredPoints, surface: Callable[[int], ForceLaw]) -> dict[str, Characteristic]:
        length = DataScales.of(data).check_lengths().resting_length
        return {
            f"term in {cls.term}, degree {n}, change of degree {k}": cls(surface(n), surface(k), length, length)
            for n in range(2, 6)
            for k in range(1, min(n, 3) + 1)
        }

    @property
    def contraction_range(self) -> tuple[float, float]:
        return self.inner.contraction_range

    @property
    def linear_in(self) -> tuple[str, ...]:
        """The coefficients of both models if both are linear in them, else none."""
        inner, change = _linear_fields(self.inner), _linear_fields(self.change)
        if not (inner and change):
            return ()
        return (*(f"inner.{field}" for field in inner), *(f"change.{field}" for field in change))

    def with_resting_length(self, resting_length: float) -> Self:
        """Return the model of a muscle of the same type with this resting length [m]."""
        return dataclasses.replace(self, resting_length=resting_length)

    def with_validity_range(self, pressure: tuple[float, float], contraction: tuple[float, float]) -> Self:
        """Return the model with its surfaces on another validity range."""
        return self._on_range("with_validity_range", pressure, contraction)

    def rescaled(self, pressure: tuple[float, float], contraction: tuple[float, float]) -> Self:
        """Return the same force law with its surfaces on another validity range."""
        return self._on_range("rescaled", pressure, contraction)

    def _on_range(self, method: str, pressure: tuple[float, float], contraction: tuple[float, float]) -> Self:
        models: dict[str, Any] = {"inner": self.inner, "change": self.change}
        surfaces = {
            name: getattr(law, method)(pressure, contraction) for name, law in models.items() if hasattr(law, method)
        }
        return dataclasses.replace(self, **surfaces)

    def force(self, pressure: Value, contraction: Value) -> Value:
        return ops.maximum(self.unclamped_force(pressure, contraction), 0.0)

    @abc.abstractmethod
    def length_factor(self) -> Value:
        """Length factor s [1] of this muscle."""

    def unclamped_force(self, pressure: Value, contraction: Value) -> Value:
        reference = self.inner.unclamped_force(pressure, contraction)
        return reference + self.length_factor() * self.change.unclamped_force(pressure, contraction)


@model
class InverseLength(LengthFamily):
    """Length factor in 1/L_0: F = max(0, F_inner(p, eps) + (L_ref/L_0 - 1) F_change(p, eps)).

    L_0: length between the fittings; L_ref: reference length. Force limits of the inner models are not applied. If both
    models are surfaces, every coefficient has a term in 1/L_0, the effect of ends of constant size.
    `with_resting_length` returns the model of another muscle of the same type. Developed for airmuscle.
    """

    term: ClassVar[str] = "1/L0"

    def length_factor(self) -> Value:
        return self.reference_length / self.resting_length - 1.0


@model
class LogarithmicLength(LengthFamily):
    """Logarithmic length factor: F = max(0, F_inner(p, eps) + ln(L_0/L_ref) F_change(p, eps)).

    L_0: length between the fittings; L_ref: reference length. Force limits of the inner models are not applied. The
    logarithm lies between a term in 1/L_0, which is negligible for long muscles, and a term in L_0, which is unbounded.
    `with_resting_length` returns the model of another muscle of the same type. Developed for airmuscle from measured
    muscles of 83 to 382 mm, whose force increased about equally with the first and the second doubling of length.
    """

    term: ClassVar[str] = "ln L0"

    def length_factor(self) -> Value:
        return ops.log(self.resting_length / self.reference_length)


def _linear_fields(law: ForceLaw) -> tuple[str, ...]:
    """The fields in which a law is linear."""
    fields: str | tuple[str, ...] = getattr(law, "linear_in", ())
    return (fields,) if isinstance(fields, str) else fields

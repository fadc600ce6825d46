"""Wrapper for muscles of one type and different lengths: rigid ends of constant length."""

import dataclasses
from collections.abc import Callable
from typing import Any

from ....core import ParameterError, Value, model, parameter
from .base import Characteristic, ForceLaw
from .data_scales import DataScales, MeasuredPoints

_RANGE_FACTOR = 2.0
"""Factor by which the contraction range of the inner surface exceeds that of the whole muscle (chosen)."""


@model
class EffectiveLength(ForceLaw):
    """Force law of the active length: F = F_inner(p, (eps L_0 + d)/(L_0 - l_d)).

    eps: contraction of the whole muscle; L_0: length between the fittings; l_d: length of the ends, which do not
    contract; d: elongation of the ends under pressure, or zero error of the length measurement. Short muscles therefore
    contract less. `with_resting_length` returns the model of another muscle of the same type. Developed for airmuscle;
    the effect of the ends is from Tondu and Lopez (2000), whose end correction is L_0/(L_0 - l_d).
    """

    inner: ForceLaw
    resting_length: float = parameter(
        "m", "L_0", "length between the fittings, unpressurised and unloaded", bounds=(1e-3, 20.0), fitted=False
    )
    dead_length: float = parameter("m", "l_d", "length of the ends, which do not contract", bounds=(-1.0, 1.0))
    end_shift: float = parameter(
        "m", "d", "elongation of the ends, or zero error of the length", bounds=(-0.1, 0.1), default=0.0
    )

    @classmethod
    def variants(cls, data: MeasuredPoints, surface: Callable[[int], ForceLaw]) -> dict[str, Characteristic]:
        scales = DataScales.of(data).check_lengths()
        return {
            f"effective length, degree {n}": cls(surface(n), scales.resting_length, dead_length=0.005)
            for n in range(2, 6)
        }

    def check(self) -> None:
        if not self.dead_length < self.resting_length:
            raise ParameterError(
                f"EffectiveLength: dead_length {self.dead_length:g} m must be less than resting_length "
                f"{self.resting_length:g} m."
            )

    @property
    def contraction_range(self) -> tuple[float, float]:
        low, high = self.inner.contraction_range
        length, active = self.resting_length, self.resting_length - self.dead_length
        return ((low * active - self.end_shift) / length, (high * active - self.end_shift) / length)

    @property
    def linear_in(self) -> tuple[str, ...]:
        """The parameters in which the inner model is linear; the lengths are not among them."""
        fields = getattr(self.inner, "linear_in", ())
        return tuple(f"inner.{field}" for field in ((fields,) if isinstance(fields, str) else fields))

    def with_resting_length(self, resting_length: float) -> "EffectiveLength":
        """Return the model of a muscle of the same type with this resting length [m]."""
        return dataclasses.replace(self, resting_length=resting_length)

    def with_validity_range(self, pressure: tuple[float, float], contraction: tuple[float, float]) -> "EffectiveLength":
        """Return the model with another validity range; that of the inner surface is wider in contraction."""
        inner: Any = self.inner
        if not hasattr(inner, "with_validity_range"):
            return self
        return dataclasses.replace(self, inner=inner.with_validity_range(pressure, _widen(contraction)))

    def rescaled(self, pressure: tuple[float, float], contraction: tuple[float, float]) -> "EffectiveLength":
        """Return the same force law on another validity range; that of the inner surface is wider in contraction."""
        inner: Any = self.inner
        if not hasattr(inner, "rescaled"):
            return self
        return dataclasses.replace(self, inner=inner.rescaled(pressure, _widen(contraction)))

    def force(self, pressure: Value, contraction: Value) -> Value:
        return self.inner.force(pressure, self._active_contraction(contraction))

    def unclamped_force(self, pressure: Value, contraction: Value) -> Value:
        return self.inner.unclamped_force(pressure, self._active_contraction(contraction))

    def _active_contraction(self, contraction: Value) -> Value:
        """Contraction [1] of the active length."""
        shortening = contraction * self.resting_length + self.end_shift
        return shortening / (self.resting_length - self.dead_length)


def _widen(contraction: tuple[float, float]) -> tuple[float, float]:
    """The validity range of the inner surface for this range of the whole muscle."""
    low, high = contraction
    margin = (_RANGE_FACTOR - 1) * (high - low) / 2
    return low - margin, high + margin

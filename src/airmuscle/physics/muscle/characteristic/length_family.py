"""Wrappers for muscles of one type and different lengths: rigid ends, a correction by the length,
partial pooling.
"""

import abc
import dataclasses
from collections.abc import Callable
from typing import Any, ClassVar, Self

from ....core import ParameterError, Value, model, ops, parameter, suggestion
from ....core.declaration import forwarded
from ..geometry.base import LENGTHS, RESTING_LENGTH
from .base import Characteristic, ForceLaw
from .data_scales import DataScales, MeasuredPoints

_RANGE_FACTOR = 2.0
"""Factor by which the contraction range of the inner surface exceeds that of the whole muscle
(chosen).
"""


class LengthLaw(ForceLaw):
    """Law of a muscle of a stated length that is made of other laws, its `parts` (base class)."""

    parts: ClassVar[tuple[str, ...]] = ("inner",)
    """The fields of the other laws."""

    @property
    def linear_in(self) -> tuple[str, ...]:
        """The parameters in which all parts are linear, else none; lengths are not among them."""
        fields = {part: getattr(getattr(self, part), "linear_in", ()) for part in self.parts}
        if not all(fields.values()):
            return ()
        return tuple(f"{part}.{name}" for part, names in fields.items() for name in names)

    def with_resting_length(self, resting_length: float) -> Self:
        """Return the model of a muscle of the same type with this resting length [m]."""
        return self._with(resting_length=resting_length)

    def with_validity_range(
        self, pressure: tuple[float, float], contraction: tuple[float, float]
    ) -> Self:
        """Return the model with its surfaces on another validity range."""
        return self._on_range("with_validity_range", pressure, contraction)

    def rescaled(self, pressure: tuple[float, float], contraction: tuple[float, float]) -> Self:
        """Return the same force law with its surfaces on another validity range."""
        return self._on_range("rescaled", pressure, contraction)

    def _on_range(
        self, method: str, pressure: tuple[float, float], contraction: tuple[float, float]
    ) -> Self:
        laws = {name: getattr(self, name) for name in self.parts}
        limits = pressure, self._range_of_parts(contraction)
        return self._with(
            **{
                name: getattr(law, method)(*limits)
                for name, law in laws.items()
                if hasattr(law, method)
            }
        )

    def _range_of_parts(self, contraction: tuple[float, float]) -> tuple[float, float]:
        """The range of the contraction of the parts for this one of the whole muscle."""
        return contraction

    def _with(self, **changed: Any) -> Self:
        law: Any = self
        return dataclasses.replace(law, **changed)  # type: ignore[no-any-return]


@model
class EffectiveLength(LengthLaw):
    """Force law of the active length: F = F_inner(p, (eps L_0 + d)/(L_0 - l_d)).

    eps: contraction of the whole muscle; l_d: length of the ends, which do not contract, so that
    short muscles contract less; d: their elongation under pressure, or zero error of the length
    measurement. Developed for airmuscle; the effect of the ends is from Tondu and Lopez (2000),
    whose end correction is L_0/(L_0 - l_d).
    """

    inner: ForceLaw
    resting_length: float = parameter(*RESTING_LENGTH, bounds=LENGTHS, fitted=False)
    dead_length: float = parameter(
        "m", "l_d", "length of the ends, which do not contract", bounds=(-1.0, 1.0)
    )
    end_shift: float = parameter(
        "m",
        "d",
        "elongation of the ends, or zero error of the length",
        bounds=(-0.1, 0.1),
        default=0.0,
    )

    @classmethod
    def variants(
        cls, data: MeasuredPoints, surface: Callable[[int], ForceLaw]
    ) -> dict[str, Characteristic]:
        length = DataScales.of(data).check_lengths().resting_length
        return {
            f"surface of degree {n} at an effective length": cls(
                surface(n), length, dead_length=0.005
            )
            for n in range(2, 6)
        }

    def check(self) -> None:
        if not self.dead_length < self.resting_length:
            raise ParameterError(
                f"EffectiveLength: dead_length {self.dead_length:g} m must be less than"
                f" resting_length {self.resting_length:g} m."
            )

    @property
    def contraction_range(self) -> tuple[float, float]:
        low, high = self.inner.contraction_range
        length = self.resting_length
        active = self.resting_length - self.dead_length
        return ((low * active - self.end_shift) / length, (high * active - self.end_shift) / length)

    def _range_of_parts(self, contraction: tuple[float, float]) -> tuple[float, float]:
        low, high = contraction
        margin = (_RANGE_FACTOR - 1) * (high - low) / 2
        return low - margin, high + margin

    def force(self, pressure: Value, contraction: Value) -> Value:
        return self.inner.force(pressure, self._active_contraction(contraction))

    def unclamped_force(self, pressure: Value, contraction: Value) -> Value:
        return self.inner.unclamped_force(pressure, self._active_contraction(contraction))

    def _active_contraction(self, contraction: Value) -> Value:
        """Contraction [1] of the active length."""
        shortening = contraction * self.resting_length + self.end_shift
        return shortening / (self.resting_length - self.dead_length)


@model
class LengthFamily(LengthLaw):
    """Base class: F = max(0, F_inner(p, eps) + s(L_0) F_change(p, eps)), with s = 0 at the
    reference length.

    L_0: length between the fittings; s: length factor, defined by the subclass. Force limits of the
    inner models are not applied.
    """

    parts: ClassVar[tuple[str, ...]] = ("inner", "change")
    term: ClassVar[str]
    """The length factor as a text, in the names of `variants`."""

    inner: ForceLaw
    change: ForceLaw
    resting_length: float = parameter(*RESTING_LENGTH, bounds=LENGTHS, fitted=False)
    reference_length: float = parameter(
        "m",
        "L_ref",
        "reference length, at which the correction is zero",
        bounds=(1e-3, 20.0),
        fitted=False,
    )

    @classmethod
    def variants(
        cls, data: MeasuredPoints, surface: Callable[[int], ForceLaw]
    ) -> dict[str, Characteristic]:
        length = DataScales.of(data).check_lengths().resting_length
        return {
            f"surface of degree {n} + length correction {cls.term} of degree {k}": cls(
                surface(n), surface(k), length, length
            )
            for n in range(2, 6)
            for k in range(1, min(n, 3) + 1)
        }

    contraction_range = forwarded("inner.contraction_range")

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

    Force limits of the inner models are not applied. If both models are surfaces, every coefficient
    has a term in 1/L_0, the effect of ends of constant size. Developed for airmuscle.
    """

    term: ClassVar[str] = "1/L0"

    def length_factor(self) -> Value:
        return self.reference_length / self.resting_length - 1.0


@model
class LogarithmicLength(LengthFamily):
    """Logarithmic length factor: F = max(0, F_inner(p, eps) + ln(L_0/L_ref) F_change(p, eps)).

    Force limits of the inner models are not applied. The logarithm lies between a term in 1/L_0,
    which is negligible for long muscles, and a term in L_0, which is unbounded. Developed for
    airmuscle from measured muscles of 83 to 382 mm, whose force increased about equally with the
    first and the second doubling of length.
    """

    term: ClassVar[str] = "ln L0"

    def length_factor(self) -> Value:
        return ops.log(self.resting_length / self.reference_length)


@model
class PooledLengthLaw(ForceLaw):
    """Mixed-effects law of muscles of one type: F = max(0, F_pop(p, eps; L_0) + s F_s(p, eps)).

        s = 1 where F_pop >= 0, otherwise max(0, 1 + c F_pop)

    F_pop: law of the population, for any resting length L_0; F_s: effect of specimen s (a random
    effect), drawn from a normal distribution of mean 0; c: decay of the effects below zero force,
    so that a specimen is slack where the population is far from pulling; 0 keeps the effects
    everywhere. A new muscle has the mean of this prior, F_s = 0; `with_resting_length` returns its
    law. `for_specimen` returns the law of a measured muscle. Without names of specimens the one
    effect gives the structure for a fit. Force limits of the inner models are not applied.
    Developed for airmuscle; the prediction of random effects is from Robinson, Statistical Science
    6:15 (1991).
    """

    population: ForceLaw
    effects: tuple[ForceLaw, ...]
    specimens: tuple[str, ...] = ()
    specimen_lengths: tuple[float, ...] = parameter(
        "m",
        "L_s",
        "resting lengths of the specimens",
        bounds=(1e-3, 20.0),
        fitted=False,
        default=(),
    )
    specimen: str = ""
    effect_decay: float = parameter(
        "1/N",
        "c",
        "relative decay of the specimen effects below zero force of the population",
        bounds=(0.0, 1e3),
        fitted=False,
        default=0.0,
    )

    def check(self) -> None:
        named = len(self.specimens)
        if not len(self.effects) == max(named, 1) or not len(self.specimen_lengths) == named:
            raise ParameterError(
                f"PooledLengthLaw has {named} specimens, {len(self.effects)} effects and"
                f" {len(self.specimen_lengths)} specimen_lengths; these numbers must be equal"
                " (without specimens: one effect)."
            )
        if len(set(self.specimens)) < named or "" in self.specimens:
            raise ParameterError(
                "PooledLengthLaw.specimens must be different names, none of them empty."
            )
        if not self.specimen:
            return
        stated = self.specimen_lengths[self._index(self.specimen)]
        own = self.resting_length
        if own is not None and abs(stated - own) > 1e-6:
            raise ParameterError(
                f"PooledLengthLaw: the resting length of {self.specimen} is {stated:g} m, but that"
                f" of its population is {own:g} m. Write {stated:g} m there, or use"
                f" for_specimen('{self.specimen}')."
            )

    @property
    def resting_length(self) -> float | None:
        """Resting length [m] of this muscle; None if the law of the population does not depend on
        it.
        """
        length: float | None = getattr(self.population, "resting_length", None)
        return length

    contraction_range = forwarded("population.contraction_range")

    def with_resting_length(self, resting_length: float) -> "PooledLengthLaw":
        """Return the law of a new muscle of the same type with this resting length [m]: its effect
        is zero.
        """
        return dataclasses.replace(
            self, population=_of_length(self.population, resting_length), specimen=""
        )

    def for_specimen(self, specimen: str) -> "PooledLengthLaw":
        """Return the law of a measured muscle, with its resting length and effect. Raises
        ParameterError.
        """
        length = self.specimen_lengths[self._index(specimen)]
        return dataclasses.replace(
            self, population=_of_length(self.population, length), specimen=specimen
        )

    def force(self, pressure: Value, contraction: Value) -> Value:
        return ops.maximum(self.unclamped_force(pressure, contraction), 0.0)

    def unclamped_force(self, pressure: Value, contraction: Value) -> Value:
        force = self.population.unclamped_force(pressure, contraction)
        if not self.specimen:
            return force
        effect = self.effects[self.specimens.index(self.specimen)].unclamped_force(
            pressure, contraction
        )
        return force + self.effect_share(force) * effect

    def effect_share(self, force: Value) -> Value:
        """The share s of the effects [1] at this unclamped force of the population [N]."""
        return ops.clip(1.0 + self.effect_decay * force, 0.0, 1.0)

    def _index(self, specimen: str) -> int:
        if specimen not in self.specimens:
            known = ", ".join(self.specimens) or "none"
            raise ParameterError(
                f"PooledLengthLaw: '{specimen}' is not among the specimens ({known}). Give one of"
                " these, or with_resting_length(...) for a new"
                f" muscle.{suggestion(specimen, self.specimens)}"
            )
        return self.specimens.index(specimen)


def _of_length(law: ForceLaw, resting_length: float) -> ForceLaw:
    scaled: ForceLaw = (
        law.with_resting_length(resting_length) if hasattr(law, "with_resting_length") else law
    )
    return scaled

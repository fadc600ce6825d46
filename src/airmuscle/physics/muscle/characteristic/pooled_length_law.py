"""Partial pooling of muscles of one type: a law of the population plus the effect of each measured muscle."""

import dataclasses

from ....core import ParameterError, Value, model, ops, parameter, suggestion
from .base import ForceLaw


@model
class PooledLengthLaw(ForceLaw):
    """Mixed-effects law of muscles of one type: F = max(0, F_pop(p, eps; L_0) + s F_s(p, eps)).

        s = 1 where F_pop >= 0, otherwise max(0, 1 + c F_pop)

    F_pop: law of the population, for any resting length L_0; F_s: effect of specimen s (a random effect), drawn from a
    normal distribution of mean 0; c: decay of the effects below zero force, so that a specimen is slack where the
    population is far from pulling; 0 keeps the effects everywhere. A new muscle has the mean of this prior, F_s = 0;
    `with_resting_length` returns its law. `for_specimen` returns the law of a measured muscle. Without names of
    specimens the one effect gives the structure for a fit. Force limits of the inner models are not applied. Developed
    for airmuscle; the prediction of random effects is from Robinson, Statistical Science 6:15 (1991).
    """

    population: ForceLaw
    effects: tuple[ForceLaw, ...]
    specimens: tuple[str, ...] = ()
    specimen_lengths: tuple[float, ...] = parameter(
        "m", "L_s", "resting lengths of the specimens", bounds=(1e-3, 20.0), fitted=False, default=()
    )
    specimen: str = ""
    effect_decay: float = parameter(
        "1/N", "c", "relative decay of the specimen effects below zero force of the population",
        bounds=(0.0, 1e3), fitted=False, default=0.0,
    )  # fmt: skip

    def check(self) -> None:
        named = len(self.specimens)
        if not len(self.effects) == max(named, 1) or not len(self.specimen_lengths) == named:
            raise ParameterError(
                f"PooledLengthLaw has {named} specimens, {len(self.effects)} effects and {len(self.specimen_lengths)} "
                "specimen_lengths; these numbers must be equal (without specimens: one effect)."
            )
        if len(set(self.specimens)) < named or "" in self.specimens:
            raise ParameterError("PooledLengthLaw.specimens must be different names, none of them empty.")
        if not self.specimen:
            return
        stated, own = self.specimen_lengths[self._index(self.specimen)], self.resting_length
        if own is not None and abs(stated - own) > 1e-6:
            raise ParameterError(
                f"PooledLengthLaw: the resting length of {self.specimen} is {stated:g} m, but that of its population "
                f"is {own:g} m. Write {stated:g} m there, or use for_specimen('{self.specimen}')."
            )

    @property
    def resting_length(self) -> float | None:
        """Resting length [m] of this muscle; None if the law of the population does not depend on it."""
        length: float | None = getattr(self.population, "resting_length", None)
        return length

    @property
    def contraction_range(self) -> tuple[float, float]:
        return self.population.contraction_range

    def with_resting_length(self, resting_length: float) -> "PooledLengthLaw":
        """Return the law of a new muscle of the same type with this resting length [m]: its effect is zero."""
        return dataclasses.replace(self, population=_of_length(self.population, resting_length), specimen="")

    def for_specimen(self, specimen: str) -> "PooledLengthLaw":
        """Return the law of a measured muscle, with its resting length and effect. Raises ParameterError."""
        length = self.specimen_lengths[self._index(specimen)]
        return dataclasses.replace(self, population=_of_length(self.population, length), specimen=specimen)

    def force(self, pressure: Value, contraction: Value) -> Value:
        return ops.maximum(self.unclamped_force(pressure, contraction), 0.0)

    def unclamped_force(self, pressure: Value, contraction: Value) -> Value:
        force = self.population.unclamped_force(pressure, contraction)
        if not self.specimen:
            return force
        effect = self.effects[self.specimens.index(self.specimen)].unclamped_force(pressure, contraction)
        return force + self.effect_share(force) * effect

    def effect_share(self, force: Value) -> Value:
        """The share s of the effects [1] at this unclamped force of the population [N]."""
        return ops.clip(1.0 + self.effect_decay * force, 0.0, 1.0)

    def _index(self, specimen: str) -> int:
        if specimen not in self.specimens:
            known = ", ".join(self.specimens) or "none"
            raise ParameterError(
                f"PooledLengthLaw: '{specimen}' is not among the specimens ({known}). Give one of these, or "
                f"with_resting_length(...) for a new muscle.{suggestion(specimen, self.specimens)}"
            )
        return self.specimens.index(specimen)


def _of_length(law: ForceLaw, resting_length: float) -> ForceLaw:
    scaled: ForceLaw = law.with_resting_length(resting_length) if hasattr(law, "with_resting_length") else law
    return scaled

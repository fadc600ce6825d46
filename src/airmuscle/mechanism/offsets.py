"""Muscles that are not at their resting lengths where the coordinates are zero."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..core.declaration import model, parameter
from ..core.errors import ParameterError
from ..core.ops import Value
from .base import Mechanism
from .wrapper import MechanismWrapper


@model
class WithOffsets(MechanismWrapper):
    """eps_i = eps_0i + eps_i,inner: each muscle mounted with a contraction of its own; negative is pre-stretched."""

    inner: Mechanism
    offsets: tuple[float, ...] = parameter(
        "1", "eps_0i", "contraction of each muscle where the inner mechanism has it at none", bounds=(-0.5, 0.9)
    )

    def check(self) -> None:
        if self.inner.muscles not in (None, len(self.offsets)):
            raise ParameterError(
                f"WithOffsets: {type(self.inner).__name__} takes {self.inner.muscles} muscles; {len(self.offsets)} offsets "
                "are given."
            )

    @property
    def muscles(self) -> int | None:
        return len(self.offsets)

    def contractions(self, q: Mapping[str, Value], resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        inner = self.inner.contractions(q, resting_lengths)
        return tuple(offset + contraction for offset, contraction in zip(self.offsets, inner, strict=True))

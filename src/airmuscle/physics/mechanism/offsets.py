"""Contraction offsets: muscles that are contracted or pre-stretched at the zero position of a mechanism."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...core.declaration import model, parameter
from ...core.errors import ParameterError
from ...core.ops import Value
from .base import Mechanism
from .wrapper import MechanismWrapper


@model
class WithOffsets(MechanismWrapper):
    """Contraction offsets: eps_i = eps_0i + eps_i,inner; a negative offset is a pre-stretch."""

    inner: Mechanism
    offsets: tuple[float, ...] = parameter("1", "eps_0i", "contraction offset of each muscle", bounds=(-0.5, 0.9))

    def check(self) -> None:
        if self.inner.muscle_count not in (None, len(self.offsets)):
            raise ParameterError(
                f"WithOffsets: {type(self.inner).__name__} takes {self.inner.muscle_count} muscles; "
                f"{len(self.offsets)} offsets are given. Give one for each muscle."
            )

    @property
    def muscle_count(self) -> int | None:
        return len(self.offsets)

    def contractions(self, q: Mapping[str, Value], resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        inner = self.inner.contractions(q, resting_lengths)
        return tuple(offset + contraction for offset, contraction in zip(self.offsets, inner, strict=True))

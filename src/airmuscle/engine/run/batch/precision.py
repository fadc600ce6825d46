"""Precision of a batch: single or double."""

from __future__ import annotations

import abc
import dataclasses

from ...compile.llvm.types import LlvmType

BITS = 1024
"""Size of a vector of lanes: two of the widest registers, which alternate."""


class Precision(abc.ABC):
    """The floating-point format of a batch in lanes."""

    @property
    @abc.abstractmethod
    def number(self) -> LlvmType:
        """The LLVM type of a vector of lanes."""

    @property
    @abc.abstractmethod
    def note(self) -> str:
        """A remark for the reader of the results; empty where there is none."""


@dataclasses.dataclass(frozen=True)
class Double(Precision):
    """Double precision, sixteen digits; the default."""

    @property
    def number(self) -> LlvmType:
        return LlvmType(64, BITS // 64)

    @property
    def note(self) -> str:
        return ""


@dataclasses.dataclass(frozen=True)
class Single(Precision):
    """Single precision, seven digits: half the memory and about twice as fast, for integrators of fixed step."""

    @property
    def number(self) -> LlvmType:
        return LlvmType(32, BITS // 32)

    @property
    def note(self) -> str:
        return "single precision: rounding errors accumulate over a run; expect about four correct digits"

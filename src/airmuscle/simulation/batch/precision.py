"""How many digits a batch computes with."""

from __future__ import annotations

import abc
import dataclasses

from ...compile.llvm.types import LlvmType

BITS = 1024
"""Size of a row of plants side by side: two of the widest registers, which take turns."""


class Precision(abc.ABC):
    """The numbers that lanes are made of."""

    @property
    @abc.abstractmethod
    def number(self) -> LlvmType:
        """The printed number, in lanes."""

    @property
    @abc.abstractmethod
    def note(self) -> str:
        """What a reader of the results should know; empty where nothing."""


@dataclasses.dataclass(frozen=True)
class Double(Precision):
    """Sixteen digits, as everywhere; the default."""

    @property
    def number(self) -> LlvmType:
        return LlvmType(64, BITS // 64)

    @property
    def note(self) -> str:
        return ""


@dataclasses.dataclass(frozen=True)
class Single(Precision):
    """Seven digits a number: half the memory and about twice as fast, for methods of fixed step."""

    @property
    def number(self) -> LlvmType:
        return LlvmType(32, BITS // 32)

    @property
    def note(self) -> str:
        return "single precision: rounding adds up over a run; expect about four digits"

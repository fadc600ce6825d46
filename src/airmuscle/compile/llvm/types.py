"""LLVM types of printed values: one number, or a vector of lanes with one number for each of many plants."""

from __future__ import annotations

import dataclasses
import struct


@dataclasses.dataclass(frozen=True)
class LlvmType:
    """`lanes` numbers of `bits` each, which LLVM computes together: double, <32 x double>, <32 x float>."""

    bits: int = 64
    lanes: int = 1

    @property
    def element(self) -> str:
        """LLVM's name of one of the numbers."""
        return "double" if self.bits == 64 else "float"

    @property
    def text(self) -> str:
        """LLVM's name of the whole value."""
        return self._of(self.element)

    @property
    def mask(self) -> str:
        """LLVM's name of the result of a comparison."""
        return self._of("i1")

    @property
    def whole(self) -> str:
        """LLVM's name of the same bits taken as whole numbers."""
        return self._of(f"i{self.bits}")

    @property
    def size(self) -> int:
        """Bytes of a value."""
        return self.lanes * self.bits // 8

    @property
    def alignment(self) -> int:
        """Bytes at whose multiples a value stands: its own size, a cache line at most."""
        return min(self.size, 64)

    def intrinsic(self, name: str) -> str:
        """LLVM's own function of this name on such values: llvm.sqrt.f64, llvm.sqrt.v32f64."""
        return f"llvm.{name}.{f'v{self.lanes}' if self.lanes > 1 else ''}f{self.bits}"

    def function(self, name: str) -> str:
        """What stands for a function of the C library on such values; `elementary` prints it."""
        return f"{name}.v{self.lanes}f{self.bits}"

    def literal(self, value: float) -> str:
        """One of the numbers as LLVM text; a shorter one is rounded first, as LLVM wants it exact."""
        if self.bits == 32:
            value = struct.unpack("<f", struct.pack("<f", value))[0]
        return f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"

    def _of(self, element: str) -> str:
        return element if self.lanes == 1 else f"<{self.lanes} x {element}>"


DOUBLE = LlvmType()

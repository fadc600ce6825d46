"""LLVM types of printed values: one number, or a vector of lanes with one number for each of many plants."""

from __future__ import annotations

import dataclasses
import functools
import struct


@dataclasses.dataclass(frozen=True)
class LlvmType:
    """`lanes` numbers of `bits` each, which LLVM computes together: double, <32 x double>, <32 x float>."""

    bits: int = 64
    lanes: int = 1

    @property
    def element(self) -> str:
        """LLVM name of the element type."""
        return "double" if self.bits == 64 else "float"

    @functools.cached_property
    def text(self) -> str:
        """LLVM name of the type."""
        return self._of(self.element)

    @property
    def mask(self) -> str:
        """LLVM name of the type of a comparison."""
        return self._of("i1")

    @property
    def whole(self) -> str:
        """LLVM name of the integer type of the same size."""
        return self._of(f"i{self.bits}")

    @property
    def size(self) -> int:
        """Bytes of a value."""
        return self.lanes * self.bits // 8

    @property
    def alignment(self) -> int:
        """Alignment of a value in bytes: its size, at most a cache line."""
        return min(self.size, 64)

    def intrinsic(self, name: str) -> str:
        """Name of an LLVM intrinsic for this type: llvm.sqrt.f64, llvm.sqrt.v32f64."""
        return f"llvm.{name}.{f'v{self.lanes}' if self.lanes > 1 else ''}f{self.bits}"

    def function(self, name: str) -> str:
        """Name of the vectorised replacement of a C library function, which `vector_math` defines."""
        return f"{name}.v{self.lanes}f{self.bits}"

    def literal(self, value: float) -> str:
        """A number as LLVM text; in single precision it is rounded first, because LLVM requires an exact value."""
        if self.bits == 32:
            value = struct.unpack("<f", struct.pack("<f", value))[0]
        return f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"

    def _of(self, element: str) -> str:
        return element if self.lanes == 1 else f"<{self.lanes} x {element}>"


DOUBLE = LlvmType()

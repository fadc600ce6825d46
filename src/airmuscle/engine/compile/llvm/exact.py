"""Exact arithmetic of values in lanes: sums and products with their rounding errors, and operations on bits."""

from __future__ import annotations

from collections.abc import Sequence

from .emit import FunctionBody
from .types import LlvmType


class ExactBody(FunctionBody):
    """Arithmetic in lanes without fast-math flags: no reordering, no assumptions on NaN or zero."""

    def __init__(self, lanes: int, bits: int = 64) -> None:
        super().__init__((), LlvmType(bits, lanes))
        self.mantissa, self.least = (52, 2.0**-1074) if bits == 64 else (23, 2.0**-149)
        self.rounder = 1.5 * 2.0**self.mantissa
        """Added to an integer of moderate size, this leaves the integer in the last bits of the sum."""

    def add(self, a: str, b: str) -> str:
        return self.put(f"fadd {self.number.text} {a}, {b}")

    def subtract(self, a: str, b: str) -> str:
        return self.put(f"fsub {self.number.text} {a}, {b}")

    def times(self, a: str, b: str) -> str:
        return self.put(f"fmul {self.number.text} {a}, {b}")

    def over(self, a: str, b: str) -> str:
        return self.put(f"fdiv {self.number.text} {a}, {b}")

    def fused(self, a: str, b: str, c: str) -> str:
        """a b + c, rounded once."""
        return self.intrinsic("fma", (a, b, c), "")

    def negative(self, a: str) -> str:
        return self.put(f"fneg {self.number.text} {a}")

    def rounded(self, a: str) -> str:
        return self.intrinsic("rint", (a,), "")

    def size_of(self, a: str) -> str:
        return self.intrinsic("fabs", (a,), "")

    def polynomial(self, x: str, coefficients: Sequence[float]) -> str:
        """c0 + x (c1 + x (c2 + ...))."""
        total = self.constant(coefficients[-1])
        for c in reversed(coefficients[:-1]):
            total = self.fused(total, x, self.constant(c))
        return total

    def bits(self, a: str) -> str:
        return self.put(f"bitcast {self.number.text} {a} to {self.number.whole}")

    def from_bits(self, a: str) -> str:
        return self.put(f"bitcast {self.number.whole} {a} to {self.number.text}")

    def on_bits(self, operation: str, a: str, b: float | str) -> str:
        """An integer operation with a constant, given as the double of the same bits, or with a value."""
        other = self.bits(self.constant(b)) if isinstance(b, float) else b
        return self.put(f"{operation} {self.number.whole} {a}, {other}")

    def shifted(self, operation: str, a: str) -> str:
        """Shift by the bits of the mantissa."""
        return self.on_bits(operation, a, self.mantissa * self.least)

    def power_of_two(self, n: str) -> str:
        """2**n for an integer n for which this is an ordinary number, in double precision -1022 to 1023."""
        low = self.shifted("shl", self.bits(self.add(n, self.constant(self.rounder))))
        return self.from_bits(self.on_bits("add", low, 1.0))

    def sum_of(self, large: str, small: str) -> tuple[str, str]:
        """large + small and its rounding error."""
        total = self.add(large, small)
        return total, self.subtract(small, self.subtract(total, large))

    def sum_of_any(self, a: str, b: str) -> tuple[str, str]:
        """a + b and its rounding error, whichever is the larger."""
        total = self.add(a, b)
        of_b = self.subtract(total, a)
        return total, self.add(self.subtract(a, self.subtract(total, of_b)), self.subtract(b, of_b))

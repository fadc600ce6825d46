"""Arithmetic of scalars and LLVM vectors, exact sums and products, and powers with an exponent
common to all lanes.
"""

import dataclasses
import functools
import math
from collections.abc import Mapping, Sequence

from .emit import FLAGS, STEADY_POWER, FunctionBody, LlvmType, function_of_values


class ExactBody(FunctionBody):
    """Arithmetic in lanes without fast-math flags: no reordering, no assumptions on NaN or zero."""

    def __init__(self, lanes: int, bits: int = 64) -> None:
        super().__init__((), LlvmType(bits, lanes))
        self.mantissa, self.least = (52, 2.0**-1074) if bits == 64 else (23, 2.0**-149)
        self.rounder = 1.5 * 2.0**self.mantissa
        """Added to an integer of moderate size, this leaves the integer in the last bits of the
        sum.
        """

    # as with conditions, without flags
    add, subtract, times, over = (
        functools.partialmethod(FunctionBody.logical, operator) for operator in "+-*/"
    )

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
        """An integer operation with a constant, given as the double of the same bits, or with a
        value.
        """
        operand = self.bits(self.constant(b)) if isinstance(b, float) else b
        return self.put(f"{operation} {self.number.whole} {a}, {operand}")

    def shifted(self, operation: str, a: str) -> str:
        """Shift by the bits of the mantissa."""
        return self.on_bits(operation, a, self.mantissa * self.least)

    def power_of_two(self, n: str) -> str:
        """2**n for an integer n for which this is an ordinary number, in double precision -1022 to
        1023.
        """
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


@dataclasses.dataclass(frozen=True)
class _Accuracy:
    """Terms of both series, the largest |y log2 x|, and the largest |log2 x|."""

    logarithm: int
    exponential: int
    largest: float
    largest_exponent: int


_DOUBLE = _Accuracy(8, 12, 1000.0, 1000)
_SINGLE = _Accuracy(4, 7, 16.0, 120)


def steady_power(number: LlvmType) -> str:
    """The LLVM text of the function; it calls `pow` of the same lanes, which must be in the
    module.
    """
    block = ExactBody(number.lanes, number.bits)
    accuracy = _DOUBLE if number.bits == 64 else _SINGLE
    product = block.times("%y", _logarithm(block, "%x", accuracy))
    value = _exponential(block, product, accuracy)
    tests = (
        block.put(f"fcmp oge {number.text} %x, {block.constant(2.0**-accuracy.largest_exponent)}"),
        block.put(f"fcmp ole {number.text} %x, {block.constant(2.0**accuracy.largest_exponent)}"),
        block.put(
            f"fcmp ole {number.text} {block.size_of(product)}, {block.constant(accuracy.largest)}"
        ),
    )
    usual = functools.reduce(lambda a, b: block.put(f"and {number.mask} {a}, {b}"), tests)
    value = _otherwise(block, usual, value)
    inline = (
        " alwaysinline" if number.bits == 64 else ""
    )  # measured: a gain in double precision only
    return function_of_values(
        number.function(STEADY_POWER), ["%x", "%y"], block, number, value, inline
    )


def _logarithm(block: ExactBody, x: str, accuracy: _Accuracy) -> str:
    """log2 x of an ordinary positive number."""
    bits = block.bits(x)
    exponent = block.shifted("ashr", block.on_bits("sub", bits, math.sqrt(0.5)))
    m = block.from_bits(block.on_bits("sub", bits, block.shifted("shl", exponent)))
    n = block.subtract(
        block.from_bits(block.on_bits("add", exponent, block.rounder)),
        block.constant(block.rounder),
    )
    unity = block.constant(1.0)
    s = block.over(block.subtract(m, unity), block.add(m, unity))
    scale = 2 / math.log(2)
    series = _polynomial(
        block, block.times(s, s), [scale / (2 * i + 1) for i in range(accuracy.logarithm + 1)]
    )
    return block.fused(s, series, n)


def _exponential(block: ExactBody, x: str, accuracy: _Accuracy) -> str:
    """2**x for an x of moderate size."""
    n = block.rounded(x)
    terms = [math.log(2) ** i / math.factorial(i) for i in range(accuracy.exponential + 1)]
    return block.times(_polynomial(block, block.subtract(x, n), terms), block.power_of_two(n))


def _polynomial(block: ExactBody, x: str, coefficients: Sequence[float]) -> str:
    """c0 + c1 x + c2 x**2 + ... as the sum of its even and its odd part, which do not wait for each
    other.
    """
    square = block.times(x, x)
    even, odd = (block.polynomial(square, coefficients[i::2]) for i in (0, 1))
    return block.fused(odd, x, even)


def _otherwise(block: ExactBody, usual: str, value: str) -> str:
    """The value in the usual lanes, that of `pow` in the others, which is computed if there are
    any.
    """
    number = block.number
    flipped = f"<i1 true{', i1 true' * (number.lanes - 1)}>"
    unusual = block.put(f"xor {number.mask} {usual}, {flipped}")
    any_unusual = block.put(
        f"call i1 @llvm.vector.reduce.or.v{number.lanes}i1({number.mask} {unusual})"
    )
    block.lines += [f"  br i1 {any_unusual}, label %unusual, label %end", "unusual:"]
    block.lines += [
        (
            f"  %exact = call {number.text} @{number.function('pow')}({number.text} %x,"
            f" {number.text} %y)"
        ),
        f"  %mixed = select {number.mask} {usual}, {number.text} {value}, {number.text} %exact",
        "  br label %end",
        "end:",
        f"  %result = phi {number.text} [ {value}, %0 ], [ %mixed, %unusual ]",
    ]
    return "%result"


@dataclasses.dataclass(frozen=True)
class LlvmValue:
    """The name of a value in a block: one `double`, or with `lanes` a vector `<lanes x double>`.

    A scalar operand of a vector is broadcast to its lanes, whose number need not be a power of two.
    """

    block: FunctionBody
    name: str
    lanes: int = 0

    @property
    def kind(self) -> str:
        """LLVM name of the type."""
        return f"<{self.lanes} x double>" if self.lanes else "double"

    def spread(self, lanes: int) -> "LlvmValue":
        """The scalar in every lane; a vector is returned unchanged."""
        if self.lanes or not lanes:
            return self
        kind = f"<{lanes} x double>"
        first = self.block.put(f"insertelement {kind} poison, double {self.name}, i32 0")
        places = f"<{lanes} x i32> zeroinitializer"
        return LlvmValue(
            self.block,
            self.block.put(f"shufflevector {kind} {first}, {kind} poison, {places}"),
            lanes,
        )

    def _with(self, operation: str, operand: "LlvmValue") -> "LlvmValue":
        a, b = self.spread(operand.lanes), operand.spread(self.lanes)
        result = self.block.put(f"{operation} {FLAGS} {a.kind} {a.name}, {b.name}")
        return dataclasses.replace(a, name=result)

    def __add__(self, operand: "LlvmValue") -> "LlvmValue":
        return self._with("fadd", operand)

    def __sub__(self, operand: "LlvmValue") -> "LlvmValue":
        return self._with("fsub", operand)

    def __mul__(self, operand: "LlvmValue") -> "LlvmValue":
        return self._with("fmul", operand)

    def store(self, array: str, index: int) -> None:
        """Write the value to array elements from `index` on."""
        place = self.block.put(f"getelementptr inbounds double, ptr %{array}, i64 {index}")
        self.block.lines.append(f"  store {self.kind} {self.name}, ptr {place}, align 8")


def loaded(block: FunctionBody, array: str, index: int, lanes: int = 0) -> LlvmValue:
    """The value of array elements from `index` on."""
    if not lanes:
        return LlvmValue(block, block.load(array, index))
    place = block.put(f"getelementptr inbounds double, ptr %{array}, i64 {index}")
    return LlvmValue(block, block.put(f"load <{lanes} x double>, ptr {place}, align 8"), lanes)


def packed(block: FunctionBody, values: Mapping[int, str], lanes: int) -> LlvmValue:
    """A vector with these scalars in their lanes and zero in all others."""
    name = "zeroinitializer"
    for lane, value in values.items():
        name = block.put(f"insertelement <{lanes} x double> {name}, double {value}, i32 {lane}")
    return LlvmValue(block, name, lanes)

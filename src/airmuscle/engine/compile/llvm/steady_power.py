"""Power with an exponent that is the same for a whole run, in lanes: the polytropic process.

    x**y = 2**(y log2 x),   x = 2**n m,   log2 m = (2/ln 2) artanh((m - 1)/(m + 1)),   2**r by its Taylor series

Without the second part of the logarithm, with which `pow` rounds correctly. The relative error against `pow` is at most
1e-12 (in single precision 2e-6): the logarithm errs by a unit of the last place, and |y log2 x| is limited. Where it is
greater, and at zero, negative and non-finite bases, a lane takes the value of `pow`; whether it does depends on
this lane alone.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

from .emit import STEADY_POWER, function_of_values
from .exact import ExactBody
from .types import LlvmType


@dataclasses.dataclass(frozen=True)
class _Accuracy:
    """Terms of both series, the largest |y log2 x|, and the largest |log2 x|."""

    logarithm: int
    exponential: int
    largest: float
    largest_exponent: int


_DOUBLE, _SINGLE = _Accuracy(8, 12, 1000.0, 1000), _Accuracy(4, 7, 16.0, 120)


def steady_power(number: LlvmType) -> str:
    """The LLVM text of the function; it calls `pow` of the same lanes, which must be in the module."""
    block, accuracy = ExactBody(number.lanes, number.bits), _DOUBLE if number.bits == 64 else _SINGLE
    product = block.times("%y", _logarithm(block, "%x", accuracy))
    value = _exponential(block, product, accuracy)
    usual = _all_of(
        block,
        block.put(f"fcmp oge {number.text} %x, {block.constant(2.0**-accuracy.largest_exponent)}"),
        block.put(f"fcmp ole {number.text} %x, {block.constant(2.0**accuracy.largest_exponent)}"),
        block.put(f"fcmp ole {number.text} {block.size_of(product)}, {block.constant(accuracy.largest)}"),
    )
    value = _otherwise(block, usual, value)
    inline = " alwaysinline" if number.bits == 64 else ""  # measured: a gain in double precision only
    return function_of_values(number.function(STEADY_POWER), ["%x", "%y"], block, number, value, inline)


def _logarithm(block: ExactBody, x: str, accuracy: _Accuracy) -> str:
    """log2 x of an ordinary positive number."""
    bits = block.bits(x)
    exponent = block.shifted("ashr", block.on_bits("sub", bits, math.sqrt(0.5)))
    m = block.from_bits(block.on_bits("sub", bits, block.shifted("shl", exponent)))
    n = block.subtract(block.from_bits(block.on_bits("add", exponent, block.rounder)), block.constant(block.rounder))
    one = block.constant(1.0)
    s = block.over(block.subtract(m, one), block.add(m, one))
    scale = 2 / math.log(2)
    series = _polynomial(block, block.times(s, s), [scale / (2 * i + 1) for i in range(accuracy.logarithm + 1)])
    return block.fused(s, series, n)


def _exponential(block: ExactBody, x: str, accuracy: _Accuracy) -> str:
    """2**x for an x of moderate size."""
    n = block.rounded(x)
    terms = [math.log(2) ** i / math.factorial(i) for i in range(accuracy.exponential + 1)]
    return block.times(_polynomial(block, block.subtract(x, n), terms), block.power_of_two(n))


def _polynomial(block: ExactBody, x: str, coefficients: Sequence[float]) -> str:
    """c0 + c1 x + c2 x**2 + ... as the sum of its even and its odd part, which do not wait for each other."""
    square = block.times(x, x)
    even, odd = (block.polynomial(square, coefficients[i::2]) for i in (0, 1))
    return block.fused(odd, x, even)


def _all_of(block: ExactBody, *tests: str) -> str:
    result = tests[0]
    for test in tests[1:]:
        result = block.put(f"and {block.number.mask} {result}, {test}")
    return result


def _otherwise(block: ExactBody, usual: str, value: str) -> str:
    """The value in the usual lanes, that of `pow` in the others, which is computed if there are any."""
    number = block.number
    flipped = f"<i1 true{', i1 true' * (number.lanes - 1)}>"
    other = block.put(f"xor {number.mask} {usual}, {flipped}")
    some = block.put(f"call i1 @llvm.vector.reduce.or.v{number.lanes}i1({number.mask} {other})")
    block.lines += [f"  br i1 {some}, label %unusual, label %end", "unusual:"]
    block.lines += [
        f"  %exact = call {number.text} @{number.function('pow')}({number.text} %x, {number.text} %y)",
        f"  %mixed = select {number.mask} {usual}, {number.text} {value}, {number.text} %exact",
        "  br label %end",
        "end:",
        f"  %result = phi {number.text} [ {value}, %0 ], [ %mixed, %unusual ]",
    ]
    return "%result"

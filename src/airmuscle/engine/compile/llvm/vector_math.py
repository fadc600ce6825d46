"""Vectorised exponential, logarithm, power, sine and cosine; other functions of the C library lane
by lane.

The C library processes one lane per call; these functions consist of operations on all lanes.
Maximum error against extended precision, in units in the last place: exp 0.85, log 0.51, pow 1.0,
sin and cos 0.81 (tests/dynamics/test_lanes.py), over the whole range, with zero, infinity and NaN
as in IEEE 754; angles beyond LARGEST_ANGLE are computed by the C library. Single precision is
computed in double precision and rounded once. Powers with a steady exponent have a shorter form
(`steady_power`).

References: range reduction and the exact product by the parts of ln 2 after Tang, P. T. P., ACM
TOMS 15(2), 1989; sum and product with their rounding error after Dekker, T. J., Numerische
Mathematik 18, 1971.
"""

import math
from collections.abc import Collection, Mapping, Sequence

from .emit import STEADY_POWER, FunctionBody, LlvmType, function_of_values
from .exact import ExactBody, steady_power

LN2_HIGH = 0.693147180559890330187
LN2_LOW = 5.497923018708371e-14
"""ln 2 in two parts; the first ends in zeros, so that its product with an exponent is exact."""
QUARTER_HIGH = math.pi / 2
QUARTER_LOW = 6.123233995736766e-17
QUARTER_LEAST = -1.4973849048591698e-33
"""pi/2 in three parts."""
LARGEST_ANGLE = 1e6
"""Largest angle [rad] for which these parts are sufficient."""
TWO_THIRDS_LOW = 2.0**-53 / 3
"""2/3 minus the nearest double."""
LEAST_NORMAL = 2.0**-1022


class _Functions(ExactBody):
    """Elementary functions in double lanes."""

    def exponential(self, x: str, low: str | None = None) -> str:
        """e**(x + low) with low of the order of the rounding error of x: 2**n e**r, |r| <= ln 2 /
        2, Taylor series.
        """
        x = self.choose(">", x, self.constant(720.0), self.constant(720.0), x)
        x = self.choose("<", x, self.constant(-760.0), self.constant(-760.0), x)
        n = self.rounded(self.times(x, self.constant(1 / math.log(2))))
        back = self.negative(n)
        r = self.fused(back, self.constant(LN2_HIGH), x)
        rest = self.times(back, self.constant(LN2_LOW))
        r, lost = self.sum_of(r, rest if low is None else self.add(rest, low))
        tail = self.polynomial(r, [1 / math.factorial(i) for i in range(2, 14)])
        value = self.add(self.constant(1.0), self.add(r, self.fused(self.times(r, r), tail, lost)))
        half = self.rounded(self.times(n, self.constant(0.5)))
        return self.times(
            self.times(value, self.power_of_two(half)), self.power_of_two(self.subtract(n, half))
        )

    def logarithm(self, x: str) -> tuple[str, str]:
        """ln x in two parts: x = 2**n m with m from sqrt(1/2) to sqrt(2), ln m = 2 artanh((m -
        1)/(m + 1)).
        """
        scaled = self.times(x, self.constant(2.0**54))
        bits = self.bits(self.choose("<", x, self.constant(LEAST_NORMAL), scaled, x))
        offset = self.choose(
            "<", x, self.constant(LEAST_NORMAL), self.constant(-54.0), self.constant(0.0)
        )
        exponent = self.shifted("ashr", self.on_bits("sub", bits, math.sqrt(0.5)))
        m = self.from_bits(self.on_bits("sub", bits, self.shifted("shl", exponent)))
        n = self.subtract(
            self.from_bits(self.on_bits("add", exponent, self.rounder)), self.constant(self.rounder)
        )
        n = self.add(n, offset)
        one = self.constant(1.0)
        above = self.subtract(m, one)
        below = self.add(m, one)
        lost = self.subtract(m, self.subtract(below, one))
        s = self.over(above, below)
        left = self.fused(self.negative(s), below, above)
        left = self.over(self.fused(self.negative(s), lost, left), below)
        n_high, n_low = (self.times(n, self.constant(part)) for part in (LN2_HIGH, LN2_LOW))
        high, error = self.sum_of(n_high, self.add(s, s))
        cube, rest = self._after_the_first(s, left)
        high, more = self.sum_of(high, cube)
        low = self.add(self.add(n_low, self.add(left, left)), self.add(self.add(error, more), rest))
        return self._at_the_ends(x, *self.sum_of(high, low))

    def _after_the_first(self, s: str, lost: str) -> tuple[str, str]:
        """2 artanh(s + lost) - 2 (s + lost) in two parts: 2/3 s**3, and its error with all further
        terms.
        """
        z = self.times(s, s)
        z_lost = self.fused(self.add(s, s), lost, self.fused(s, s, self.negative(z)))
        third = self.times(s, z)
        third_lost = self.fused(s, z, self.negative(third))
        third_lost = self.add(third_lost, self.fused(s, z_lost, self.times(lost, z)))
        share = self.constant(2 / 3)
        share_lost = self.constant(TWO_THIRDS_LOW)
        cube = self.times(share, third)
        cube_lost = self.fused(share, third_lost, self.fused(share, third, self.negative(cube)))
        cube_lost = self.fused(share_lost, third, cube_lost)
        tail = self.polynomial(z, [2 / (2 * i + 5) for i in range(11)])
        return cube, self.fused(self.times(third, z), tail, cube_lost)

    def _at_the_ends(self, x: str, high: str, low: str) -> tuple[str, str]:
        """The logarithm with its values at 0, infinity, negative arguments and NaN."""
        zero = self.constant(0.0)
        infinity = self.constant(math.inf)
        high = self.choose("<", x, infinity, high, x)
        high = self.choose("==", x, zero, self.constant(-math.inf), high)
        high = self.choose("<", x, zero, self.constant(math.nan), high)
        return high, self.choose("<", self.size_of(high), infinity, low, zero)

    def power_by_logarithm(self, x: str, y: str) -> str:
        """x**y = e**(y ln|x|), with the sign and the exceptions of IEEE 754."""
        zero = self.constant(0.0)
        one = self.constant(1.0)
        infinity = self.constant(math.inf)
        size = self.size_of(x)
        high, low = self.logarithm(size)
        product = self.times(y, high)
        lost = self.fused(y, low, self.fused(y, high, self.negative(product)))
        lost = self.choose("<", self.size_of(product), self.constant(1e3), lost, zero)
        value = self.exponential(product, lost)
        value = self.choose("==", size, one, self.choose("ordered", y, y, one, y), value)
        half = self.times(y, self.constant(0.5))
        whole = self.choose("==", self.rounded(y), y, one, zero)
        even = self.choose("==", self.rounded(half), half, one, zero)
        signed = self.intrinsic("copysign", (value, x), "")
        value = self.choose(">", whole, even, signed, value)
        undefined = self.choose("==", whole, one, value, self.constant(math.nan))
        value = self.choose("<", x, zero, self.choose("<", size, infinity, undefined, value), value)
        value = self.choose("==", y, zero, one, value)
        return self.choose("==", x, one, one, value)

    def sine(self, x: str, quarters: float) -> str:
        """sin(x + quarters pi/2) for |x| up to LARGEST_ANGLE: reduction by multiples of pi/2, then
        Taylor series.
        """
        n = self.rounded(self.times(x, self.constant(2 / math.pi)))
        back = self.negative(n)
        nearly = self.fused(back, self.constant(QUARTER_HIGH), x)
        low = self.times(back, self.constant(QUARTER_LOW))
        lost = self.fused(back, self.constant(QUARTER_LOW), self.negative(low))
        r, error = self.sum_of_any(nearly, low)
        lost = self.add(error, self.fused(back, self.constant(QUARTER_LEAST), lost))
        z = self.times(r, r)
        odd = self.polynomial(z, [(-1) ** i / math.factorial(2 * i + 1) for i in range(1, 9)])
        even = self.polynomial(z, [(-1) ** i / math.factorial(2 * i) for i in range(2, 9)])
        sine = self.add(r, self.fused(self.times(z, r), odd, lost))
        half = self.times(z, self.constant(0.5))
        near = self.subtract(self.constant(1.0), half)
        one = self.constant(1.0)
        left = self.subtract(self.subtract(one, near), half)
        cosine = self.add(
            near, self.fused(self.times(z, z), even, self.subtract(left, self.times(r, lost)))
        )
        turn = self.bits(
            self.add(self.add(n, self.constant(quarters)), self.constant(self.rounder))
        )
        which = self.put(f"trunc {self.number.whole} {turn} to {self.number.mask}")
        chosen = self.put(
            f"select {self.number.mask} {which}, {self.number.text} {cosine}, {self.number.text}"
            f" {sine}"
        )
        sign = self.on_bits("shl", self.on_bits("and", turn, 2 * 5e-324), 62 * 5e-324)
        return self.from_bits(self.on_bits("xor", self.bits(chosen), sign))

    def unless_large(self, x: str, otherwise: str) -> None:
        """Return the value of the function `otherwise` if any lane exceeds LARGEST_ANGLE, is
        infinite or NaN.
        """
        number = self.number
        large = self.put(
            f"fcmp ugt {number.text} {self.size_of(x)}, {self.constant(LARGEST_ANGLE)}"
        )
        some = self.put(f"call i1 @llvm.vector.reduce.or.v{number.lanes}i1({number.mask} {large})")
        self.lines += [
            f"  br i1 {some}, label %large, label %usual",
            "large:",
            f"  %large.value = call {number.text} @{otherwise}({number.text} {x})",
            f"  ret {number.text} %large.value",
            "usual:",
        ]


def definition(name: str, count: int, number: LlvmType) -> str:
    """The LLVM text of a function of the C library, of one or two arguments, in lanes."""
    double = LlvmType(64, number.lanes)
    if name == STEADY_POWER:
        return steady_power(number)
    if number != double:
        return _in_double(name, count, number, double)
    block = _Functions(number.lanes)
    arguments = [f"%{a}" for a in "xy"[:count]]
    before = ""
    if name == "exp":
        value = block.exponential("%x")
    elif name == "log":
        value = block.add(*block.logarithm("%x"))
    elif name == "pow":
        value = block.power_by_logarithm("%x", "%y")
    elif name in ("sin", "cos"):
        each = f"each.{number.function(name)}"
        before = _lane_by_lane(name, each, arguments, number)
        block.unless_large("%x", each)
        value = block.sine("%x", 1.0 if name == "cos" else 0.0)
    else:
        return _lane_by_lane(name, number.function(name), arguments, number)
    return before + function_of_values(number.function(name), arguments, block, number, value)


def _in_double(name: str, count: int, number: LlvmType, double: LlvmType) -> str:
    """A function in single precision by that in double precision, which is printed with it."""
    block = _Functions(number.lanes)
    arguments = [f"%{a}" for a in "xy"[:count]]
    wide = [block.put(f"fpext {number.text} {a} to {double.text}") for a in arguments]
    given = ", ".join(f"{double.text} {a}" for a in wide)
    value = block.put(f"call {double.text} @{double.function(name)}({given})")
    value = block.put(f"fptrunc {double.text} {value} to {number.text}")
    return definition(name, count, double) + function_of_values(
        number.function(name), arguments, block, number, value
    )


def _lane_by_lane(name: str, as_name: str, arguments: Sequence[str], number: LlvmType) -> str:
    block = FunctionBody((), number)
    vector = "poison"
    for i in range(number.lanes):
        given = [block.put(f"extractelement {number.text} {a}, i32 {i}") for a in arguments]
        value = block.put(f"call double @{name}({', '.join(f'double {a}' for a in given)})")
        vector = block.put(f"insertelement {number.text} {vector}, double {value}, i32 {i}")
    return function_of_values(as_name, arguments, block, number, vector)


def definitions(needed: Mapping[str, int], number: LlvmType) -> str:
    """Definitions of the functions that printed code needs, by name with the number of their
    arguments, and of what they call.
    """
    parts = [definition(name, count, number) for name, count in needed.items()]
    return "\n".join([declarations({number}), *parts])


def declarations(numbers: Collection[LlvmType]) -> str:
    """Declarations of the intrinsics that printed code calls, for these types and for doubles with
    as many lanes.
    """
    text = ""
    for kind in sorted(
        {*numbers, *(LlvmType(64, number.lanes) for number in numbers)},
        key=lambda k: (k.bits, k.lanes),
    ):
        for name, count in (("sqrt", 1), ("fabs", 1), ("rint", 1), ("copysign", 2), ("fma", 3)):
            text += (
                f"declare {kind.text} @{kind.intrinsic(name)}({', '.join([kind.text] * count)})\n"
            )
    for kind in sorted({LlvmType(64, number.lanes) for number in numbers}, key=lambda k: k.lanes):
        text += f"declare i1 @llvm.vector.reduce.or.v{kind.lanes}i1({kind.mask})\n"
    return text

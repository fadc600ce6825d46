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
from collections.abc import Collection, Iterable, Mapping, Sequence

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
LEAST = 5e-324
"""The double whose bits are those of the integer 1."""


class _Functions(ExactBody):
    """Elementary functions in double lanes."""

    def exponential(self, x: str, low: str | None = None) -> str:
        """e**(x + low) with low of the order of the rounding error of x: 2**n e**r, |r| <= ln 2 /
        2, Taylor series.
        """
        # beyond these arguments the result is infinite or zero
        largest = self.constant(720.0)
        x = self.choose(">", x, largest, largest, x)
        smallest = self.constant(-760.0)
        x = self.choose("<", x, smallest, smallest, x)
        doublings = self.times(x, self.constant(1 / math.log(2)))
        n = self.rounded(doublings)
        back = self.negative(n)
        r = self.fused(back, self.constant(LN2_HIGH), x)
        rest = self.times(back, self.constant(LN2_LOW))
        if low is not None:
            rest = self.add(rest, low)
        r, lost = self.sum_of(r, rest)
        coefficients = [1 / math.factorial(i) for i in range(2, 14)]
        tail = self.polynomial(r, coefficients)
        unity = self.constant(1.0)
        square = self.times(r, r)
        beyond_first = self.fused(square, tail, lost)
        above_unity = self.add(r, beyond_first)
        value = self.add(unity, above_unity)
        # in two factors, because 2**n itself may lie outside the ordinary numbers
        half = self.rounded(self.times(n, self.constant(0.5)))
        value = self.times(value, self.power_of_two(half))
        remaining = self.subtract(n, half)
        return self.times(value, self.power_of_two(remaining))

    def logarithm(self, x: str) -> tuple[str, str]:
        """ln x in two parts: x = 2**n m with m from sqrt(1/2) to sqrt(2), ln m = 2 artanh((m -
        1)/(m + 1)).
        """
        # a subnormal number has no exponent of its own
        scaled = self.times(x, self.constant(2.0**54))
        least_normal = self.constant(LEAST_NORMAL)
        normal = self.choose("<", x, least_normal, scaled, x)
        bits = self.bits(normal)
        offset = self.choose("<", x, least_normal, self.constant(-54.0), self.constant(0.0))
        from_root_of_half = self.on_bits("sub", bits, math.sqrt(0.5))
        exponent = self.shifted("ashr", from_root_of_half)
        exponent_bits = self.shifted("shl", exponent)
        m = self.from_bits(self.on_bits("sub", bits, exponent_bits))
        rounder_and_exponent = self.from_bits(self.on_bits("add", exponent, self.rounder))
        n = self.subtract(rounder_and_exponent, self.constant(self.rounder))
        n = self.add(n, offset)
        unity = self.constant(1.0)
        numerator = self.subtract(m, unity)
        denominator = self.add(m, unity)
        represented = self.subtract(denominator, unity)
        lost = self.subtract(m, represented)
        s = self.over(numerator, denominator)
        left = self.fused(self.negative(s), denominator, numerator)
        left = self.fused(self.negative(s), lost, left)
        left = self.over(left, denominator)
        n_high = self.times(n, self.constant(LN2_HIGH))
        n_low = self.times(n, self.constant(LN2_LOW))
        high, error_of_first = self.sum_of(n_high, self.add(s, s))
        cube, rest = self._after_the_first(s, left)
        high, error_of_cube = self.sum_of(high, cube)
        low = self.add(n_low, self.add(left, left))
        errors = self.add(error_of_first, error_of_cube)
        low = self.add(low, self.add(errors, rest))
        return self._at_the_ends(x, *self.sum_of(high, low))

    def _after_the_first(self, s: str, lost: str) -> tuple[str, str]:
        """2 artanh(s + lost) - 2 (s + lost) in two parts: 2/3 s**3, and its error with all further
        terms.
        """
        z = self.times(s, s)
        twice_s = self.add(s, s)
        z_rounding = self.fused(s, s, self.negative(z))
        z_lost = self.fused(twice_s, lost, z_rounding)
        third = self.times(s, z)
        third_rounding = self.fused(s, z, self.negative(third))
        of_first_order = self.times(lost, z)
        third_lost = self.add(third_rounding, self.fused(s, z_lost, of_first_order))
        share = self.constant(2 / 3)
        share_lost = self.constant(TWO_THIRDS_LOW)
        cube = self.times(share, third)
        cube_rounding = self.fused(share, third, self.negative(cube))
        cube_lost = self.fused(share, third_lost, cube_rounding)
        cube_lost = self.fused(share_lost, third, cube_lost)
        coefficients = [2 / (2 * i + 5) for i in range(11)]
        tail = self.polynomial(z, coefficients)
        fifth = self.times(third, z)
        return cube, self.fused(fifth, tail, cube_lost)

    def _at_the_ends(self, x: str, high: str, low: str) -> tuple[str, str]:
        """The logarithm with its values at 0, infinity, negative arguments and NaN."""
        zero = self.constant(0.0)
        infinity = self.constant(math.inf)
        high = self.choose("<", x, infinity, high, x)
        pole = self.constant(-math.inf)
        high = self.choose("==", x, zero, pole, high)
        undefined = self.constant(math.nan)
        high = self.choose("<", x, zero, undefined, high)
        size = self.size_of(high)
        low = self.choose("<", size, infinity, low, zero)
        return high, low

    def power_by_logarithm(self, x: str, y: str) -> str:
        """x**y = e**(y ln|x|), with the sign and the exceptions of IEEE 754."""
        zero = self.constant(0.0)
        unity = self.constant(1.0)
        infinity = self.constant(math.inf)
        size = self.size_of(x)
        high, low = self.logarithm(size)
        product = self.times(y, high)
        rounding = self.fused(y, high, self.negative(product))
        lost = self.fused(y, low, rounding)
        # beyond 1000 the power is infinite or zero, and the lost part may be no number
        lost = self.choose("<", self.size_of(product), self.constant(1e3), lost, zero)
        value = self.exponential(product, lost)
        power_of_unity = self.choose("ordered", y, y, unity, y)
        value = self.choose("==", size, unity, power_of_unity, value)
        half = self.times(y, self.constant(0.5))
        integer = self.rounded(y)
        is_integer = self.choose("==", integer, y, unity, zero)
        integer_half = self.rounded(half)
        is_even = self.choose("==", integer_half, half, unity, zero)
        with_sign_of_x = self.intrinsic("copysign", (value, x), "")
        value = self.choose(">", is_integer, is_even, with_sign_of_x, value)
        real_or_nan = self.choose("==", is_integer, unity, value, self.constant(math.nan))
        of_negative = self.choose("<", size, infinity, real_or_nan, value)
        value = self.choose("<", x, zero, of_negative, value)
        value = self.choose("==", y, zero, unity, value)
        return self.choose("==", x, unity, unity, value)

    def sine(self, x: str, quarters: float) -> str:
        """sin(x + quarters pi/2) for |x| up to LARGEST_ANGLE: reduction by multiples of pi/2, then
        Taylor series.
        """
        number = self.number
        n = self.rounded(self.times(x, self.constant(2 / math.pi)))
        back = self.negative(n)
        nearly = self.fused(back, self.constant(QUARTER_HIGH), x)
        quarter_low = self.constant(QUARTER_LOW)
        low = self.times(back, quarter_low)
        rounding = self.fused(back, quarter_low, self.negative(low))
        r, error = self.sum_of_any(nearly, low)
        least = self.fused(back, self.constant(QUARTER_LEAST), rounding)
        lost = self.add(error, least)
        z = self.times(r, r)
        odd = self.polynomial(z, _alternating_inverse_factorials(range(3, 18, 2)))
        even = self.polynomial(z, _alternating_inverse_factorials(range(4, 17, 2)))
        cube = self.times(z, r)
        sine = self.add(r, self.fused(cube, odd, lost))
        half = self.times(z, self.constant(0.5))
        unity = self.constant(1.0)
        near = self.subtract(unity, half)
        represented = self.subtract(unity, near)
        left = self.subtract(represented, half)
        fourth = self.times(z, z)
        first_order = self.times(r, lost)
        left = self.subtract(left, first_order)
        cosine = self.add(near, self.fused(fourth, even, left))
        turned = self.add(n, self.constant(quarters))
        turn = self.bits(self.add(turned, self.constant(self.rounder)))
        is_cosine = self.put(f"trunc {number.whole} {turn} to {number.mask}")
        value = self.put(
            f"select {number.mask} {is_cosine}, {number.text} {cosine}, {number.text} {sine}"
        )
        # the second bit of the turn, moved to the place of the sign
        second_bit = self.on_bits("and", turn, 2 * LEAST)
        sign = self.on_bits("shl", second_bit, 62 * LEAST)
        signed = self.on_bits("xor", self.bits(value), sign)
        return self.from_bits(signed)

    def unless_large(self, x: str, otherwise: str) -> None:
        """Return the value of the function `otherwise` if any lane exceeds LARGEST_ANGLE, is
        infinite or NaN.
        """
        number = self.number
        large = self.put(
            f"fcmp ugt {number.text} {self.size_of(x)}, {self.constant(LARGEST_ANGLE)}"
        )
        any_large = self.put(
            f"call i1 @llvm.vector.reduce.or.v{number.lanes}i1({number.mask} {large})"
        )
        self.lines += [
            f"  br i1 {any_large}, label %large, label %usual",
            "large:",
            f"  %large.value = call {number.text} @{otherwise}({number.text} {x})",
            f"  ret {number.text} %large.value",
            "usual:",
        ]


def _alternating_inverse_factorials(numbers: Iterable[int]) -> list[float]:
    """Coefficients of the series of sine (odd numbers) and cosine (even ones)."""
    return [(-1) ** (n // 2) / math.factorial(n) for n in numbers]


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
        scalar_function = f"each.{number.function(name)}"
        before = _lane_by_lane(name, scalar_function, arguments, number)
        block.unless_large("%x", scalar_function)
        value = block.sine("%x", 1.0 if name == "cos" else 0.0)
    else:
        return _lane_by_lane(name, number.function(name), arguments, number)
    return before + function_of_values(number.function(name), arguments, block, number, value)


def _in_double(name: str, count: int, number: LlvmType, double: LlvmType) -> str:
    """A function in single precision by that in double precision, which is printed with it."""
    block = _Functions(number.lanes)
    arguments = [f"%{a}" for a in "xy"[:count]]
    single = number.text
    wide = double.text
    operands = []
    for argument in arguments:
        extended = block.put(f"fpext {single} {argument} to {wide}")
        operands.append(f"{wide} {extended}")
    called = double.function(name)
    in_double = block.put(f"call {wide} @{called}({', '.join(operands)})")
    value = block.put(f"fptrunc {wide} {in_double} to {single}")
    text_in_double = definition(name, count, double)
    as_name = number.function(name)
    return text_in_double + function_of_values(as_name, arguments, block, number, value)


def _lane_by_lane(name: str, as_name: str, arguments: Sequence[str], number: LlvmType) -> str:
    block = FunctionBody((), number)
    kind = number.text
    vector = "poison"
    for i in range(number.lanes):
        operands = []
        for argument in arguments:
            element = block.put(f"extractelement {kind} {argument}, i32 {i}")
            operands.append(f"double {element}")
        value = block.put(f"call double @{name}({', '.join(operands)})")
        vector = block.put(f"insertelement {kind} {vector}, double {value}, i32 {i}")
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

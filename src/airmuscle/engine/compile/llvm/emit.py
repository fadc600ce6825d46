"""LLVM text of instructions over numbers or vectors of lanes: straight-line code, and branches
around blocks.
"""

import dataclasses
import functools
import struct
from collections.abc import Callable, Mapping, Sequence

from ....core import Operation
from ..ir.emission import FunctionBlock, TargetLanguage, nearest_single
from ..ir.instructions import CALLED, Operand

FLAGS = "nsz arcp contract reassoc afn"
"""Fast-math flags without nnan and ninf: a failed step must remain detectable by NaN or
infinity.
"""

RARE = "noinline optnone"
"""Attributes of a function that runs once for a set of parameters, so that it is not worth the time
that optimising it would take."""
STEADY_POWER = "steadypow"
"""Name of the power with an exponent that depends on parameters alone, in lanes."""

_INTRINSICS = {"sqrt": "sqrt", "abs": "fabs", "floor": "floor"}
_ARITHMETIC = {"+": "fadd", "-": "fsub", "*": "fmul", "/": "fdiv"}
_COMPARISONS = {"<": "olt", "<=": "ole", ">": "ogt", "==": "oeq", "!=": "une", "ordered": "ord"}
"""Names of comparisons; numbers are ordered where none of them is NaN."""


@dataclasses.dataclass(frozen=True)
class LlvmType:
    """`lanes` numbers of `bits` each, which LLVM computes together: double, <32 x double>, <32 x
    float>.
    """

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
    def alignment(self) -> int:
        """Alignment of a value in bytes: its size, at most a cache line."""
        return min(self.lanes * self.bits // 8, 64)

    def intrinsic(self, name: str) -> str:
        """Name of an LLVM intrinsic for this type: llvm.sqrt.f64, llvm.sqrt.v32f64."""
        return f"llvm.{name}.{f'v{self.lanes}' if self.lanes > 1 else ''}f{self.bits}"

    def function(self, name: str) -> str:
        """Name of the vectorised replacement of a C library function, which `vector_math`
        defines.
        """
        return f"{name}.v{self.lanes}f{self.bits}"

    def literal(self, value: float) -> str:
        """A number as LLVM text; in single precision it is rounded first, because LLVM requires an
        exact value.
        """
        if self.bits == 32:
            value = nearest_single(value)
        return f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"

    def _of(self, element: str) -> str:
        return element if self.lanes == 1 else f"<{self.lanes} x {element}>"


DOUBLE = LlvmType()
_OF_ONE = (
    *sorted({*CALLED.values()} - {"pow"}),
    *(DOUBLE.intrinsic(name) for name in _INTRINSICS.values()),
)
DECLARED = (
    "".join(f"declare double @{name}(double)\n" for name in _OF_ONE)
    + "declare double @pow(double, double)\n"
)
"""Declarations of the functions that printed code may call."""


class FunctionBody(FunctionBlock):
    """The lines of one LLVM function under construction, with elimination of common subexpressions.

    Every value has the type `number`. In lanes, functions that are not LLVM intrinsics are called
    by the names in `needed`, whose definitions `vector_math` prints.
    """

    language = "LLVM"

    def __init__(self, scalars: Sequence[str] = (), number: LlvmType = DOUBLE) -> None:
        super().__init__(scalars)
        self.number = number
        self._constants: dict[str, float] = {}
        self._steady: set[str] = set()

    def assignment(self, name: str, expression: str) -> str:
        return f"  {name} = {expression}"

    def new_name(self) -> str:
        self._named += 1
        return f"%v{self._named}"

    def constant(self, value: float) -> str:
        """A constant; in lanes a splat, which LLVM recognises as a constant."""
        number = self.number
        result = number.literal(value)
        if number.lanes > 1:
            result = self._spread(result)
        self._constants[result] = value
        return result

    def _spread(self, element: str) -> str:
        """A vector with one value in all lanes."""
        number = self.number
        first = self.put(f"insertelement {number.text} poison, {number.element} {element}, i32 0")
        places = f"<{number.lanes} x i32> zeroinitializer"
        return self.put(f"shufflevector {number.text} {first}, {number.text} poison, {places}")

    def load(self, array: str, index: int) -> str:
        """The value of an array element, or of a scalar argument."""
        if array in self.scalars:
            return f"%{array}"
        place = self.put(f"getelementptr inbounds {self.number.text}, ptr %{array}, i64 {index}")
        value = self.put(f"load {self.number.text}, ptr {place}, align {self.number.alignment}")
        if array.startswith("c"):
            self._steady.add(value)
        return value

    def store(self, array: str, index: int, value: str) -> None:
        """Write a value into an array element."""
        place = self.put(f"getelementptr inbounds {self.number.text}, ptr %{array}, i64 {index}")
        self.lines.append(
            f"  store {self.number.text} {value}, ptr {place}, align {self.number.alignment}"
        )

    @property
    def calls_parts(self) -> bool:
        """Whether repeated parts are functions that are called: of one number, whose arrays are
        plain."""
        return self.number == DOUBLE

    def address(self, array: str, index: int) -> str:
        """The address of an array element."""
        return self.put(f"getelementptr inbounds {self.number.text}, ptr %{array}, i64 {index}")

    def call_part(
        self, name: str, addresses: Sequence[str], values: Sequence[str], count: int
    ) -> list[str]:
        """Call a function of `function_of_part`; the names of the `count` values that it
        returns."""
        kind = self.number.text
        arguments = [f"ptr {a}" for a in addresses] + [f"{kind} {value}" for value in values]
        call = f"call fastcc {_returned(kind, count)} @{name}({', '.join(arguments)})"
        if not count:
            self.lines.append(f"  {call}")
            return []
        result = self.put(call)
        kinds = _returned(kind, count)
        return [self.put(f"extractvalue {kinds} {result}, {k}") for k in range(count)]

    def choose(self, comparison: str, a: str, b: str, when_true: str, when_false: str) -> str:
        number = self.number
        kind = number.text
        condition = _COMPARISONS[comparison]
        test = self.put(f"fcmp {condition} {kind} {a}, {b}")
        return self.put(f"select {number.mask} {test}, {kind} {when_true}, {kind} {when_false}")

    def call(self, function: str, x: Sequence[str]) -> str:
        return (
            self.intrinsic(_INTRINSICS[function], x)
            if function in _INTRINSICS
            else self.call_library(function, x)
        )

    def call_library(self, function: str, x: Sequence[str]) -> str:
        """Call of a function of the C library, or of its vectorised replacement in lanes."""
        number = self.number
        kind = number.text
        arguments = ", ".join(f"{kind} {a}" for a in x)
        if number == DOUBLE:
            return self.put(f"call {FLAGS} double @{function}({arguments})")
        self.needed[function] = len(x)
        in_lanes = number.function(function)
        return self.put(f"call {kind} @{in_lanes}({arguments})")

    def intrinsic(self, name: str, x: Sequence[str], flags: str = FLAGS) -> str:
        """Call of an LLVM intrinsic."""
        arguments = ", ".join(f"{self.number.text} {a}" for a in x)
        return self.put(
            f"call {flags} {self.number.text} @{self.number.intrinsic(name)}({arguments})"
        )

    def power(self, base: str, exponent: str) -> str:
        """base**exponent; in lanes, integer and half-integer constants give products, as LLVM does
        for scalars, and other exponents that are constant or depend on parameters alone the shorter
        form of `steady_power`.
        """
        value = self._constants.get(exponent)
        if (
            self.number == DOUBLE
            or value is None
            or abs(value) > 16
            or not (2 * value).is_integer()
        ):
            return self.power_by_call(base, exponent)
        result = self.constant(1.0)
        square = base
        left = int(abs(value))
        while left:
            if left % 2:
                result = self.arithmetic("*", result, square)
            square = self.arithmetic("*", square, square)
            left = left // 2
        if abs(value) % 1:
            result = self.arithmetic("*", result, self.intrinsic("sqrt", (base,)))
        return result if value >= 0 else self.arithmetic("/", self.constant(1.0), result)

    def power_by_call(self, base: str, exponent: str) -> str:
        """base**exponent by a function."""
        if self.number == DOUBLE or (
            exponent not in self._constants and exponent not in self._steady
        ):
            return self.call_library("pow", (base, exponent))
        self.needed["pow"] = 2  # for arguments beyond the range of the shorter form
        return self.call_library(STEADY_POWER, (base, exponent))

    def unless_zero(
        self,
        gates: Sequence[str],
        compute: Callable[[], dict[Operand, str]],
        instead: Mapping[Operand, str],
    ) -> dict[Operand, str]:
        """The results that `compute` appends and returns if one of `gates` is not zero, otherwise
        those of `instead`.

        In lanes, the block is executed if any lane requires it; the other lanes keep the values of
        `instead`.
        """
        number, here = self.number, self.new_name()[1:]
        self.lines += [f"  br label %{here}.if", f"{here}.if:"]
        tests = [self.put(f"fcmp une {number.text} {gate}, {self.constant(0.0)}") for gate in gates]
        test = functools.reduce(lambda a, b: self.put(f"or {number.mask} {a}, {b}"), tests)
        any_lane = test
        if number.lanes > 1:
            bits = self.put(f"bitcast {number.mask} {test} to i{number.lanes}")
            any_lane = self.put(f"icmp ne i{number.lanes} {bits}, 0")
        self.lines += [
            f"  br i1 {any_lane}, label %{here}.then, label %{here}.end",
            f"{here}.then:",
        ]
        # values of the block are not available after it
        outside = self.known
        self.known = dict(self.known)
        inside = compute()
        if number.lanes > 1:
            for operand, value in instead.items():
                inside[operand] = self.put(
                    f"select {number.mask} {test}, {number.text} {inside[operand]}, {number.text}"
                    f" {value}"
                )
        self.known = outside
        self.lines += [f"  br label %{here}.end", f"{here}.end:"]
        joined = {}
        for operand, value in instead.items():
            joined[operand] = self.new_name()
            sources = f"[ {value}, %{here}.if ], [ {inside[operand]}, %{here}.then ]"
            self.lines.append(f"  {joined[operand]} = phi {number.text} {sources}")
        return joined

    def arithmetic(self, operator: str, a: str, b: str) -> str:
        return self.put(f"{_ARITHMETIC[operator]} {FLAGS} {self.number.text} {a}, {b}")

    def logical(self, operator: str, a: str, b: str) -> str:
        return self.put(f"{_ARITHMETIC[operator]} {self.number.text} {a}, {b}")

    def negative(self, a: str) -> str:
        return self.put(f"fneg {FLAGS} {self.number.text} {a}")

    def operate(self, operation: Operation, x: Sequence[str]) -> str:
        return (
            self.power(x[0], x[1])
            if operation == Operation.POWER
            else super().operate(operation, x)
        )


@dataclasses.dataclass(frozen=True)
class LlvmLanguage(TargetLanguage):
    """LLVM text, with one number in every value or with one of each lane."""

    number: LlvmType = DOUBLE

    def body(self, scalars: Sequence[str] = ()) -> FunctionBody:
        return FunctionBody(scalars, self.number)

    def function(
        self, name: str, inputs: Sequence[str], outputs: Sequence[str], body: FunctionBlock
    ) -> str:
        return function(
            name, [*inputs, *outputs], body, "nounwind" if self.number.lanes == 1 else ALIGNED
        )

    def preparation(
        self, name: str, inputs: Sequence[str], outputs: Sequence[str], body: FunctionBlock
    ) -> str:
        return function(name, [*inputs, *outputs], body, f"nounwind {RARE}")


ALIGNED = (  # else the time of spilled vectors depends on the depth of the stack at the call
    "nounwind alignstack(64)"
)


def function(
    name: str, arguments: Sequence[str], block: FunctionBlock, attributes: str = "nounwind"
) -> str:
    """The LLVM text of a function that returns nothing; arrays are pointers that do not overlap."""
    signature = ", ".join(
        f"double %{a}" if a in block.scalars else f"ptr noalias nocapture %{a}" for a in arguments
    )
    return (
        f"define void @{name}({signature}) {attributes} {{\n"
        + "\n".join(block.lines)
        + "\n  ret void\n}\n"
    )


def _returned(kind: str, count: int) -> str:
    """The type of a function's result of so many values."""
    return f"{{ {', '.join([kind] * count)} }}" if count else "void"


def function_of_part(
    name: str,
    arguments: Sequence[str],
    block: FunctionBody,
    values: Sequence[str],
    attributes: str = "noinline",
) -> str:
    """The LLVM text of a function that functions of the same module call, which returns values; its
    arrays do not overlap."""
    kind = block.number.text
    signature = ", ".join(
        f"{kind} %{a}" if a in block.scalars else f"ptr noalias nocapture %{a}" for a in arguments
    )
    kinds = _returned(kind, len(values))
    lines = list(block.lines)
    result = "poison"
    for k, value in enumerate(values):
        lines.append(f"  %result{k} = insertvalue {kinds} {result}, {kind} {value}, {k}")
        result = f"%result{k}"
    lines.append(f"  ret {kinds} {result}" if values else "  ret void")
    head = f"define hidden fastcc {kinds} @{name}({signature}) nounwind {attributes}"
    return f"{head} {{\n" + "\n".join(lines) + "\n}\n"


def function_of_values(
    name: str,
    arguments: Sequence[str],
    block: FunctionBlock,
    number: LlvmType,
    value: str,
    more: str = "",
) -> str:
    """The LLVM text of a function within a module, which takes and returns values."""
    signature = ", ".join(f"{number.text} {a}" for a in arguments)
    head = f"define internal {number.text} @{name}({signature}) nounwind{more} {{\n"
    return head + "\n".join(block.lines) + f"\n  ret {number.text} {value}\n}}\n"

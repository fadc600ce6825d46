"""Arithmetic on values of a function under construction: scalars and LLVM vectors."""

import dataclasses
from collections.abc import Mapping

from .emit import FLAGS, FunctionBody


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
        return LlvmValue(self.block, self.block.put(f"shufflevector {kind} {first}, {kind} poison, {places}"), lanes)

    def _with(self, operation: str, other: "LlvmValue") -> "LlvmValue":
        a, b = self.spread(other.lanes), other.spread(self.lanes)
        result = self.block.put(f"{operation} {FLAGS} {a.kind} {a.name}, {b.name}")
        return dataclasses.replace(a, name=result)

    def __add__(self, other: "LlvmValue") -> "LlvmValue":
        return self._with("fadd", other)

    def __sub__(self, other: "LlvmValue") -> "LlvmValue":
        return self._with("fsub", other)

    def __mul__(self, other: "LlvmValue") -> "LlvmValue":
        return self._with("fmul", other)

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

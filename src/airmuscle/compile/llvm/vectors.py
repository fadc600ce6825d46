"""Arithmetic on values of a function under construction: single numbers, and columns, which are LLVM vectors."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from .emit import FLAGS, FunctionBody


@dataclasses.dataclass(frozen=True)
class LlvmValue:
    """The name of a value in a block: one `double`, or with `lanes` a vector `<lanes x double>`.

    A number that meets a column is spread over its lanes, which need not be a power of two.
    """

    block: FunctionBody
    name: str
    lanes: int = 0

    @property
    def kind(self) -> str:
        """LLVM's name of the type."""
        return f"<{self.lanes} x double>" if self.lanes else "double"

    def spread(self, lanes: int) -> LlvmValue:
        """The number in every lane; a column stays as it is."""
        if self.lanes or not lanes:
            return self
        kind = f"<{lanes} x double>"
        first = self.block.put(f"insertelement {kind} poison, double {self.name}, i32 0")
        places = f"<{lanes} x i32> zeroinitializer"
        return LlvmValue(self.block, self.block.put(f"shufflevector {kind} {first}, {kind} poison, {places}"), lanes)

    def _with(self, operation: str, other: LlvmValue) -> LlvmValue:
        a, b = self.spread(other.lanes), other.spread(self.lanes)
        found = self.block.put(f"{operation} {FLAGS} {a.kind} {a.name}, {b.name}")
        return dataclasses.replace(a, name=found)

    def __add__(self, other: LlvmValue) -> LlvmValue:
        return self._with("fadd", other)

    def __sub__(self, other: LlvmValue) -> LlvmValue:
        return self._with("fsub", other)

    def __mul__(self, other: LlvmValue) -> LlvmValue:
        return self._with("fmul", other)

    def store(self, array: str, index: int) -> None:
        """Write it into array elements from `index` on."""
        place = self.block.put(f"getelementptr inbounds double, ptr %{array}, i64 {index}")
        self.block.lines.append(f"  store {self.kind} {self.name}, ptr {place}, align 8")


def loaded(block: FunctionBody, array: str, index: int, lanes: int = 0) -> LlvmValue:
    """What stands in array elements from `index` on."""
    if not lanes:
        return LlvmValue(block, block.load(array, index))
    place = block.put(f"getelementptr inbounds double, ptr %{array}, i64 {index}")
    return LlvmValue(block, block.put(f"load <{lanes} x double>, ptr {place}, align 8"), lanes)


def packed(block: FunctionBody, values: Mapping[int, str], lanes: int) -> LlvmValue:
    """These numbers in their lanes, zero in all others."""
    name = "zeroinitializer"
    for lane, value in values.items():
        name = block.put(f"insertelement <{lanes} x double> {name}, double {value}, i32 {lane}")
    return LlvmValue(block, name, lanes)

"""Groups of lanes: functions in lanes, computed for as many lanes as one register holds, for one
group after the other.

A value of several registers would not stay in the registers. All groups run the same code, so that
the result of a lane does not depend on its place; while one group waits for a root or a quotient,
the processor is at the next.
"""

import dataclasses
import itertools
from collections.abc import Mapping, Sequence
from types import MappingProxyType

from ..ir.emission import FunctionBlock, TargetLanguage
from . import emit
from .emit import FunctionBody, LlvmType

CACHE_LINE = 64
"""Bytes of a cache line, and of the widest register: the alignment of arrays."""
NO_ROOM: Mapping[str, int] = MappingProxyType({})


@dataclasses.dataclass(frozen=True)
class LaneGroups(TargetLanguage):
    """LLVM text of functions of arrays of `lanes`, for a processor with registers of so many
    bytes.
    """

    lanes: LlvmType
    register: int

    @property
    def number(self) -> LlvmType:
        """The type of a value: one register."""
        bits = self.lanes.bits
        return LlvmType(bits, min(self.lanes.lanes, self.register * 8 // bits))

    @property
    def width(self) -> int:
        """The bytes of a value."""
        return self.number.lanes * self.number.bits // 8

    @property
    def groups(self) -> int:
        """The number of registers of an array element."""
        return self.lanes.lanes // self.number.lanes

    def body(self, scalars: Sequence[str] = ()) -> "GroupBody":
        return GroupBody(scalars, self)

    def function(
        self, name: str, inputs: Sequence[str], outputs: Sequence[str], body: FunctionBlock
    ) -> str:
        arguments = [*inputs, *outputs]
        part = self.part(f"{name}.group", arguments, body)
        return part + self.sequence(name, arguments, {f"{name}.group": arguments})

    def preparation(
        self, name: str, inputs: Sequence[str], outputs: Sequence[str], body: FunctionBlock
    ) -> str:
        """`prepare` runs once for a set of parameters, so it is not worth the time that optimising
        it would take.
        """
        arguments = [*inputs, *outputs]
        part = self.part(f"{name}.group", arguments, body, "optnone")
        return part + self.sequence(name, arguments, {f"{name}.group": arguments})

    def part(
        self, name: str, arguments: Sequence[str], body: FunctionBlock, attributes: str = ""
    ) -> str:
        """The text of a function for one group."""
        text = emit.function(name, arguments, body, f"{emit.ALIGNED} noinline {attributes}".strip())
        return text.replace("define", "define internal", 1)

    def sequence(
        self,
        name: str,
        arguments: Sequence[str],
        parts: Mapping[str, Sequence[str]],
        room: Mapping[str, int] = NO_ROOM,
        *,
        by_group: bool = False,
    ) -> str:
        """The text of a function that calls each part, with its arguments, for all groups before it
        calls the next part, or all parts for each group before the next group.

        `room` are arrays of its own, and their numbers of elements.
        """
        block = FunctionBody((), self.lanes)
        for array, length in room.items():
            kind = f"[{length} x {self.lanes.text}]"
            block.lines.append(f"  %{array} = alloca {kind}, align {CACHE_LINE}")
        calls = list(itertools.product(parts, range(self.groups)))
        if by_group:
            calls.sort(key=lambda call: call[1])
        for part, group in calls:
            places = [
                block.put(f"getelementptr inbounds i8, ptr %{array}, i64 {group * self.width}")
                for array in parts[part]
            ]
            pointers = ", ".join(f"ptr {place}" for place in places)
            block.lines.append(f"  call void @{part}({pointers})")
        return emit.function(name, arguments, block, emit.ALIGNED if room else "nounwind")


class GroupBody(FunctionBody):
    """The function of one group, whose elements stand one array element of all lanes apart."""

    def __init__(self, scalars: Sequence[str], form: LaneGroups) -> None:
        super().__init__(scalars, form.number)
        self._groups = form.groups

    def load(self, array: str, index: int) -> str:
        """The value of an array element, or of a scalar argument."""
        return super().load(array, index * self._groups)

    def store(self, array: str, index: int, value: str) -> None:
        """Write a value into an array element."""
        super().store(array, index * self._groups, value)

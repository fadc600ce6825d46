"""The functions of a system over vectors: for many plants side by side, and for many rows of one
plant.
"""

import dataclasses
from collections.abc import Mapping, Sequence

from ...core import nodes
from .functions import POINT, Extension, Printer, TracedSystem
from .ir import emission
from .ir.instructions import Code, Operand, instructions
from .llvm import emit, vector_math
from .llvm.emit import FLAGS, FunctionBody, LlvmType
from .llvm.groups import LaneGroups

ROWS = LlvmType(lanes=4)
"""A value of several rows of one plant. Vectors of eight slow down what the processor does next
(measured).
"""
MAX_OPERATIONS = 2000
"""Outputs of more operations are computed row by row: compiling them twice takes longer than runs
save (measured).
"""


def rows_at_once(t: TracedSystem) -> int:
    """The number of rows whose outputs one call computes; 1 where that is `outputs`, otherwise it
    is `row_outputs`.
    """
    count = len(nodes.in_order(t.o)) + len(t.o)
    return ROWS.lanes if count <= MAX_OPERATIONS else 1


def row_outputs(t: TracedSystem) -> Extension:
    """The function `row_outputs(x, u, c, o)`: `outputs` at `ROWS` at once, of one plant.

    x, u, o   (W, n), (W, m), (W, k), one row after the other
    """

    def add(printer: Printer) -> None:
        widths = {"x": len(t.x), "u": len(t.u), "o": len(t.o)}
        block = _RowsBody(widths)
        code = instructions(list(t.point.values()), [t.o])
        results = printer.compute(block, code, POINT)
        for (_, index), value in results.items():
            block.store("o", index, value)
        text = emit.function("row_outputs", ["x", "u", "c", "o"], block)
        printer.text.append(vector_math.declarations({ROWS}) + text)

    return add


class _RowsBody(FunctionBody):
    """A function at several rows of one plant: its arguments are tables of these rows, `c` is the
    same for all.
    """

    def __init__(self, widths: Mapping[str, int]) -> None:
        super().__init__((), ROWS)
        self._widths = widths

    def load(self, array: str, index: int) -> str:
        """The value of an array element in each row."""
        if array not in self._widths:
            return self._spread(self._element(array, index))
        result = "poison"
        for row in range(ROWS.lanes):
            element = self._element(array, index + row * self._widths[array])
            result = self.put(
                f"insertelement {ROWS.text} {result}, {ROWS.element} {element}, i32 {row}"
            )
        return result

    def store(self, array: str, index: int, value: str) -> None:
        """Write an array element in each row."""
        width = self._widths[array]
        kind = ROWS.element
        for row in range(ROWS.lanes):
            element = self.put(f"extractelement {ROWS.text} {value}, i32 {row}")
            place = self._place(array, index + row * width)
            self.lines.append(f"  store {kind} {element}, ptr {place}, align 8")

    def call_library(self, function: str, x: Sequence[str]) -> str:
        """A call of the C library for each row; vectorised functions would take longer to compile
        than they save.
        """
        result = "poison"
        for row in range(ROWS.lanes):
            elements = [self.put(f"extractelement {ROWS.text} {a}, i32 {row}") for a in x]
            arguments = ", ".join(f"{ROWS.element} {a}" for a in elements)
            value = self.put(f"call {FLAGS} {ROWS.element} @{function}({arguments})")
            result = self.put(
                f"insertelement {ROWS.text} {result}, {ROWS.element} {value}, i32 {row}"
            )
        return result

    def power_by_call(self, base: str, exponent: str) -> str:
        return self.call_library("pow", (base, exponent))

    def _element(self, array: str, index: int) -> str:
        return self.put(f"load {ROWS.element}, ptr {self._place(array, index)}, align 8")

    def _place(self, array: str, index: int) -> str:
        return self.put(f"getelementptr inbounds {ROWS.element}, ptr %{array}, i64 {index}")


def lanes_module(
    t: TracedSystem, a: Sequence[Sequence[float]], b: Sequence[float], groups: LaneGroups
) -> tuple[str, int]:
    """One whole step of an explicit Runge-Kutta method, and the outputs, for one plant a lane; how
    long `c` must be.

    step(x, u, c, w, h, y)   as the step of one plant; h is an array too, as each plant has its own
    outputs(x, u, c, o)      what a row of each plant shows
    prepare(p, c)            what both need of the parameters
    """
    printer = Printer(groups)
    point = t.point
    code, precomputed = printer.set_apart(instructions(list(point.values()), [t.f]), POINT)
    step = _Step(t, code, precomputed, groups)
    text = step.printed(a, b)
    printer.add("outputs", point, {"o": t.o})
    module = printer.module()
    parts = vector_math.definitions({**printer.needed, **step.needed}, groups.number)
    return "\n".join([parts, text, module]), printer.held


CACHE = 32_768
"""Bytes of the smallest first-level data cache of processors with such registers."""
SLOPES = "k"
"""The array of the slopes of all stages, of the length stages x states."""
OF_STAGE = (*"xucwh", SLOPES)
OF_END = ("x", "h", SLOPES, "y")


class _Step:
    """The step of all lanes: one stage for one group of lanes after the other, then the next
    stage.

    All stages of one group depend on each other, and have more operations than the processor looks
    ahead; the next group in the same stage is near enough to be computed at the same time. That is
    worth less than data that stay in the cache from stage to stage (both measured, with registers
    of 32 and 64 bytes).
    """

    def __init__(
        self, t: TracedSystem, code: Code, precomputed: dict[Operand, int], groups: LaneGroups
    ) -> None:
        self.groups = groups
        self.states = len(t.x)
        self.inputs = len(t.u)
        self.items = emission.with_gates(code, POINT, precomputed)
        self.outputs = code.outputs
        self.held = precomputed
        self.needed: dict[str, int] = {}

    def printed(self, a: Sequence[Sequence[float]], b: Sequence[float]) -> str:
        """The text of the step and of its stages."""
        texts = []
        parts: dict[str, Sequence[str]] = {}
        for number, row in enumerate([(), *a]):
            name = f"stage{number}"
            texts.append(self._stage(name, row))
            parts[name] = OF_STAGE
        slopes = len(parts) * self.states
        texts.append(self._finish("finish", b))
        parts["finish"] = OF_END
        by_group = self._cached_by_group(slopes)
        arguments = list("xucwhy")
        sequence = self.groups.sequence(
            "step", arguments, parts, {SLOPES: slopes}, by_group=by_group
        )
        return "".join([*texts, sequence])

    def _cached_by_group(self, slopes: int) -> bool:
        """Whether the first-level cache holds what the step reads and writes for one group, but not
        for all.
        """
        read: int = len(set(self.held.values())) + self.states + self.inputs + slopes
        of_group = read * self.groups.width
        return of_group <= CACHE < of_group * self.groups.groups

    def _stage(self, name: str, row: Sequence[float]) -> str:
        """The function of one stage, which computes its slopes."""
        block = self.groups.body()
        values = _Moved(block, row, self.states)
        point: dict[Operand, str] = {}
        for i in range(self.states):
            point["in", 0, i] = values.state(i)
        for i in range(self.inputs):
            point["in", 1, i] = values.input(i)
        at = emission.Emission(block, POINT, self.held, point)
        at.run(self.items)
        first = len(row) * self.states
        for _, i, operand in self.outputs:
            slope = at.value_of(operand)
            block.store(SLOPES, first + i, slope)
        self.needed |= block.needed
        return self.groups.part(name, OF_STAGE, block)

    def _finish(self, name: str, weights: Sequence[float]) -> str:
        """The function that computes the states at the end of the step."""
        block = self.groups.body()
        values = _Moved(block, weights, self.states)
        for i in range(self.states):
            block.store("y", i, values.state(i))
        return self.groups.part(name, OF_END, block)


@dataclasses.dataclass(frozen=True)
class _Moved:
    """States and inputs at a stage, with the weights of the slopes of the stages before it."""

    block: FunctionBody
    weights: Sequence[float]
    states: int

    def state(self, i: int) -> str:
        """x + h (a1 k1 + a2 k2 + ...)."""
        x = self.block.load("x", i)
        total = ""
        for stage, weight in enumerate(self.weights):
            if weight:
                slope = self.block.load(SLOPES, stage * self.states + i)
                total = self._added(total, self._product(self.block.constant(weight), slope))
        return self._added(x, self._product(self.block.load("h", 0), total)) if total else x

    def input(self, i: int) -> str:
        """u + (a1 + a2 + ...) h w."""
        u = self.block.load("u", i)
        node = sum(self.weights)
        if not node:
            return u
        way = self._product(self.block.constant(node), self.block.load("h", 0))
        return self._added(u, self._product(way, self.block.load("w", i)))

    def _added(self, a: str, b: str) -> str:
        return self.block.arithmetic("+", a, b) if a else b

    def _product(self, a: str, b: str) -> str:
        return self.block.arithmetic("*", a, b)

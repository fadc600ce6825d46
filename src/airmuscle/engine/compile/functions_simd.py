"""The functions of a system over vectors: for many plants side by side, and for many rows of one
plant.
"""

from collections.abc import Mapping, Sequence

from .functions import POINT, Extension, Printer, TracedSystem
from .ir import emission
from .ir.instructions import Code, Operand, instructions
from .llvm import emit, vector_math
from .llvm.emit import FLAGS, FunctionBody, LlvmLanguage, LlvmType

AT_ONCE = 64
"""Bytes of one value in the step: the widest register (measured; values of two do not fit the
registers).
"""

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
    import casadi

    count = casadi.Function("outputs", [t.x, t.u, t.p], [t.o]).n_instructions()
    return ROWS.lanes if count <= MAX_OPERATIONS else 1


def row_outputs(t: TracedSystem) -> Extension:
    """The function `row_outputs(x, u, c, o)`: `outputs` at `ROWS` at once, of one plant.

    x, u, o   (W, n), (W, m), (W, k), one row after the other
    """

    def add(printer: Printer) -> None:
        block = _RowsBody({"x": t.x.numel(), "u": t.u.numel(), "o": t.o.numel()})
        for (_, index), value in printer.compute(
            block, instructions([t.x, t.u, t.p], [t.o]), POINT
        ).items():
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
        for row in range(ROWS.lanes):
            element = self.put(f"extractelement {ROWS.text} {value}, i32 {row}")
            place = self._place(array, index + row * self._widths[array])
            self.lines.append(f"  store {ROWS.element} {element}, ptr {place}, align 8")

    def call_library(self, function: str, x: Sequence[str]) -> str:
        """A call of the C library for each row; vectorised functions would take longer to compile
        than they save.
        """
        result = "poison"
        for row in range(ROWS.lanes):
            given = [self.put(f"extractelement {ROWS.text} {a}, i32 {row}") for a in x]
            arguments = ", ".join(f"{ROWS.element} {a}" for a in given)
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
    t: TracedSystem, a: Sequence[Sequence[float]], b: Sequence[float], number: LlvmType
) -> tuple[str, int]:
    """One whole step of an explicit Runge-Kutta method, and the outputs, for one plant a lane; how
    long `c` must be.

    step(x, u, c, w, h, y)   as the step of one plant; h is an array too, as each plant has its own
    outputs(x, u, c, o)      what a row of each plant shows
    prepare(p, c)            what both need of the parameters
    """
    printer = Printer(LlvmLanguage(number))
    point = t.point
    code, held = printer.set_apart(instructions(list(point.values()), [t.f]), POINT)
    step = _Step(t, code, held, number)
    text = step.printed(a, b)
    printer.add("outputs", point, {"o": t.o})
    needed = {(name, number): count for name, count in printer.needed.items()}
    needed |= {(name, step.number): count for name, count in step.block.needed.items()}
    parts = [vector_math.definition(name, count, kind) for (name, kind), count in needed.items()]
    module = [vector_math.declarations({number, step.number}), *parts, text, printer.module()]
    return "\n".join(module), printer.held


class _Step:
    """The step of as many lanes as a register holds, called for one group of lanes after the other.

    All groups run the same code, so that a plant's result does not depend on its lane; while one
    waits for a root or a quotient, the processor is at the next. Every stage reads `c` through an
    argument of its own: LLVM, which cannot know that they are equal, reads what it needs where it
    needs it, instead of keeping all of `c` from the first stage on, for which there are no
    registers.
    """

    def __init__(
        self, t: TracedSystem, code: Code, held: dict[Operand, int], number: LlvmType
    ) -> None:
        self.number = LlvmType(number.bits, min(number.lanes, AT_ONCE * 8 // number.bits))
        self.groups = number.lanes // self.number.lanes
        self.states = t.x.shape[0]
        self.inputs = t.u.shape[0]
        self.items = emission.with_gates(code, POINT, held)
        self.outputs = code.outputs
        self.held = held
        self.block = FunctionBody((), self.number)

    def printed(self, a: Sequence[Sequence[float]], b: Sequence[float]) -> str:
        """The text of the step, and of its stages for one group."""
        slopes: list[list[str]] = []
        for stage, row in enumerate([(), *a]):
            slopes.append(self._rates(stage, row, slopes))
        for i in range(self.states):
            self.block.store("y", i * self.groups, self._moved(i, b, slopes))
        copies = [f"c{stage}" for stage in range(len(slopes))]
        names = ["x", "u", *copies, "w", "h", "y"]
        stages = emit.function("stages", names, self.block, f"{emit.ALIGNED} noinline")
        outer = FunctionBody((), self.number)
        for group in range(self.groups):
            arrays = {
                n: outer.put(f"getelementptr inbounds i8, ptr %{n}, i64 {group * AT_ONCE}")
                for n in "xucwhy"
            }
            given = ", ".join(f"ptr {arrays['c' if name in copies else name]}" for name in names)
            outer.lines.append(f"  call void @stages({given})")
        return stages.replace("define", "define internal", 1) + emit.function(
            "step", list("xucwhy"), outer
        )

    def _rates(
        self, stage: int, row: Sequence[float], slopes: Sequence[Sequence[str]]
    ) -> list[str]:
        """The rates of one stage."""
        given: dict[Operand, str] = {
            ("in", 0, i): self._moved(i, row, slopes) for i in range(self.states)
        }
        node = sum(row)
        combined = self.block.arithmetic
        for i in range(self.inputs):
            u = self._load("u", i)
            if node:  # u + node h w
                way = combined("*", self.block.constant(node), self._load("h", 0))
                u = combined("+", u, combined("*", way, self._load("w", i)))
            given["in", 1, i] = u
        for operand, place in self.held.items():
            given[operand] = self._load(f"c{stage}", place)
        at = emission.Emission(self.block, (), {}, given)
        at.run(self.items)
        by_index = {i: at.value_of(operand) for _, i, operand in self.outputs}
        return [by_index[i] for i in range(self.states)]

    def _load(self, array: str, index: int) -> str:
        return self.block.load(array, index * self.groups)

    def _moved(self, i: int, row: Sequence[float], slopes: Sequence[Sequence[str]]) -> str:
        """x + h (a1 k1 + a2 k2 + ...)."""
        x = self._load("x", i)
        total = ""
        combined = self.block.arithmetic
        for weight, k in zip(row, slopes, strict=True):
            if weight:
                term = combined("*", self.block.constant(weight), k[i])
                total = combined("+", total, term) if total else term
        return combined("+", x, combined("*", self._load("h", 0), total)) if total else x

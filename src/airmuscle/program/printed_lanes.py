"""The functions of a system for many plants side by side: the same instructions over rows of numbers."""

from __future__ import annotations

from collections.abc import Sequence

from . import elementary, llvm
from .instructions import Code, Operand
from .llvm import FLAGS, Block
from .numbers import Number
from .printed import PARAMETERS, Printer, Traced

AT_ONCE = 64
"""Bytes of one value in the step: the widest register. Two of them as one value do not fit the registers."""


def lanes_module(t: Traced, a: Sequence[Sequence[float]], b: Sequence[float], number: Number) -> tuple[str, int]:
    """One whole step of an explicit Runge-Kutta method, and the outputs, for one plant a lane; how long `c` must be.

    step(x, u, c, w, h, y)   as the step of one plant; h is an array too, as each plant has its own
    outputs(x, u, c, o)      what a row of each plant shows
    prepare(p, c)            what both need of the parameters
    """
    printer = Printer(number)
    point = {"x": t.x, "u": t.u, PARAMETERS: t.p}
    code, held = printer.without_parameters(point, {"f": t.f})
    step = _Step(t, code, held, number)
    body, text = step.printed(a, b)
    printer.add("outputs", point, {"o": t.o})
    needed = {(name, number): count for name, count in printer.needed.items()}
    needed |= {(name, step.number): count for name, count in body.needed.items()}
    parts = [elementary.definition(name, count, kind) for (name, kind), count in needed.items()]
    module = [elementary.declarations({number, step.number}), *parts, text, printer.module()]
    return "\n".join(module), printer.held


class _Step:
    """The step, stage after stage, and in every stage group after group of as many lanes as a register holds.

    While one group waits for a root or a quotient, the processor is at the next. Every stage reads `c` through an
    argument of its own: LLVM, which cannot know that they are equal, reads what it needs where it needs it, instead
    of keeping all of `c` from the first stage on, for which there are no registers.
    """

    def __init__(self, t: Traced, code: Code, held: dict[Operand, int], number: Number) -> None:
        self.number = Number(number.bits, min(number.lanes, AT_ONCE * 8 // number.bits))
        self.groups = number.lanes // self.number.lanes
        self.states, self.inputs = t.x.shape[0], t.u.shape[0]
        self.code, self.held = code, held
        self.block = Block((), self.number)

    def printed(self, a: Sequence[Sequence[float]], b: Sequence[float]) -> tuple[Block, str]:
        """The lines, and the text of the step."""
        rows, slopes = [(), *a], [list[list[str]]() for _ in range(self.groups)]
        for stage, row in enumerate(rows):
            for group, known in enumerate(slopes):
                known.append(self._rates(stage, row, group, known))
        for group, known in enumerate(slopes):
            for i in range(self.states):
                self.block.store("y", i * self.groups + group, self._moved(i, b, group, known))
        stages = [f"c{stage}" for stage in range(len(rows))]
        names = ["x", "u", *stages, "w", "h", "y"]
        attributes = "nounwind noinline"
        body = llvm.function("body", names, self.block, attributes).replace("define", "define internal", 1)
        given = ", ".join(f"ptr %{'c' if name in stages else name}" for name in names)
        outer = ", ".join(f"ptr noalias nocapture %{name}" for name in ("x", "u", "c", "w", "h", "y"))
        return self.block, f"{body}define void @step({outer}) nounwind {{\n  call void @body({given})\n  ret void\n}}\n"

    def _rates(self, stage: int, row: Sequence[float], group: int, slopes: Sequence[Sequence[str]]) -> list[str]:
        """The rates of one stage of one group."""
        given: dict[Operand, str] = {("in", 0, i): self._moved(i, row, group, slopes) for i in range(self.states)}
        for i in range(self.inputs):
            given["in", 1, i] = self._input(i, sum(row), group)
        for operand, place in self.held.items():
            given[operand] = self._load(f"c{stage}", place, group)
        values = llvm.run(self.block, self.code.body, (), {}, given)
        found = {i: llvm.value_of(self.block, operand, (), {}, values) for _, i, operand in self.code.outputs}
        return [found[i] for i in range(self.states)]

    def _load(self, array: str, index: int, group: int) -> str:
        return self.block.load(array, index * self.groups + group)

    def _moved(self, i: int, row: Sequence[float], group: int, slopes: Sequence[Sequence[str]]) -> str:
        """x + h (a1 k1 + a2 k2 + ...)."""
        x, total = self._load("x", i, group), ""
        for weight, k in zip(row, slopes, strict=True):
            if weight:
                term = self._combined("fmul", self.block.constant(weight), k[i])
                total = self._combined("fadd", total, term) if total else term
        return self._combined("fadd", x, self._combined("fmul", self._load("h", 0, group), total)) if total else x

    def _input(self, i: int, node: float, group: int) -> str:
        """u + c h w."""
        u = self._load("u", i, group)
        if not node:
            return u
        way = self._combined("fmul", self.block.constant(node), self._load("h", 0, group))
        return self._combined("fadd", u, self._combined("fmul", way, self._load("w", i, group)))

    def _combined(self, operation: str, a: str, b: str) -> str:
        return self.block.put(f"{operation} {FLAGS} {self.number.text} {a}, {b}")

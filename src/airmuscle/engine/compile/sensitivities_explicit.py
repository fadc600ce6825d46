"""A whole step of an explicit method, and its derivatives along columns, as one function."""

from collections.abc import Sequence

from ...core import Node, nodes
from .functions import POINT, Printer
from .ir import emission
from .ir.instructions import Instruction, Operand
from .ir.scheduling import Item
from .ir.sparse_lu import distinct
from .llvm.emit import FunctionBody
from .llvm.exact import LlvmValue, loaded
from .sensitivities import DirectionalDerivative, TangentSystem, Values, ValuesOf, stored


class _Stage:
    """One stage: the rates, then their derivatives, printed instruction by instruction.

    The rates of a stage are one long chain of operations that wait for each other. A processor sees
    some hundred instructions at a time, so that the derivatives of the stage before are mixed in,
    which wait for nothing.
    """

    def __init__(
        self,
        rates: Values,
        along: DirectionalDerivative,
        printer: Printer,
        block: FunctionBody,
        values: dict[Operand, str],
        v: Sequence[LlvmValue],
    ) -> None:
        self.rates = rates
        self.along = along
        self.block = block
        self.v = v
        wanted, slots = distinct([*rates.results, *along.parts])
        code, precomputed = printer.set_apart(rates.code(wanted), POINT)
        self.at = emission.Emission(block, POINT, precomputed, values)
        operands = code.results(0, len(wanted))
        self._operand_of = {
            nodes.identity(node): operands[slot]
            for node, slot in zip([*rates.results, *along.parts], slots, strict=True)
        }
        needed = {self._operand_of[nodes.identity(rate)] for rate in rates.results}
        for line in reversed(code.body):
            if line.result in needed:
                needed.update(line.arguments)
        self.first: list[Item] = []
        self.second: list[Item] = []
        for item in emission.with_gates(code, POINT, precomputed, frozenset(needed)):
            early = (item if isinstance(item, Instruction) else item.body[0]).result in needed
            (self.first if early else self.second).append(item)

    def print_rates(self, before: "_Stage | None") -> None:
        """The rates of this stage, and in between the derivatives of the one before."""
        done = 0
        ahead = 0 if before is None else len(before.second)
        for number, line in enumerate(self.first, 1):
            self.at.run([line])
            if before is not None:
                upto = ahead * number // len(self.first)
                before.at.run(before.second[done:upto])
                done = upto
        if before is not None:
            before.at.run(before.second[done:])

    def _value(self, expression: Node) -> LlvmValue:
        operand = self._operand_of[nodes.identity(expression)]
        return LlvmValue(self.block, self.at.value_of(operand))

    def slopes(self) -> list[LlvmValue]:
        """The rates."""
        return [self._value(expression) for expression in self.rates.results]

    def columns(self, s: Sequence[LlvmValue]) -> list[LlvmValue]:
        """The derivatives of the rates along the columns, from the rows of S."""
        values = {nodes.identity(part): self._value(part) for part in self.along.parts}
        return self.along.rows(ValuesOf(values), s, self.v)


def _after(
    row: Sequence[float],
    begin: Sequence[LlvmValue],
    slopes: Sequence[Sequence[LlvmValue]],
    h: LlvmValue,
) -> list[LlvmValue]:
    """States, or S, after the stages so far, each with its weight."""
    advanced = list(begin)
    for weight, slope in zip(row, slopes, strict=True):
        if weight:
            advanced = [
                value + d * _times(h, weight) for value, d in zip(advanced, slope, strict=True)
            ]
    return advanced


def _times(h: LlvmValue, weight: float) -> LlvmValue:
    return h * LlvmValue(h.block, h.block.constant(weight))


def explicit_module(
    t: TangentSystem, a: Sequence[Sequence[float]], b: Sequence[float]
) -> tuple[str, int]:
    """One whole step, as in `functions.explicit_module`: step(x, u, c, w, h, y), and how long `c`
    must be.
    """
    rates = Values(t, t.inner.f)
    along = rates.along(rates.results)
    printer = Printer()
    block = FunctionBody(["h"])
    h = LlvmValue(block, "%h")
    states = [loaded(block, "x", i) for i in range(t.size)]
    s = t.rows(block, "x")
    slopes: list[list[LlvmValue]] = []
    columns: list[list[LlvmValue]] = []
    rows = [(), *a]
    before = None
    for number, row in enumerate(rows):
        values = {
            ("in", POINT.index("x"), i): x.name
            for i, x in enumerate(_after(row, states, slopes, h))
        }
        for i in range(len(t.inner.u)):
            u = loaded(block, "u", i) + loaded(block, "w", i) * _times(h, sum(row))
            values["in", POINT.index("u"), i] = u.name
        moving = zip(t.input_rows(block), t.input_rows(block, "w"), strict=True)
        stage = _Stage(
            rates, along, printer, block, values, [v + w * _times(h, sum(row)) for v, w in moving]
        )
        stage.print_rates(before)
        slopes.append(stage.slopes())
        if before is not None:
            columns.append(before.columns(_after(rows[number - 1], s, columns, h)))
        before = stage
    stage.at.run(stage.second)
    columns.append(stage.columns(_after(rows[-1], s, columns, h)))
    stored(_after(b, states, slopes, h) + _after(b, s, columns, h), "y")
    printer.end("step", [*POINT, "w", "h"], ["y"], block)
    return printer.module(), printer.held

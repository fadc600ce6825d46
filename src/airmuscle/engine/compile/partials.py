"""Partial derivatives of the rates and outputs of a system by its states and inputs, as a printed function."""

from __future__ import annotations

import dataclasses

from .functions import PARAMETERS, Printer, TracedSystem
from .ir.instructions import Code, finished, recorded
from .ir.jacobian import ZERO, Tape, derivatives

Place = tuple[int, int]
"""Row among the rates followed by the outputs, and column among the states followed by the inputs."""


@dataclasses.dataclass(frozen=True, eq=False)
class Partials:
    """The non-zeros of d(f, o)/d(x, u): instructions for their values, and the places where they stand."""

    code: Code
    places: tuple[Place, ...]

    def extend(self, printer: Printer) -> None:
        """Print `partials(x, u, c, D)`, whose result D has one value for each place."""
        printer.add_code("partials", ["x", "u", PARAMETERS], self.code, ["D"])


def partials(t: TracedSystem) -> Partials:
    """The partial derivatives of a traced system."""
    code = recorded([t.x, t.u, t.p], [t.f, t.o])
    n, m = t.x.numel(), t.u.numel()
    tape, operands = Tape(code.body), {(k, index): operand for k, index, operand in code.outputs}
    results = [operands.get((0, i), ZERO) for i in range(n)] + [operands.get((1, i), ZERO) for i in range(t.o.numel())]
    columns = [("in", 0, j) for j in range(n)] + [("in", 1, j) for j in range(m)]
    rows = derivatives(tape, results, columns)
    values = {(i, j): row[x] for i, row in enumerate(rows) for j, x in enumerate(columns) if x in row}
    outputs = tuple((0, k, operand) for k, operand in enumerate(values.values()))
    return Partials(finished(Code(tuple(tape.body), outputs)), tuple(values))

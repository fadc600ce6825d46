"""Event indicators: functions of states and inputs that change sign where the rates of a system are not smooth.

The rates are continuous there, but their slopes are not, for instance where a stop is touched, a flow chokes or
reverses, or a friction element begins to slip. An integrator of variable order restarts at these places.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from ...core.arrays import Array
from .functions import PARAMETERS, Printer, TracedSystem
from .ir import emission
from .ir.instructions import Code, Instruction, Operand, Operation, finished, recorded
from .ir.interpreter import InterpretedBody

ARGUMENTS = ["x", "u", PARAMETERS]
_COMPARISONS = frozenset({
    Operation.LESS, Operation.LESS_EQUAL, Operation.FMIN, Operation.FMAX, Operation.MINIMUM, Operation.MAXIMUM,
})  # fmt: skip
_OF_ZERO = frozenset({Operation.ABS, Operation.SIGN})


@dataclasses.dataclass(frozen=True, eq=False)
class EventIndicators:
    """The instructions that compute `count` event indicators: differences of values that the rates compare."""

    code: Code
    count: int

    def extend(self, printer: Printer) -> None:
        """Print `indicators(x, u, c, z)`, whose result z has one value for each."""
        printer.add_code("indicators", ARGUMENTS, self.code, ["z"])

    def values(self, x: Array, u: Array, p: Array) -> list[float]:
        """The event indicators at a state under inputs, by interpretation of the instructions."""
        block = InterpretedBody(dict(zip(ARGUMENTS, (x.tolist(), u.tolist(), p.tolist()), strict=True)))
        for (_, index), value in emission.computed(block, self.code, ARGUMENTS, {}, {}).items():
            block.store("z", index, value)
        return [block.stored["z", i] for i in range(self.count)]

    def scales(self, x: Array, u: Array, p: Array, sizes: Array) -> list[float]:
        """The magnitude of each indicator: its largest change if one state changes by its nominal size, else 1."""
        at = self.values(x, u, p)
        greatest = [0.0] * self.count
        for i, size in enumerate(sizes):
            moved = self.values(x + size * (np.arange(x.size) == i), u, p)
            changes = [abs(b - a) for a, b in zip(at, moved, strict=True)]
            greatest = [max(g, c) if math.isfinite(c) else g for g, c in zip(greatest, changes, strict=True)]
        return [value or 1.0 for value in greatest]


def event_indicators(t: TracedSystem) -> EventIndicators:
    """The event indicators of a traced system: one for each pair of values that its rates compare.

    A pair that depends on parameters only never changes its order, and has none.
    """
    code = finished(recorded([t.x, t.u, t.p], [t.f]))
    varying: set[Operand] = set()
    body = list(code.body)
    pairs: dict[frozenset[Operand], tuple[Operand, Operand]] = {}
    for line in code.body:
        if any(a in varying or (a[0] == "in" and a[1] < 2) for a in line.arguments):
            varying.add(line.result)
            if line.operation in _COMPARISONS:
                pairs.setdefault(frozenset(line.arguments), (line.arguments[0], line.arguments[1]))
            elif line.operation in _OF_ZERO:
                pairs.setdefault(frozenset({line.arguments[0], ("c", 0.0)}), (line.arguments[0], ("c", 0.0)))
    body += [Instruction(Operation.SUBTRACT, ("t", "z", i), pair) for i, pair in enumerate(pairs.values())]
    outputs = tuple((0, i, ("t", "z", i)) for i in range(len(pairs)))
    return EventIndicators(finished(Code(tuple(body), outputs)), len(pairs))

"""Expressions as compiled functions of arrays, rates with disturbances, partial derivatives, and
event indicators.
"""

import dataclasses
import functools
import math
from collections.abc import Mapping, Sequence

import numpy as np

from ...core import Array, Node, Operation, Recorded, nodes, slopes
from .cache.kernel import evaluate
from .functions import PARAMETERS, POINT, Printer, TracedSystem
from .ir import emission, jacobian
from .ir.instructions import (
    ZERO,
    Code,
    Instruction,
    Operand,
    finished,
    instructions,
)
from .ir.interpreter import InterpretedBody
from .llvm import vector_math
from .llvm.emit import LlvmType
from .llvm.groups import LaneGroups
from .llvm.processor import processor
from .program import CompiledSystem, Module, Program

LANES = 8
"""Points of one call of a function in lanes: the widest register (chosen)."""


class Function:
    """Recorded expressions of vectors, compiled: `address` is that of a function of the inputs' and
    outputs' arrays.

    With `lanes` above 1 the function computes so many points at
    once: each element of an input or output is a row of so many numbers, in arrays that are aligned
    as vectors must be (`aligned_array`). The machine code lives as long as this object.
    """

    def __init__(
        self,
        inputs: Mapping[str, Sequence[Node]],
        outputs: Mapping[str, Sequence[Node]],
        lanes: int = 1,
    ) -> None:
        if lanes == 1:
            printer = Printer()
            printer.add("function", inputs, outputs)
            text = printer.module()
        else:
            groups = LaneGroups(LlvmType(lanes=lanes), processor().register)
            printer = Printer(groups)
            printer.add("function", inputs, outputs)
            module = printer.module()
            text = vector_math.definitions(printer.needed, groups.number) + module
        self._module = Module(text)
        self.address = self._module.address("function")


@dataclasses.dataclass(frozen=True, eq=False)
class AugmentedRates:
    """Compiled functions of z = (x, theta, d): states (n,), parameters that are estimated, and
    disturbances of rates.

    rates(z, u, c, f, A)      f (n,) rates with f_i + d_i where there is a disturbance, A = df/dz
                              (n, N)
    measured(z, u, c, y, C)   measured columns (p,) and dy/dz (p, N)
    outputs(z, u, c, o)       all outputs (k,)

    `constants` is the array c. Parameters and disturbances have no rates: they are constant but for
    noise.
    """

    module: Module
    constants: Array
    rates: int
    measured: int
    outputs: int


def augmented_rates(
    ready: CompiledSystem,
    measured: Sequence[int],
    parameters: Sequence[int],
    disturbed: Sequence[int],
) -> AugmentedRates:
    """The functions of a system; `measured` are columns among states and outputs, `parameters`
    indices of leaves and `disturbed` indices of states."""
    t = ready.program.traced
    n = len(t.x)
    z = nodes.symbols("z", n + len(parameters) + len(disturbed))
    values = list(t.p)
    for k, index in enumerate(parameters, n):
        values[index] = z[k]
    replaced = nodes.replaced([*t.f, *t.o], [*t.x, *t.p], [*z[:n], *values])
    f = replaced[:n]
    o = replaced[n:]
    for k, index in enumerate(disturbed, n + len(parameters)):
        f[index] = f[index] + z[k]
    columns = [*z[:n], *o]
    y = [columns[i] for i in measured]
    printer = Printer()
    point = {"z": z, "u": t.u, PARAMETERS: t.p}
    printer.add("rates", point, {"f": f, "A": slopes.by_row(slopes.jacobian(f, z))})
    printer.add("measured", point, {"y": y, "C": slopes.by_row(slopes.jacobian(y, z))})
    printer.add("outputs", point, {"o": o})
    module = Module(printer.module(), printer.held)
    addresses = map(module.address, ("rates", "measured", "outputs"))
    return AugmentedRates(module, module.prepare(ready.parameters), *addresses)


def states_and_outputs(
    functions: AugmentedRates, count: int, states: Array, inputs: Array, outputs: int
) -> Array:
    """States and outputs (M, n + k) at augmented states (M, N) under inputs (M, m); `count` is n,
    `outputs` is k.
    """
    values = np.empty((len(states), outputs))
    evaluate(
        function=functions.outputs,
        c=functions.constants,
        states=np.ascontiguousarray(states),
        inputs=np.ascontiguousarray(inputs),
        results=values,
    )
    return np.hstack([states[:, :count], values])


@dataclasses.dataclass(frozen=True, eq=False)
class Derivatives:
    """Rates f (n,) and outputs o (k,), and their slopes by state x and input u."""

    rates: Array
    outputs: Array
    rates_by_state: Array
    rates_by_input: Array
    outputs_by_state: Array
    outputs_by_input: Array


def derivatives(
    ready: CompiledSystem, state: Sequence[float], inputs: Sequence[float]
) -> Derivatives:
    """The derivatives at a state vector (n,) under inputs (m,). At a kink they are those of one of
    its sides.
    """
    t = ready.program.traced
    rates, outputs, *tables = _function(ready.program).at_numbers(
        np.asarray(state, dtype=float).tolist(),
        np.asarray(inputs, dtype=float).tolist(),
        ready.parameters.tolist(),
    )
    shapes = [(len(values), len(by)) for values in (t.f, t.o) for by in (t.x, t.u)]
    slopes_of = [
        np.array(table, dtype=float).reshape(shape)
        for table, shape in zip(tables, shapes, strict=True)
    ]
    return Derivatives(np.array(rates, dtype=float), np.array(outputs, dtype=float), *slopes_of)


@functools.cache
def _function(program: Program) -> Recorded:
    """(x, u, p) -> (f, o, df/dx, df/du, do/dx, do/du), differentiated once for a structure."""
    t = program.traced
    tables = [
        slopes.by_row(slopes.jacobian(values, by)) for values in (t.f, t.o) for by in (t.x, t.u)
    ]
    return Recorded([t.x, t.u, t.p], [t.f, t.o, *tables])


Place = tuple[int, int]
"""Row among the rates followed by the outputs, and column among the states followed by the
inputs.
"""


@dataclasses.dataclass(frozen=True, eq=False)
class Partials:
    """The non-zeros of d(f, o)/d(x, u): instructions for their values, and the places where they
    stand.
    """

    code: Code
    places: tuple[Place, ...]

    def extend(self, printer: Printer) -> None:
        """Print `partials(x, u, c, D)`, whose result D has one value for each place."""
        printer.add_code("partials", POINT, self.code, ["D"])


def partials(t: TracedSystem) -> Partials:
    """The partial derivatives of a traced system."""
    values = jacobian.nonzeros([*t.f, *t.o], [*t.x, *t.u])
    code = instructions(list(t.point.values()), [list(values.values())])
    return Partials(code, tuple(values))


_COMPARISONS = frozenset(
    {
        Operation.LESS,
        Operation.LESS_EQUAL,
        Operation.FMIN,
        Operation.FMAX,
        Operation.MINIMUM,
        Operation.MAXIMUM,
    }
)
_OF_ZERO = frozenset({Operation.ABS, Operation.SIGN})


@dataclasses.dataclass(frozen=True, eq=False)
class EventIndicators:
    """The instructions that compute `count` event indicators: differences of values that the rates
    compare.

    They change sign where the rates are continuous but their slopes are not, for instance where a
    stop is touched, a flow chokes or reverses, or a friction element begins to slip. An integrator
    of variable order restarts there.
    """

    code: Code
    count: int

    def extend(self, printer: Printer) -> None:
        """Print `indicators(x, u, c, z)`, whose result z has one value for each."""
        printer.add_code("indicators", POINT, self.code, ["z"])

    def values(self, x: Array, u: Array, p: Array) -> list[float]:
        """The event indicators at a state under inputs, by interpretation of the instructions."""
        point = [x.tolist(), u.tolist(), p.tolist()]
        arrays = dict(zip(POINT, point, strict=True))
        block = InterpretedBody(arrays)
        results = emission.computed(block, self.code, POINT)
        for (_, index), value in results.items():
            block.store("z", index, value)
        return [block.stored["z", i] for i in range(self.count)]

    def scales(self, x: Array, u: Array, p: Array, sizes: Array) -> list[float]:
        """The magnitude of each indicator: its largest change if one state changes by its nominal
        size, else 1.
        """
        at = self.values(x, u, p)
        greatest = [0.0] * self.count
        for i, size in enumerate(sizes):
            moved = self.values(x + size * (np.arange(x.size) == i), u, p)
            changes = [abs(b - a) for a, b in zip(at, moved, strict=True)]
            greatest = [
                max(g, c) if math.isfinite(c) else g for g, c in zip(greatest, changes, strict=True)
            ]
        return [value or 1.0 for value in greatest]


def event_indicators(t: TracedSystem) -> EventIndicators:
    """The event indicators of a traced system: one for each pair of values that its rates compare.

    A pair that depends on parameters only never changes its order, and has none.
    """
    code = instructions(list(t.point.values()), [t.f])
    varying: set[Operand] = set()
    body = list(code.body)
    pairs: dict[frozenset[Operand], tuple[Operand, Operand]] = {}
    for line in code.body:
        if any(a in varying or (a[0] == "in" and a[1] < 2) for a in line.arguments):
            varying.add(line.result)
            if line.operation in _COMPARISONS:
                pairs.setdefault(frozenset(line.arguments), (line.arguments[0], line.arguments[1]))
            elif line.operation in _OF_ZERO:
                pairs.setdefault(frozenset({line.arguments[0], ZERO}), (line.arguments[0], ZERO))
    body += [
        Instruction(Operation.SUBTRACT, ("t", "z", i), pair)
        for i, pair in enumerate(pairs.values())
    ]
    outputs = tuple((0, i, ("t", "z", i)) for i in range(len(pairs)))
    return EventIndicators(finished(Code(tuple(body), outputs)), len(pairs))

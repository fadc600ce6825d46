"""A system with the derivatives of its states along columns, and the functions of an implicit step
of both.

The state is x (n,) followed by S = dx/dtheta (n, K), row by row. All columns share the rates, their
Jacobian J and the LU factors of d I - J; what differs from column to column is one vector
operation. A Rosenbrock step also needs dJ = (dJ/dx) S + dJ/dtheta: without it the derivatives
converge with order one. Inputs that depend on the columns have derivatives V = du/dtheta, further
inputs (M, K), row by row; all of the above then has a term of V too.
"""

import dataclasses
import functools
import operator
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from ...core import Node, SensitivitySystem, nodes, slopes
from .functions import POINT, ArraySizes, Printer, TracedSystem, trace_system
from .ir.instructions import Code, instructions
from .ir.jacobian import nonzeros
from .ir.sparse_lu import Factors, distinct
from .llvm.emit import FunctionBody
from .llvm.exact import LlvmValue, loaded, packed


@dataclasses.dataclass(frozen=True)
class TangentSystem:
    """A traced system, and for every column the places in its parameters that move together; none
    moves nothing.
    """

    inner: TracedSystem
    groups: tuple[tuple[int, ...], ...]
    output_names: tuple[str, ...]
    inputs: tuple[int, ...] = ()

    @property
    def size(self) -> int:
        """How many states the system has without their derivatives."""
        return len(self.inner.x)

    @property
    def lanes(self) -> int:
        """How many columns there are."""
        return len(self.groups)

    def rows(self, block: FunctionBody, array: str) -> list[LlvmValue]:
        """The rows of S, which follow the states in an array."""
        return [
            loaded(block, array, self.size + i * self.lanes, self.lanes) for i in range(self.size)
        ]

    def input_rows(self, block: FunctionBody, array: str = "u") -> list[LlvmValue]:
        """The rows of V, which follow the inputs in an array, or those of its slope in time."""
        first = len(self.inner.u)
        return [
            loaded(block, array, first + j * self.lanes, self.lanes)
            for j in range(len(self.inputs))
        ]


def tangent_system(system: SensitivitySystem) -> TangentSystem:
    """The traced inner system of a differentiated one, with the observed quantities as its
    outputs.
    """
    inner = trace_system(system.inner)
    names = [s.name for s in system.inner.states]
    quantities = dict(zip(names, inner.x, strict=True))
    quantities |= zip(inner.output_names, inner.o, strict=True)
    traced = dataclasses.replace(inner, o=[quantities[name] for name in system.observed_names])
    return TangentSystem(
        traced, system.parameter_indices, system.output_names, system.input_indices
    )


class Values:
    """Expressions of a point, and how they change along every column:
    dv = (dv/dx) S + (dv/du) V + dv/dtheta."""

    def __init__(
        self, t: TangentSystem, results: Sequence[Node], further: Sequence[Sequence[Node]] = ()
    ) -> None:
        self.t = t
        self.results = list(results)
        self._arguments = [*t.inner.point.values(), *further]

    def along(self, results: Sequence[Node]) -> "DirectionalDerivative":
        """The derivatives of some expressions."""
        inner = self.t.inner
        inputs = [inner.u[i] for i in self.t.inputs]
        places = list(dict.fromkeys(place for group in self.t.groups for place in group))
        leaves = [inner.p[place] for place in places]
        rows: list[dict[int, Node]] = [{} for _ in results]
        for (row, column), slope in nonzeros(results, [*inner.x, *inputs, *leaves]).items():
            rows[row][column] = slope
        first_input = self.t.size
        first_leaf = first_input + len(inputs)
        changes = []
        for row_of in rows:
            by_leaf = {
                place: row_of.get(first_leaf + k, nodes.ZERO) for k, place in enumerate(places)
            }
            columns = {}
            for k, group in enumerate(self.t.groups):
                total = nodes.ZERO
                for place in group:
                    total = slopes.plus(total, by_leaf[place])
                if not slopes.is_zero(total):
                    columns[k] = total
            by_state = {j: s for j, s in sorted(row_of.items()) if j < first_input}
            by_input = {
                j - first_input: s
                for j, s in sorted(row_of.items())
                if first_input <= j < first_leaf
            }
            changes.append(Change(by_state, by_input, columns))
        return DirectionalDerivative(tuple(changes))

    def code(self, wanted: Sequence[Node]) -> Code:
        """The instructions of some expressions."""
        return instructions(self._arguments, [wanted])

    def compute(
        self,
        printer: Printer,
        block: FunctionBody,
        wanted: Sequence[Node],
        names: Sequence[str] = POINT,
    ) -> "ValuesOf":
        """Append the instructions that some expressions need to a function; their values."""
        merged, slots = distinct(wanted)
        results = printer.compute(block, self.code(merged), names)
        values = [LlvmValue(block, results[0, i]) for i in range(len(merged))]
        return ValuesOf(
            {nodes.identity(node): values[slot] for node, slot in zip(wanted, slots, strict=True)}
        )


class ValuesOf:
    """The values of expressions in a function under construction."""

    def __init__(self, values: Mapping[Any, LlvmValue]) -> None:
        self._values = values

    def __getitem__(self, expression: Node) -> LlvmValue:
        return self._values[nodes.identity(expression)]


class Change(NamedTuple):
    """The non-zero derivatives of an expression, by state, by input with derivatives, and by
    column.
    """

    states: dict[int, Node]
    inputs: dict[int, Node]
    columns: dict[int, Node]


@dataclasses.dataclass(frozen=True)
class DirectionalDerivative:
    """The changes of some expressions."""

    changes: tuple[Change, ...]

    @property
    def parts(self) -> list[Node]:
        """All derivatives: those by states, then those by inputs, then those by columns."""
        return [
            part
            for kind in zip(*self.changes, strict=True)
            for row in kind
            for part in row.values()
        ]

    def rows(
        self, values: ValuesOf, s: Sequence[LlvmValue], v: Sequence[LlvmValue]
    ) -> list[LlvmValue]:
        """The change of each expression, a column, from the values of the parts and the rows of S
        and V.
        """
        rows_along = []
        for states, inputs, columns in self.changes:
            direct = {k: values[part].name for k, part in columns.items()}
            row = packed(s[0].block, direct, s[0].lanes)
            for j, part in states.items():
                row = row + s[j] * values[part]
            for j, part in inputs.items():
                row = row + v[j] * values[part]
            rows_along.append(row)
        return rows_along


def stored(values: Sequence[LlvmValue], array: str) -> None:
    """Write values and columns one after the other."""
    index = 0
    for value in values:
        value.store(array, index)
        index += max(value.lanes, 1)


def implicit_module(t: TangentSystem) -> tuple[str, ArraySizes]:
    """The functions of `functions.system_module` for the states and their derivatives.

    J holds the distinct non-zeros of the inner df/dx, then dJ of those that change, K numbers each;
    A the factors of the inner d I - J, then the same dJ, because `solve` and `stage` need it: (d I
    - J) dk = db + dJ k.
    """
    inner = t.inner
    # calls would return all derivatives as values: 1.05 to 1.08 of the time, no less to compile
    printer = Printer(least_count=None)
    step = _Step(t)
    step.print_rates(printer)
    step.print_factor(printer)
    step.print_solve(printer)
    step.print_stage(printer)
    df_dt = slopes.tangents(inner.f, inner.u, inner.w)
    _print_along(
        printer,
        "df_dt",
        Values(t, df_dt, [inner.w]),
        [*POINT, "w"],
        "f",
        moving=step.rates,
    )
    outputs = Values(t, inner.o)
    slope = Values(t, slopes.tangents(inner.o, inner.x, inner.f))
    _print_along(printer, "outputs", outputs, POINT, "o", slope)
    further = len(step.moving) * t.lanes
    count = len(inner.o)
    return printer.module(), ArraySizes(
        states=t.size * (1 + t.lanes),
        inputs=len(inner.u) + len(t.inputs) * t.lanes,
        parameters=len(inner.p) + t.lanes,  # a scale for each column comes last
        held=printer.held,
        jacobian=len(step.jacobian) + further,
        factors=len(step.lu.values) + further,
        outputs=count * (2 + t.lanes),
    )


def _print_along(
    printer: Printer,
    name: str,
    values: Values,
    arguments: Sequence[str],
    target: str,
    last: Values | None = None,
    moving: Values | None = None,
) -> None:
    """A function that writes values, their derivatives along columns plus those of `moving` by W,
    and final values.
    """
    t = values.t
    block = FunctionBody()
    along = values.along(values.results)
    computed = values.compute(printer, block, [*values.results, *along.parts], arguments)
    columns = along.rows(computed, t.rows(block, "x"), t.input_rows(block))
    if moving is not None and t.inputs:
        further = moving.along(moving.results)
        parts = moving.compute(
            printer,
            block,
            [p for change in further.changes for p in change.inputs.values()],
            arguments,
        )
        w = t.input_rows(block, "w")
        for i, change in enumerate(further.changes):
            if change.inputs:
                moved = functools.reduce(
                    operator.add, (w[j] * parts[part] for j, part in change.inputs.items())
                )
                columns[i] = columns[i] + moved
    rows = [computed[v] for v in values.results] + columns
    if last is not None:
        final = last.compute(printer, block, last.results)
        rows += [final[v] for v in last.results]
    stored(rows, target)
    printer.end(name, arguments, [target], block)


class _Step:
    """Common data of the functions of a Rosenbrock step."""

    def __init__(self, t: TangentSystem) -> None:
        self.t, self.rates = t, Values(t, t.inner.f)
        self.slopes = self.rates.along(self.rates.results)
        places = [
            ((i, j), part)
            for i, row in enumerate(self.slopes.changes)
            for j, part in row.states.items()
        ]
        self.places = tuple(place for place, _ in places)
        self.jacobian, self.slots = distinct([part for _, part in places])
        self.bends = self.rates.along(self.jacobian)
        self.moving = [q for q, change in enumerate(self.bends.changes) if any(change)]
        """Which of the distinct non-zeros of J change along a column."""
        self.lu = Factors(self.places, self.slots, t.size)

    def _bends(self, block: FunctionBody, array: str, first: int) -> dict[int, LlvmValue]:
        """dJ by number of the distinct non-zero, from an array where they stand from `first` on."""
        lanes = self.t.lanes
        return {
            q: loaded(block, array, first + m * lanes, lanes) for m, q in enumerate(self.moving)
        }

    def print_rates(self, printer: Printer) -> None:
        """rhs(x, u, c, f) and jac(x, u, c, f, J)."""
        block = FunctionBody()
        s = self.slopes
        t = self.t
        rates = self.rates.compute(printer, block, [*self.rates.results, *s.parts])
        columns = s.rows(rates, t.rows(block, "x"), t.input_rows(block))
        stored([rates[f] for f in self.rates.results] + columns, "f")
        printer.end("rhs", POINT, ["f"], block)
        block = FunctionBody()
        wanted = [*self.rates.results, *s.parts, *self.bends.parts]
        computed = self.rates.compute(printer, block, wanted)
        rows = t.rows(block, "x")
        v = t.input_rows(block)
        stored([computed[f] for f in self.rates.results] + s.rows(computed, rows, v), "f")
        bends = self.bends.rows(computed, rows, v)
        stored([computed[part] for part in self.jacobian] + [bends[q] for q in self.moving], "J")
        printer.end("jac", POINT, ["f", "J"], block)

    def print_factor(self, printer: Printer) -> None:
        """factor(J, d, A)."""
        code = instructions([self.lu.j, [self.lu.d]], [self.lu.values])
        block = FunctionBody(["d"])
        computed = printer.compute(block, code, ["J", "d"])
        bends = self._bends(block, "J", len(self.jacobian))
        stored(
            [LlvmValue(block, computed[0, i]) for i in range(len(self.lu.values))]
            + list(bends.values()),
            "A",
        )
        printer.end("factor", ["J", "d"], ["A"], block)

    def print_solve(self, printer: Printer) -> None:
        """solve(A, b, y)."""
        block = FunctionBody()
        right = [loaded(block, "b", i) for i in range(self.t.size)]
        stored(self._solved(block, right, self.t.rows(block, "b")), "y")
        printer.end("solve", ["A", "b"], ["y"], block)

    def print_stage(self, printer: Printer) -> None:
        """stage(x, u, c, A, g, k)."""
        t = self.t
        block = FunctionBody()
        computed = self.rates.compute(printer, block, [*self.rates.results, *self.slopes.parts])
        right = [computed[f] + loaded(block, "g", i) for i, f in enumerate(self.rates.results)]
        slopes = self.slopes.rows(computed, t.rows(block, "x"), t.input_rows(block))
        columns = [d + more for d, more in zip(slopes, t.rows(block, "g"), strict=True)]
        stored(self._solved(block, right, columns), "k")
        printer.end("stage", [*POINT, "A", "g"], ["k"], block)

    def _solved(
        self, block: FunctionBody, right: list[LlvmValue], columns: list[LlvmValue]
    ) -> list[LlvmValue]:
        """k = (d I - J)^-1 right, then (d I - J)^-1 (columns + dJ k), with the factors and dJ that
        stand in A.
        """
        count = len(self.lu.values)
        factors = [loaded(block, "A", q) for q in range(count)]
        k = self.lu.solved(factors, right)
        bends = self._bends(block, "A", count)
        for (i, j), slot in zip(self.places, self.slots, strict=True):
            if slot in bends:
                columns[i] = columns[i] + bends[slot] * k[j]
        return k + self.lu.solved(factors, columns)

"""Functions that a system is printed as, in LLVM text or any other target language."""

import copy
import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ...core import Node, System, TraceError, autodiff, nodes, slopes
from .ir import emission
from .ir.emission import FunctionBlock, TargetLanguage
from .ir.instructions import Code, Operand, hoisted, instructions
from .ir.jacobian import nonzeros
from .ir.scheduling import Item
from .ir.sparse_lu import Factors, distinct
from .llvm.emit import LlvmLanguage
from .text.body import NO_LABEL

LLVM = LlvmLanguage()
PARAMETERS = "p"
"""The argument of a traced function that holds parameters; it is replaced by what `prepare` left in
`c`.
"""
POINT = ("x", "u", PARAMETERS)
"""The arguments that rates and outputs depend on."""


@dataclasses.dataclass(frozen=True)
class TracedSystem:
    """A system as recorded expressions: states x, inputs u, their slopes w, parameters p, rates f,
    outputs o.
    """

    x: list[Node]
    u: list[Node]
    w: list[Node]
    p: list[Node]
    f: list[Node]
    o: list[Node]
    output_names: tuple[str, ...]

    @property
    def point(self) -> dict[str, list[Node]]:
        """What rates and outputs depend on, by the names of the arguments."""
        return dict(zip(POINT, (self.x, self.u, self.p), strict=True))


def trace_system(system: System) -> TracedSystem:
    """Call a system once with symbols; raises TraceError where that does not give finite
    expressions.
    """
    names = [s.name for s in system.states]
    x = nodes.symbols("x", len(names))
    u = nodes.symbols("u", len(system.inputs))
    w = nodes.symbols("w", len(system.inputs))
    with nodes.recording():
        model, p = autodiff.symbolic(system)
        state = dict(zip(names, x, strict=True))
        inputs = dict(zip(system.inputs, u, strict=True))
        rates, outputs = model.rates_and_outputs(state, inputs)
        if set(rates) != set(names):
            raise TraceError(
                f"{type(system).__name__}: states are {names}, but rates are given for"
                f" {list(rates)}."
            )
        f = [nodes.as_node(rates[name]) for name in names]
        o = nodes.as_nodes(list(outputs.values()))
    autodiff.check_finite([*f, *o], type(system).__name__)
    return TracedSystem(x, u, w, p, f, o, tuple(outputs))


@dataclasses.dataclass(frozen=True)
class ArraySizes:
    """Lengths of the arrays that the printed functions read and write."""

    states: int
    inputs: int
    parameters: int
    held: int
    jacobian: int
    factors: int
    outputs: int


class Printer:
    """Collects functions; what each needs of the parameters alone is gathered into one `prepare(p,
    c)`.

    The text is in LLVM unless another language is given.
    """

    def __init__(self, language: TargetLanguage = LLVM) -> None:
        self.text: list[str] = []
        self.needed: dict[str, int] = {}
        self._language = language
        self._prepare = language.body()
        self._places: dict[str, int] = {}
        self.quantities: tuple[Mapping[str, list[Node]], list[Node]] | None = None
        """Arguments and values of the quantities of the array "o", which have names in functions of
        these arguments.
        """

    @property
    def held(self) -> int:
        """How long `c` must be."""
        return len(self._places)

    def add(
        self,
        name: str,
        inputs: Mapping[str, Sequence[Node]],
        outputs: Mapping[str, Sequence[Node]],
        scalars: Sequence[str] = (),
    ) -> None:
        """Print `name(inputs..., outputs...)`, with `c` in place of the parameters."""
        code = instructions(list(inputs.values()), list(outputs.values()))
        self.add_code(name, list(inputs), code, list(outputs), scalars)

    def add_code(
        self,
        name: str,
        inputs: Sequence[str],
        code: Code,
        outputs: Sequence[str],
        scalars: Sequence[str] = (),
    ) -> None:
        """The same of instructions."""
        block = self._language.body(scalars)
        for (output, index), value in self.compute(block, code, inputs).items():
            block.store(outputs[output], index, value)
        self.end(name, inputs, outputs, block)

    def compute(
        self, block: FunctionBlock, code: Code, names: Sequence[str]
    ) -> dict[tuple[int, int], str]:
        """Append code to a function with arguments `names`; the names of its results, which are not
        stored, by output and index."""
        code, precomputed = self.set_apart(code, names)
        return emission.computed(block, code, names, precomputed)

    def end(
        self, name: str, inputs: Sequence[str], outputs: Sequence[str], block: FunctionBlock
    ) -> None:
        """Close a function; the argument that holds parameters becomes `c`."""
        inputs = list(map(self._argument, inputs))
        if self._language.labels:
            self._name(block, inputs, outputs)
        self.text.append(self._language.function(name, inputs, outputs, block))
        self.needed |= {**block.needed, **self._prepare.needed}

    def _name(self, block: Any, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """Give the values of a function the names of the quantities that they are."""
        labels = self._language.labels
        parameters = self._prepare.loaded  # type: ignore[attr-defined]
        named: dict[str, tuple[str, int]] = {}
        if self.quantities and set(map(self._argument, self.quantities[0])) <= set(inputs):
            # a trial prints the quantities, too: those that have values already have their names
            trial = copy.copy(block)
            trial.lines = []
            trial.known = dict(block.known)
            trial.read = set()
            trial.loaded = {}
            code, precomputed, items = self._quantity_code
            values = emission.Emission(trial, list(self.quantities[0]), precomputed, {})
            values.run(items)
            computed = set(block.known.values())
            for _, index, operand in code.outputs:
                value = values.value_of(operand)
                if value in computed:
                    named[value] = ("o", index)
        of_c = []
        for value in self._places:
            label = NO_LABEL
            if value in parameters:
                _, index = parameters[value]
                label = labels[PARAMETERS][index]
            of_c.append(label)
        block.name_values({**labels, "c": of_c}, named, {*inputs, *outputs})

    @functools.cached_property
    def _quantity_code(self) -> tuple[Code, dict[Operand, int], list[Item]]:
        """Code of the quantities, which is the same in all functions: where `c` holds operands, its
        instructions.
        """
        arguments, values = self.quantities  # type: ignore[misc]
        code, precomputed = self.set_apart(
            instructions(list(arguments.values()), [values]), list(arguments)
        )
        return code, precomputed, emission.with_gates(code, list(arguments), precomputed)

    @staticmethod
    def _argument(name: str) -> str:
        return "c" if name == PARAMETERS else name

    def set_apart(self, code: Code, names: Sequence[str]) -> tuple[Code, dict[Operand, int]]:
        """Code less what depends on parameters alone, which goes to `prepare`, and where in `c`
        that stands.
        """
        if PARAMETERS not in names:
            return code, {}
        code, once, constants = hoisted(code, names.index(PARAMETERS))
        prepared = emission.Emission(self._prepare, names, {}, {})
        precomputed = {}
        prepared.run(once)
        for operand in constants:
            value = prepared.value_of(operand)
            if value not in self._places:  # functions share equal values
                self._places[value] = len(self._places)
                self._prepare.store("c", self._places[value], value)
            precomputed[operand] = self._places[value]
        return code, precomputed

    def module(self) -> str:
        """`prepare` and all functions, as one text."""
        if self._language.labels:
            self._prepare.name_values(self._language.labels, {}, {PARAMETERS, "c"})  # type: ignore[attr-defined]
        return "\n".join(
            [self._language.preparation("prepare", [PARAMETERS], ["c"], self._prepare), *self.text]
        )


Extension = Callable[[Printer], None]
"""What adds further functions to a module; they share its `prepare`."""


def system_module(
    t: TracedSystem,
    language: TargetLanguage = LLVM,
    extend: Extension | None = None,
    *,
    implicit: bool = True,
) -> tuple[str, ArraySizes]:
    """The functions of a system: rhs and outputs, and what an implicit method needs unless the
    caller has another.

    rhs(x, u, c, f)              f = rates
    jac(x, u, c, f, J)           rates, and the non-zeros of df/dx, equal ones once
    factor(J, d, A)              LU of d I - J
    solve(A, b, y)               y = (d I - J)^-1 b
    stage(x, u, c, A, g, k)      k = (d I - J)^-1 (f(x, u) + g)
    df_dt(x, u, c, w, f)         (df/du) w, the rates' own slope in time while inputs move at w
    outputs(x, u, c, o)
    """
    printer = Printer(language)
    printer.quantities = t.point, t.o
    printer.add("rhs", t.point, {"f": t.f})
    jacobian, factors = _add_implicit(printer, t) if implicit else (0, 0)
    printer.add("outputs", t.point, {"o": t.o})
    if extend is not None:
        extend(printer)
    sizes = len(t.x), len(t.u), len(t.p), printer.held, jacobian, factors, len(t.o)
    return printer.module(), ArraySizes(*sizes)


def _add_implicit(printer: Printer, t: TracedSystem) -> tuple[int, int]:
    """Print jac to df_dt; how many numbers J and A have."""
    size = len(t.x)
    by_state = nonzeros(t.f, t.x)
    values, slots = distinct(list(by_state.values()))
    lu = Factors(tuple(by_state), slots, size)
    a = nodes.symbols("A", len(lu.values))
    g = nodes.symbols("g", size)
    b = nodes.symbols("b", size)
    right = [rate + further for rate, further in zip(t.f, g, strict=True)]
    stage = lu.solved(a, right)
    printer.add("jac", t.point, {"f": t.f, "J": values})
    matrix = {"J": lu.j, "d": [lu.d]}
    printer.add("factor", matrix, {"A": lu.values}, ["d"])
    solution = lu.solved(a, b)
    printer.add("solve", {"A": a, "b": b}, {"y": solution})
    printer.add("stage", {**t.point, "A": a, "g": g}, {"k": stage})
    along_inputs = slopes.tangents(t.f, t.u, t.w)
    printer.add("df_dt", {**t.point, "w": t.w}, {"f": along_inputs})
    return len(lu.j), len(lu.values)


Inputs = Callable[[float], Sequence[Node]]
"""The inputs at a part of a step, 0 at its beginning."""


def explicit_step(
    t: TracedSystem, a: Sequence[Sequence[float]], b: Sequence[float], h: Node, inputs: Inputs
) -> list[Node]:
    """The states after a step h of an explicit Runge-Kutta method.

    `a` are the rows of the tableau below its first, `b` its weights; `inputs` gives the inputs at a
    part of the step.
    """
    ordered = nodes.in_order(t.f)
    stages: list[list[Node]] = []
    for row in ([], *a):
        state = _moved(t.x, row, stages, h)
        at = [*state, *inputs(sum(row))]
        stages.append(nodes.replaced(t.f, [*t.x, *t.u], at, ordered))
    return _moved(t.x, b, stages, h)


def _moved(
    x: Sequence[Node], weights: Sequence[float], stages: Sequence[Sequence[Node]], h: Node
) -> list[Node]:
    """x + h (a1 k1 + a2 k2 + ...)."""
    moved = []
    for i, start in enumerate(x):
        total = nodes.ZERO
        for weight, stage in zip(weights, stages, strict=True):
            if weight:
                total = total + weight * stage[i]
        moved.append(start + h * total)
    return moved


def explicit_module(
    t: TracedSystem, a: Sequence[Sequence[float]], b: Sequence[float]
) -> tuple[str, int]:
    """One whole step of an explicit Runge-Kutta method: step(x, u, c, w, h, y), and how long `c`
    must be.

    `a` are the rows of the tableau below its first, `b` its weights; nodes are the row sums. Inputs
    move at w.
    """
    h = nodes.symbol("h")

    def inputs(node: float) -> list[Node]:
        return [u + node * h * w for u, w in zip(t.u, t.w, strict=True)]

    with nodes.recording():
        step = explicit_step(t, a, b, h, inputs)
        printer = Printer()
        printer.add("step", {**t.point, "w": t.w, "h": [h]}, {"y": step}, ["h"])
    return printer.module(), printer.held

"""Functions that a system is printed as, in LLVM text or any other target language."""

import copy
import dataclasses
import functools
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ...core import Node, System, TraceError, autodiff, nodes, slopes
from .ir import emission
from .ir.emission import FunctionBlock, TargetLanguage
from .ir.instructions import Code, Operand, hoisted, instructions
from .ir.jacobian import nonzeros
from .ir.repeated_parts import LEAST_COUNT, Section, sections
from .ir.scheduling import Item
from .ir.sparse_lu import Factors, distinct
from .llvm.emit import RARE, FunctionBody, LlvmLanguage
from .part_calls import Arguments, CallingFunction, PartFunctions
from .preparation import Preparation
from .text.body import NO_LABEL

LLVM = LlvmLanguage()
LEAST_COUNT_IN_STEPS = 16
"""How often a part repeats at least in each stage of a whole step to be a function that is called:
such a step takes 1.07 of its time with 6 equal parts, 1.00 with 16, 0.95 with 24 (measured)."""
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

    The text is in LLVM unless another language is given. Parts that repeat `least_count` times are
    functions that are called, where the language has calls; none are with None.
    """

    def __init__(
        self, language: TargetLanguage = LLVM, least_count: int | None = LEAST_COUNT
    ) -> None:
        self._least_count = least_count
        self.text: list[str] = []
        self.needed: dict[str, int] = {}
        self._language = language
        self._preparation = Preparation()
        self._parts = PartFunctions()
        self.quantities: tuple[Mapping[str, list[Node]], list[Node]] | None = None
        """Arguments and values of the quantities of the array "o", which have names in functions of
        these arguments.
        """

    @property
    def held(self) -> int:
        """How long `c` must be."""
        return len(self._preparation.places)

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
        for (output, index), value in self.compute(block, code, inputs, outputs).items():
            block.store(outputs[output], index, value)
        self.end(name, inputs, outputs, block)

    def compute(
        self,
        block: Any,
        code: Code,
        names: Sequence[str],
        outputs: Sequence[str] = (),
    ) -> dict[tuple[int, int], str]:
        """Append code to a function with arguments `names`; the names of its results, which are not
        stored, by output and index.

        Results that repeated parts stored in the arrays `outputs` are left out.
        """
        code, prepared = self._hoisted(code, names)
        arguments = Arguments(names, prepared, outputs)
        divided = self._divided(block, code, arguments)
        if divided:
            self._place_in_order(divided, prepared)
            arguments = arguments._replace(precomputed=self._places_of(prepared))
            return CallingFunction(block, arguments, self._parts).append(code, divided)
        return emission.computed(block, code, names, self._places_of(prepared))

    def end(
        self, name: str, inputs: Sequence[str], outputs: Sequence[str], block: FunctionBlock
    ) -> None:
        """Close a function; the argument that holds parameters becomes `c`."""
        inputs = list(map(self._argument, inputs))
        if self._language.labels:
            self._name(block, inputs, outputs)
        self.text.append(self._language.function(name, inputs, outputs, block))
        self.needed |= block.needed

    def _name(self, block: Any, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """Give the values of a function the names of the quantities that they are."""
        labels = self._language.labels
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
        of_c = [
            labels[PARAMETERS][operand[2]] if operand[0] == "in" else NO_LABEL
            for operand in self._preparation.places
        ]
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
        code, prepared = self._hoisted(code, names)
        return code, self._places_of(prepared)

    def _hoisted(self, code: Code, names: Sequence[str]) -> tuple[Code, dict[Operand, Operand]]:
        """Code less what depends on parameters alone, and the operands of `prepare` that it
        reads."""
        if PARAMETERS not in names:
            return code, {}
        number = names.index(PARAMETERS)
        code, once, constants = hoisted(code, number)
        renamed = self._preparation.add(once, number)
        prepared = {
            operand: self._preparation.renamed(operand, number, renamed) for operand in constants
        }
        return code, prepared

    def _places_of(self, prepared: Mapping[Operand, Operand]) -> dict[Operand, int]:
        """Where in `c` operands of `prepare` stand."""
        return {operand: self._preparation.place(here) for operand, here in prepared.items()}

    def _place_in_order(
        self, divided: Sequence[Section], prepared: Mapping[Operand, Operand]
    ) -> None:
        """Put what each repeated part reads of `prepare` into one piece of `c`, after what several
        read."""
        calls = [call for section in divided for call in section.calls]
        reads = Counter(operand for call in calls for operand in call.inputs)
        for operand, here in prepared.items():
            if reads[operand] != 1:
                self._preparation.place(here)
        for call in calls:
            for operand in call.inputs:
                if operand in prepared:
                    self._preparation.place(prepared[operand])

    def module(self) -> str:
        """`prepare` and all functions, as one text."""
        preparation = self._printed_preparation()
        return "\n".join([*self._parts.text, preparation, *self.text])

    def _printed_preparation(self) -> str:
        block: Any = self._language.body()
        code = self._preparation.code
        arguments = Arguments([PARAMETERS], {}, ["c"])
        divided = self._divided(block, code, arguments)
        if divided:
            function = CallingFunction(block, arguments, self._parts, RARE)
            for (_, index), value in function.append(code, divided).items():
                block.store("c", index, value)
        else:
            self._preparation.print(block)
        self.needed |= block.needed
        if self._language.labels:
            block.name_values(self._language.labels, {}, {PARAMETERS, "c"})
        return self._language.preparation("prepare", [PARAMETERS], ["c"], block)

    def _divided(self, block: Any, code: Code, arguments: Arguments) -> list[Section]:
        """The code with its repeated parts apart, where the language of the block has calls."""
        if self._least_count is None or not isinstance(block, FunctionBody):
            return []
        if not block.calls_parts:
            return []
        return sections(code, arguments.array_of, arguments.level, self._least_count)


Extension = Callable[[Printer], None]
"""What adds further functions to a module; they share its `prepare`."""


def system_module(
    t: TracedSystem,
    language: TargetLanguage = LLVM,
    extend: Extension | None = None,
    *,
    implicit: bool = True,
    least_count: int | None = LEAST_COUNT,
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

    Parts that repeat `least_count` times are functions that these call.
    """
    printer = Printer(language, least_count)
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
        printer = Printer(least_count=LEAST_COUNT_IN_STEPS)
        printer.add("step", {**t.point, "w": t.w, "h": [h]}, {"y": step}, ["h"])
    return printer.module(), printer.held

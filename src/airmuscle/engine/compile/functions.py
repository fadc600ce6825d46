"""Functions that a system is printed as, in LLVM text or any other target language."""

import copy
import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ...core import System, TraceError, autodiff
from .ir import emission
from .ir.emission import FunctionBlock, TargetLanguage
from .ir.instructions import Code, Operand, finished, hoisted, instructions, recorded
from .ir.jacobian import Tape, nonzeros
from .ir.scheduling import Item
from .ir.sparse_lu import Factors
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
    """A system as CasADi expressions: states x, inputs u, their slopes w, parameters p, rates f,
    outputs o.
    """

    x: Any
    u: Any
    w: Any
    p: Any
    f: Any
    o: Any
    output_names: tuple[str, ...]

    @property
    def point(self) -> dict[str, Any]:
        """What rates and outputs depend on, by the names of the arguments."""
        return dict(zip(POINT, (self.x, self.u, self.p), strict=True))


def trace_system(system: System) -> TracedSystem:
    """Call a system once with symbols; raises TraceError where that does not give finite
    expressions.
    """
    import casadi

    model, p = autodiff.symbolic(system)
    names = [s.name for s in system.states]
    x = casadi.SX.sym("x", len(names))
    u = casadi.SX.sym("u", len(system.inputs))
    w = casadi.SX.sym("w", len(system.inputs))
    state = {name: x[i] for i, name in enumerate(names)}
    inputs = {name: u[i] for i, name in enumerate(system.inputs)}
    rates, outputs = model.rates_and_outputs(state, inputs)
    if set(rates) != set(names):
        raise TraceError(
            f"{type(system).__name__}: states are {names}, but rates are given for {list(rates)}."
        )
    # Dense, because a printed function writes non-zeros one after the other.
    f = casadi.densify(casadi.vertcat(*(rates[name] for name in names)))
    o = casadi.densify(casadi.vertcat(*outputs.values())) if outputs else casadi.SX(0, 1)
    autodiff.check_finite(casadi.vertcat(f, o), type(system).__name__)
    f, o = casadi.cse(
        [f, o]
    )  # once, so that the same need not be found again for every printed function
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
        self.quantities: tuple[Mapping[str, Any], Any] | None = None
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
        inputs: dict[str, Any],
        outputs: dict[str, Any],
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
        code, held = self.set_apart(code, names)
        return emission.computed(block, code, names, held)

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
            trial = copy.copy(
                block
            )  # it prints the quantities, too: those that have values already have their names
            trial.lines, trial.known, trial.read, trial.loaded = [], dict(block.known), set(), {}
            code, held, items = self._quantity_code
            values = emission.Emission(trial, list(self.quantities[0]), held, {})
            values.run(items)
            computed = set(block.known.values())
            results = ((values.value_of(operand), index) for _, index, operand in code.outputs)
            named = {value: ("o", index) for value, index in results if value in computed}
        of_c = [
            labels[PARAMETERS][parameters[v][1]] if v in parameters else NO_LABEL
            for v in self._places
        ]
        block.name_values({**labels, "c": of_c}, named, {*inputs, *outputs})

    @functools.cached_property
    def _quantity_code(self) -> tuple[Code, dict[Operand, int], list[Item]]:
        """Code of the quantities, which is the same in all functions: where `c` holds operands, its
        instructions.
        """
        arguments, values = self.quantities  # type: ignore[misc]
        code, held = self.set_apart(
            instructions(list(arguments.values()), [values]), list(arguments)
        )
        return code, held, emission.with_gates(code, list(arguments), held)

    @staticmethod
    def _argument(name: str) -> str:
        return "c" if name == PARAMETERS else name

    def set_apart(self, code: Code, names: Sequence[str]) -> tuple[Code, dict[Operand, int]]:
        """Code less what depends on parameters alone, which goes to `prepare`, and where in `c`
        that stands.
        """
        if PARAMETERS not in names:
            return code, {}
        code, once, handed = hoisted(code, names.index(PARAMETERS))
        prepared = emission.Emission(self._prepare, names, {}, {})
        held = {}
        prepared.run(once)
        for operand in handed:
            value = prepared.value_of(operand)
            if value not in self._places:  # functions share equal values
                self._places[value] = len(self._places)
                self._prepare.store("c", self._places[value], value)
            held[operand] = self._places[value]
        return code, held

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
    code = recorded([t.x, t.u, t.p], [t.f])
    printer.quantities = t.point, t.o
    printer.add_code("rhs", POINT, finished(code), ["f"])
    jacobian, factors = _add_implicit(printer, t, code) if implicit else (0, 0)
    printer.add("outputs", t.point, {"o": t.o})
    if extend is not None:
        extend(printer)
    sizes = t.x.numel(), t.u.numel(), t.p.numel(), printer.held, jacobian, factors, t.o.numel()
    return printer.module(), ArraySizes(*sizes)


def _add_implicit(printer: Printer, t: TracedSystem, code: Code) -> tuple[int, int]:
    """Print jac to df_dt for recorded rates; how many numbers J and A have."""
    import casadi

    size = t.x.numel()
    tape = Tape(code.body)
    point = t.point
    rates = code.results(0, size)
    slopes = nonzeros(tape, rates, [("in", 0, j) for j in range(size)])
    distinct = list(dict.fromkeys(slopes.values()))
    outputs = [
        (k, i, operand)
        for k, operands in enumerate((rates, distinct))
        for i, operand in enumerate(operands)
    ]
    lu = Factors(tuple(slopes), tuple(distinct.index(operand) for operand in slopes.values()), size)
    a, g, b = (casadi.SX.sym(n, k) for n, k in (("A", lu.values.numel()), ("g", size), ("b", size)))
    stage = lu.solved(a, [t.f[i] + g[i] for i in range(size)])
    solve = lu.solved(a, [b[i] for i in range(size)])
    printer.add_code("jac", POINT, finished(Code(tuple(tape.body), tuple(outputs))), ["f", "J"])
    printer.add("factor", {"J": lu.j, "d": lu.d}, {"A": lu.values}, ["d"])
    printer.add("solve", {"A": a, "b": b}, {"y": casadi.vertcat(*solve)})
    printer.add("stage", {**point, "A": a, "g": g}, {"k": casadi.vertcat(*stage)})
    df_dt = casadi.densify(casadi.jtimes(t.f, t.u, t.w) if t.u.numel() else casadi.SX(size, 1))
    printer.add("df_dt", {**point, "w": t.w}, {"f": df_dt})
    return lu.j.numel(), lu.values.numel()


def explicit_module(
    t: TracedSystem, a: Sequence[Sequence[float]], b: Sequence[float]
) -> tuple[str, int]:
    """One whole step of an explicit Runge-Kutta method: step(x, u, c, w, h, y), and how long `c`
    must be.

    `a` are the rows of the tableau below its first, `b` its weights; nodes are the row sums. Inputs
    move at w.
    """
    import casadi

    rates = casadi.Function("rates", [t.x, t.u, t.p], [t.f])
    h = casadi.SX.sym("h")
    slopes: list[Any] = []
    for row in ([], *a):
        increment = sum(
            (weight * k for weight, k in zip(row, slopes, strict=True) if weight), casadi.SX(0)
        )
        slopes.append(rates(t.x + h * increment if row else t.x, t.u + sum(row) * h * t.w, t.p))
    step = t.x + h * sum(
        (weight * k for weight, k in zip(b, slopes, strict=True) if weight), casadi.SX(0)
    )
    printer = Printer()
    printer.add("step", {**t.point, "w": t.w, "h": h}, {"y": step}, ["h"])
    return printer.module(), printer.held

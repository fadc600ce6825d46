"""Instructions printed as straight-line LLVM IR, and compiled by llvmlite, which numba brings."""

from __future__ import annotations

import functools
import struct
from collections.abc import Mapping, Sequence
from typing import Any

import casadi

from ..errors import TraceError
from .instructions import MAXIMUM, MINIMUM, SELECT, Code, Instruction, Operand

FLAGS = "nsz arcp contract reassoc afn"
"""Fast arithmetic that keeps NaN and infinity: a failed step must still show (never nnan, ninf)."""

_BINARY = {casadi.OP_ADD: "fadd", casadi.OP_SUB: "fsub", casadi.OP_MUL: "fmul", casadi.OP_DIV: "fdiv"}
_CALLS = {
    casadi.OP_SQRT: "llvm.sqrt.f64", casadi.OP_FABS: "llvm.fabs.f64", casadi.OP_EXP: "exp", casadi.OP_LOG: "log",
    casadi.OP_SIN: "sin", casadi.OP_COS: "cos", casadi.OP_TAN: "tan", casadi.OP_ATAN: "atan", casadi.OP_SINH: "sinh",
    casadi.OP_COSH: "cosh", casadi.OP_TANH: "tanh", casadi.OP_ASINH: "asinh", casadi.OP_ASIN: "asin",
    casadi.OP_ACOS: "acos", casadi.OP_LOG1P: "log1p", casadi.OP_EXPM1: "expm1",
}  # fmt: skip
_COMPARISONS = {casadi.OP_LE: "ole", casadi.OP_LT: "olt", casadi.OP_EQ: "oeq", casadi.OP_NE: "une"}
_DECLARATIONS = "".join(f"declare double @{name}(double)\n" for name in sorted(set(_CALLS.values()))) + (
    "declare double @pow(double, double)\n"
)


def _constant(value: float) -> str:
    return f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"


ONE, ZERO, LESS = _constant(1.0), _constant(0.0), _constant(-1.0)


class Block:
    """The lines of one LLVM function under construction; what is computed once is not computed again."""

    def __init__(self, scalars: Sequence[str] = ()) -> None:
        self.lines: list[str] = []
        self.scalars = frozenset(scalars)
        self._known: dict[str, str] = {}

    def put(self, expression: str) -> str:
        """The name of the value of `expression`, which is computed unless it is known."""
        if expression not in self._known:
            self._known[expression] = f"%v{len(self._known)}"
            self.lines.append(f"  {self._known[expression]} = {expression}")
        return self._known[expression]

    def constant(self, value: float) -> str:
        """A constant."""
        return _constant(value)

    def load(self, array: str, index: int) -> str:
        """The value of an array element, or of a scalar argument."""
        if array in self.scalars:
            return f"%{array}"
        place = self.put(f"getelementptr inbounds double, ptr %{array}, i64 {index}")
        return self.put(f"load double, ptr {place}, align 8")

    def store(self, array: str, index: int, value: str) -> None:
        """Write a value into an array element."""
        place = self.put(f"getelementptr inbounds double, ptr %{array}, i64 {index}")
        self.lines.append(f"  store double {value}, ptr {place}, align 8")

    def choose(self, comparison: str, a: str, b: str, when_true: str, when_false: str) -> str:
        """`when_true` where `a comparison b`, else `when_false`."""
        test = self.put(f"fcmp {comparison} double {a}, {b}")
        return self.put(f"select i1 {test}, double {when_true}, double {when_false}")

    def operate(self, operation: int, x: Sequence[str]) -> str:
        """The printed form of one CasADi operation on values; raises TraceError for one that is not known."""
        if operation in _BINARY:
            return self.put(f"{_BINARY[operation]} {FLAGS} double {x[0]}, {x[1]}")
        if operation in _CALLS:
            return self.put(f"call {FLAGS} double @{_CALLS[operation]}(double {x[0]})")
        if operation in _COMPARISONS:
            return self.choose(_COMPARISONS[operation], x[0], x[1], ONE, ZERO)
        simple = {
            casadi.OP_NEG: lambda: self.put(f"fneg {FLAGS} double {x[0]}"),
            casadi.OP_SQ: lambda: self.put(f"fmul {FLAGS} double {x[0]}, {x[0]}"),
            casadi.OP_TWICE: lambda: self.put(f"fadd {FLAGS} double {x[0]}, {x[0]}"),
            casadi.OP_INV: lambda: self.put(f"fdiv {FLAGS} double {ONE}, {x[0]}"),
            casadi.OP_POW: lambda: self.put(f"call {FLAGS} double @pow(double {x[0]}, double {x[1]})"),
            casadi.OP_CONSTPOW: lambda: self.put(f"call {FLAGS} double @pow(double {x[0]}, double {x[1]})"),
            casadi.OP_NOT: lambda: self.choose("oeq", x[0], ZERO, ONE, ZERO),
            casadi.OP_AND: lambda: self.put(f"fmul double {x[0]}, {x[1]}"),
            casadi.OP_OR: lambda: self.choose("une", self.put(f"fadd double {x[0]}, {x[1]}"), ZERO, ONE, ZERO),
            casadi.OP_FMIN: lambda: self.choose("olt", x[0], x[1], x[0], x[1]),
            casadi.OP_FMAX: lambda: self.choose("ogt", x[0], x[1], x[0], x[1]),
            # strict: of two equal numbers either is the larger, and this is what the processor's instruction does
            MINIMUM: lambda: self.choose("olt", x[0], x[1], x[0], x[1]),
            MAXIMUM: lambda: self.choose("ogt", x[0], x[1], x[0], x[1]),
            casadi.OP_IF_ELSE_ZERO: lambda: self.choose("une", x[0], ZERO, x[1], ZERO),
            casadi.OP_SIGN: lambda: self.choose("ogt", x[0], ZERO, ONE, self.choose("olt", x[0], ZERO, LESS, ZERO)),
            SELECT: lambda: self.choose("une", x[0], ZERO, x[1], x[2]),
            casadi.OP_ASSIGN: lambda: x[0],
        }  # fmt: skip
        if operation not in simple:
            raise TraceError(f"CasADi operation {operation} has no printed form; write the law over airmuscle.ops.")
        return simple[operation]()


def computed(
    block: Block, code: Code, inputs: Sequence[str], held: Mapping[Operand, int], given: Mapping[Operand, str]
) -> dict[tuple[int, int], str]:
    """Append code to a block: `inputs` name the arrays, `held` says what stands in `c`, `given` what is known.

    Returns the names of the results by output and index.
    """
    values = run(block, code.body, inputs, held, given)
    return {(o, i): value_of(block, operand, inputs, held, values) for o, i, operand in code.outputs}


def run(
    block: Block, body: Sequence[Instruction], inputs: Sequence[str], held: Mapping[Operand, int],
    given: Mapping[Operand, str],
) -> dict[Operand, str]:  # fmt: skip
    """Append instructions to a block; the names of their results, and of what was given."""
    values = dict(given)
    for line in body:
        append(block, line, inputs, held, values)
    return values


def append(
    block: Block, line: Instruction, inputs: Sequence[str], held: Mapping[Operand, int], values: dict[Operand, str]
) -> None:
    """Append one instruction, and add the name of its result to `values`."""
    arguments = [value_of(block, a, inputs, held, values) for a in line.arguments]
    values[line.result] = block.operate(line.operation, arguments)


def value_of(
    block: Block, operand: Operand, inputs: Sequence[str], held: Mapping[Operand, int], values: Mapping[Operand, str]
) -> str:
    if operand in held:
        return block.load("c", held[operand])
    if operand in values:
        return values[operand]
    if operand[0] == "c":
        return block.constant(float(operand[1]))
    return block.load(inputs[operand[1]], operand[2])


def hand_over(
    block: Block, once: Sequence[Instruction], handed: Sequence[Operand], inputs: Sequence[str], places: dict[str, int]
) -> dict[Operand, int]:
    """Append the parameters-only part of a function, and say where in `c` its results stand.

    `places` are the values that stand there already: functions that need the same value share its place.
    """
    values = run(block, once, inputs, {}, {})
    held = {}
    for operand in handed:
        value = value_of(block, operand, inputs, {}, values)
        if value not in places:
            places[value] = len(places)
            block.store("c", places[value], value)
        held[operand] = places[value]
    return held


def function(name: str, arguments: Sequence[str], block: Block, attributes: str = "nounwind") -> str:
    """The LLVM text of a function that returns nothing; arrays are pointers that do not overlap."""
    signature = ", ".join(f"double %{a}" if a in block.scalars else f"ptr noalias nocapture %{a}" for a in arguments)
    return f"define void @{name}({signature}) {attributes} {{\n" + "\n".join(block.lines) + "\n  ret void\n}\n"


@functools.cache
def _target() -> Any:
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    features = llvm.get_host_cpu_features().flatten()
    target = llvm.Target.from_default_triple()
    return lambda: target.create_target_machine(cpu=llvm.get_host_cpu_name(), features=features, opt=2)


def compiled(text: str) -> Any:
    """Machine code of LLVM text; the returned engine must stay alive as long as its addresses are used."""
    import llvmlite.binding as llvm

    machine = _target()()
    module = llvm.parse_assembly(_DECLARATIONS + text)
    options = llvm.create_pipeline_tuning_options(speed_level=2)
    options.slp_vectorization = False
    passes = llvm.create_pass_builder(machine, options)
    passes.getModulePassManager().run(module, passes)
    engine = llvm.create_mcjit_compiler(module, machine)
    engine.finalize_object()
    return engine

"""CasADi expressions as a list of instructions, with what depends on parameters alone set apart."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import casadi

Operand = tuple[Any, ...]
"""("t", k) the result of instruction k, ("c", value) a constant, ("in", argument, index) an input."""

SELECT, MAXIMUM, MINIMUM = -1, -2, -3
"""Our own operations: (condition, when true, when false), which CasADi spells with two masks and a sum; and the
selection of the larger or smaller of two numbers, (a, b), for which processors have one instruction."""

CALLED = frozenset({
    casadi.OP_EXP, casadi.OP_LOG, casadi.OP_SIN, casadi.OP_COS, casadi.OP_TAN, casadi.OP_ATAN, casadi.OP_SINH,
    casadi.OP_COSH, casadi.OP_TANH, casadi.OP_ASINH, casadi.OP_ASIN, casadi.OP_ACOS, casadi.OP_LOG1P, casadi.OP_EXPM1,
    casadi.OP_POW, casadi.OP_CONSTPOW,
})  # fmt: skip
"""The operations for which a function of the C library is called."""


@dataclasses.dataclass(frozen=True)
class Instruction:
    """`result = operation(arguments)`, once each."""

    operation: int
    result: Operand
    arguments: tuple[Operand, ...]


@dataclasses.dataclass(frozen=True)
class Code:
    """Instructions in order, and where their results go: (output number, index, operand)."""

    body: tuple[Instruction, ...]
    outputs: tuple[tuple[int, int, Operand], ...]


def instructions(inputs: Sequence[Any], outputs: Sequence[Any]) -> Code:
    """The instructions that compute the non-zeros of `outputs` (CasADi SX) from `inputs`."""
    return finished(recorded(inputs, outputs))


def recorded(inputs: Sequence[Any], outputs: Sequence[Any]) -> Code:
    """The instructions as CasADi has them, the larger and smaller of two still as choices, which have derivatives."""
    function = casadi.Function("code", list(inputs), casadi.cse(list(outputs)))
    current: dict[int, Operand] = {}
    body: list[Instruction] = []
    results: list[tuple[int, int, Operand]] = []
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        target, source = function.instruction_output(k), function.instruction_input(k)
        if operation == casadi.OP_CONST:
            current[target[0]] = ("c", function.instruction_constant(k))
        elif operation == casadi.OP_INPUT:
            current[target[0]] = ("in", source[0], source[1])
        elif operation == casadi.OP_OUTPUT:
            results.append((target[0], target[1], current[source[0]]))
        else:
            name = ("t", len(body))
            body.append(Instruction(operation, name, tuple(current[i] for i in source)))
            current[target[0]] = name
    return Code(tuple(_selects(body)), tuple(results))


def finished(code: Code) -> Code:
    """Code as it is printed: choices found, what nobody needs left out."""
    body = _selects(code.body)
    by_result = {line.result: line for line in body}
    chosen: list[Instruction] = []
    for line in body:
        if line.operation == casadi.OP_IF_ELSE_ZERO:
            chosen += _extreme_of_zero(line, by_result)
        else:
            chosen.append(_extreme(line, by_result) if line.operation == SELECT else line)
    return _without_unused(chosen, code.outputs)


def _selects(body: Sequence[Instruction]) -> list[Instruction]:
    """Each sum of a mask and its opposite mask as one SELECT."""
    by_result = {line.result: line for line in body}

    def mask(operand: Operand) -> Instruction | None:
        line = by_result.get(operand)
        return line if line is not None and line.operation == casadi.OP_IF_ELSE_ZERO else None

    def negated(operand: Operand) -> Operand | None:
        line = by_result.get(operand)
        return line.arguments[0] if line is not None and line.operation == casadi.OP_NOT else None

    chosen = []
    for line in body:
        first, second = (mask(a) for a in line.arguments) if line.operation == casadi.OP_ADD else (None, None)
        if first and second and negated(second.arguments[0]) == first.arguments[0]:
            line = Instruction(SELECT, line.result, (first.arguments[0], first.arguments[1], second.arguments[1]))
        elif first and second and negated(first.arguments[0]) == second.arguments[0]:
            line = Instruction(SELECT, line.result, (second.arguments[0], second.arguments[1], first.arguments[1]))
        chosen.append(line)
    return chosen


def _extreme_of_zero(line: Instruction, by_result: Mapping[Operand, Instruction]) -> list[Instruction]:
    """A mask that hides a number below zero, or above it, as the larger or smaller of the two; so too in a product,
    which can then be fused with a sum.

    NaN is hidden or shown as by the mask: where the comparison fails, the second of the two is chosen.
    """
    (condition, masked), zero = line.arguments, ("c", 0.0)
    test, product = by_result.get(condition), by_result.get(masked)
    opposite = test is not None and test.operation == casadi.OP_NOT
    if test is not None and opposite:
        test = by_result.get(test.arguments[0])
    if test is None or test.operation not in (casadi.OP_LE, casadi.OP_LT) or zero not in test.arguments:
        return [line]
    number = test.arguments[test.arguments[0] == zero]
    larger = (test.arguments[0] == zero) != opposite
    pair = (zero, number) if opposite else (number, zero)
    extreme = Instruction(MAXIMUM if larger else MINIMUM, line.result, pair)
    if number == masked:
        return [extreme]
    if product is None or product.operation != casadi.OP_MUL or number not in product.arguments:
        return [line]
    other = product.arguments[product.arguments[0] == number]
    extreme = Instruction(extreme.operation, ("t", "extreme of", line.result), pair)
    return [extreme, Instruction(casadi.OP_MUL, line.result, (extreme.result, other))]


def _extreme(line: Instruction, by_result: Mapping[Operand, Instruction]) -> Instruction:
    """A SELECT of the larger or smaller of the two that its condition compares, as what it is."""
    condition, a, b = line.arguments
    test = by_result.get(condition)
    if test is not None and test.operation in (casadi.OP_LE, casadi.OP_LT):
        if test.arguments == (b, a):
            return Instruction(MAXIMUM, line.result, (a, b))
        if test.arguments == (a, b):
            return Instruction(MINIMUM, line.result, (a, b))
    return line


def _without_unused(body: list[Instruction], outputs: tuple[tuple[int, int, Operand], ...]) -> Code:
    needed = {operand for _, _, operand in outputs}
    kept = []
    for line in reversed(body):
        if line.result in needed:
            kept.append(line)
            needed.update(line.arguments)
    return Code(tuple(reversed(kept)), outputs)


def hoisted(code: Code, parameter_input: int) -> tuple[Code, tuple[Instruction, ...], tuple[Operand, ...]]:
    """Code without what depends on parameters alone; that part; and the operands it hands over, in order.

    A division by such a quantity becomes a product with its inverse, which is handed over instead.
    """
    varies: dict[Operand, bool] = {}

    def depends(operand: Operand) -> bool:
        if operand[0] == "t":
            return varies[operand]
        return bool(operand[0] == "in" and operand[1] != parameter_input)

    once: list[Instruction] = []
    always: list[Instruction] = []
    for line in code.body:
        if line.operation == casadi.OP_DIV and depends(line.arguments[0]) and not depends(line.arguments[1]):
            inverse = Instruction(casadi.OP_INV, ("t", "inverse of", line.arguments[1]), line.arguments[1:])
            if inverse.result not in varies:
                once.append(inverse)
                varies[inverse.result] = False
            line = Instruction(casadi.OP_MUL, line.result, (line.arguments[0], inverse.result))
        varies[line.result] = any(depends(a) for a in line.arguments)
        (always if varies[line.result] else once).append(line)
    used = [a for line in always for a in line.arguments] + [operand for _, _, operand in code.outputs]
    handed = tuple(dict.fromkeys(a for a in used if a[0] != "c" and not depends(a)))
    return Code(tuple(always), code.outputs), tuple(once), handed

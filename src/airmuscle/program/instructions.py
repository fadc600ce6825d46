"""CasADi expressions as a list of instructions, with what depends on parameters alone set apart."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import casadi

Operand = tuple[Any, ...]
"""("t", k) the result of instruction k, ("c", value) a constant, ("in", argument, index) an input."""

SELECT = -1
"""Our own operation: (condition, when true, when false), which CasADi spells with two masks and a sum."""


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
    return _without_unused(_selects(body), tuple(results))


def _selects(body: list[Instruction]) -> list[Instruction]:
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


def _without_unused(body: list[Instruction], outputs: tuple[tuple[int, int, Operand], ...]) -> Code:
    needed = {operand for _, _, operand in outputs}
    kept = []
    for line in reversed(body):
        if line.result in needed:
            kept.append(line)
            needed.update(line.arguments)
    return Code(tuple(reversed(kept)), outputs)


def hoisted(code: Code, parameter_input: int) -> tuple[Code, tuple[Instruction, ...], tuple[Operand, ...]]:
    """Code without what depends on parameters alone; that part; and the operands it hands over, in order."""
    varies: dict[Operand, bool] = {}

    def depends(operand: Operand) -> bool:
        if operand[0] == "t":
            return varies[operand]
        return bool(operand[0] == "in" and operand[1] != parameter_input)

    once: list[Instruction] = []
    always: list[Instruction] = []
    for line in code.body:
        varies[line.result] = any(depends(a) for a in line.arguments)
        (always if varies[line.result] else once).append(line)
    used = [a for line in always for a in line.arguments] + [operand for _, _, operand in code.outputs]
    handed = tuple(dict.fromkeys(a for a in used if a[0] != "c" and not depends(a)))
    return Code(tuple(always), code.outputs), tuple(once), handed

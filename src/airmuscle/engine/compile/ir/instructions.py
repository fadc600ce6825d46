"""Recorded expressions as a list of instructions; those that depend on parameters only are
separated.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from ....core import Node, Operation, nodes

Operand = tuple[Any, ...]
"""("t", k) the result of instruction k, ("c", value) a constant, ("in", argument, index) an
input.
"""
ZERO: Operand = ("c", 0.0)
ONE: Operand = ("c", 1.0)

_COMPARE = (Operation.LESS_EQUAL, Operation.LESS)
_OF_ONE = "exp log sin cos tan atan sinh cosh tanh asinh asin acos log1p expm1"
CALLED = {Operation[name.upper()]: name for name in _OF_ONE.split()} | {Operation.POWER: "pow"}
"""The functions of the C library that are called for operations."""


class Instruction(NamedTuple):
    """`result = operation(arguments)`; every result is assigned once."""

    operation: Operation
    result: Operand
    arguments: tuple[Operand, ...]


@dataclasses.dataclass(frozen=True)
class Code:
    """Instructions in execution order, and the destinations of results: (output number, index,
    operand).
    """

    body: tuple[Instruction, ...]
    outputs: tuple[tuple[int, int, Operand], ...]

    def results(self, output: int, size: int) -> list[Operand]:
        """The operands of the elements of an output."""
        operands = {index: operand for number, index, operand in self.outputs if number == output}
        return [operands.get(i, ZERO) for i in range(size)]


def instructions(inputs: Sequence[Sequence[Node]], outputs: Sequence[Sequence[Node]]) -> Code:
    """The instructions that compute `outputs` from the symbols `inputs`, ready for printing."""
    return finished(recorded(inputs, outputs))


def recorded(inputs: Sequence[Sequence[Node]], outputs: Sequence[Sequence[Node]]) -> Code:
    """The instructions as they were recorded; maxima and minima are still selections."""
    operands: dict[int, Operand] = {
        id(symbol): ("in", i, k)
        for i, vector in enumerate(inputs)
        for k, symbol in enumerate(vector)
    }

    def operand_of(node: Node) -> Operand:
        return ("c", node.value) if node.operation == nodes.CONSTANT else operands[id(node)]

    roots = [node for vector in outputs for node in vector]
    body: list[Instruction] = []
    for node in nodes.in_order(roots, operands):
        arguments = tuple(map(operand_of, node.arguments))
        result = operands[id(node)] = ("t", len(body))
        body.append(Instruction(node.operation, result, arguments))
    results = [
        (i, k, operand_of(node))
        for i, vector in enumerate(outputs)
        for k, node in enumerate(vector)
    ]
    return Code(tuple(body), tuple(results))


def finished(code: Code) -> Code:
    """Code ready for printing: maxima and minima are recognised, unused instructions are
    removed.
    """
    body = _selects(code.body)
    by_result = {line.result: line for line in body}
    chosen: list[Instruction] = []
    for line in body:
        if line.operation == Operation.MASK:
            chosen += _extreme_of_zero(line, by_result)
        else:
            chosen.append(_extreme(line, by_result) if line.operation == Operation.SELECT else line)
    return _without_unused(chosen, code.outputs)


def _selects(body: Sequence[Instruction]) -> list[Instruction]:
    """The instructions with each sum of a mask and its complementary mask as one
    Operation.SELECT.
    """
    by_result = {line.result: line for line in body}

    def mask(operand: Operand) -> Instruction | None:
        line = by_result.get(operand)
        return line if line is not None and line.operation == Operation.MASK else None

    def negated(operand: Operand) -> Operand | None:
        line = by_result.get(operand)
        return line.arguments[0] if line is not None and line.operation == Operation.NOT else None

    chosen = []
    for line in body:
        masks = [
            masked
            for a in line.arguments
            if line.operation == Operation.ADD and (masked := mask(a))
        ]
        for mask_line, complement in (masks, masks[::-1]) if len(masks) == 2 else ():
            if (
                line.operation == Operation.ADD
                and negated(complement.arguments[0]) == mask_line.arguments[0]
            ):
                line = Instruction(
                    Operation.SELECT, line.result, (*mask_line.arguments, complement.arguments[1])
                )
        chosen.append(line)
    return chosen


def _extreme_of_zero(
    line: Instruction, by_result: Mapping[Operand, Instruction]
) -> list[Instruction]:
    """A mask of the positive or negative part of a value as a maximum or minimum with zero; also
    within a product, which can then be fused with a sum.

    NaN is treated as by the mask: if the comparison is false, the second operand is selected.
    """
    condition, masked = line.arguments
    test = by_result.get(condition)
    product = by_result.get(masked)
    opposite = test is not None and test.operation == Operation.NOT
    if test is not None and opposite:
        test = by_result.get(test.arguments[0])
    if test is None or test.operation not in _COMPARE or ZERO not in test.arguments:
        return [line]
    number = test.arguments[test.arguments[0] == ZERO]
    larger = (test.arguments[0] == ZERO) != opposite
    pair = (ZERO, number) if opposite else (number, ZERO)
    extreme = Instruction(Operation.MAXIMUM if larger else Operation.MINIMUM, line.result, pair)
    if number == masked:
        return [extreme]
    if (
        product is None
        or product.operation != Operation.MULTIPLY
        or number not in product.arguments
    ):
        return [line]
    factor = product.arguments[product.arguments[0] == number]
    extreme = Instruction(extreme.operation, ("t", "extreme of", line.result), pair)
    return [extreme, Instruction(Operation.MULTIPLY, line.result, (extreme.result, factor))]


def _extreme(line: Instruction, by_result: Mapping[Operand, Instruction]) -> Instruction:
    """An Operation.SELECT of the greater or smaller of two compared values as Operation.MAXIMUM or
    MINIMUM.
    """
    condition, a, b = line.arguments
    test = by_result.get(condition)
    if test is not None and test.operation in _COMPARE:
        if test.arguments == (b, a):
            return Instruction(Operation.MAXIMUM, line.result, (a, b))
        if test.arguments == (a, b):
            return Instruction(Operation.MINIMUM, line.result, (a, b))
    return line


def _without_unused(body: list[Instruction], outputs: tuple[tuple[int, int, Operand], ...]) -> Code:
    needed = {operand for _, _, operand in outputs}
    used = []
    for line in reversed(body):
        if line.result in needed:
            used.append(line)
            needed.update(line.arguments)
    return Code(tuple(reversed(used)), outputs)


def hoisted(
    code: Code, parameter_input: int
) -> tuple[Code, tuple[Instruction, ...], tuple[Operand, ...]]:
    """Loop-invariant code motion: the remaining code, the instructions that depend on parameters
    only, their results.

    The results are the operands that the remaining code uses, in order. A division by such an
    operand becomes a product with its precomputed inverse.
    """
    varies: dict[Operand, bool] = {}

    def depends(operand: Operand) -> bool:
        if operand[0] == "t":
            return varies[operand]
        return bool(operand[0] == "in" and operand[1] != parameter_input)

    once: list[Instruction] = []
    always: list[Instruction] = []
    for line in code.body:
        if (
            line.operation == Operation.DIVIDE
            and depends(line.arguments[0])
            and not depends(line.arguments[1])
        ):
            inverse = Instruction(
                Operation.INVERSE, ("t", "inverse of", line.arguments[1]), line.arguments[1:]
            )
            if inverse.result not in varies:
                once.append(inverse)
                varies[inverse.result] = False
            line = Instruction(Operation.MULTIPLY, line.result, (line.arguments[0], inverse.result))
        varies[line.result] = any(depends(a) for a in line.arguments)
        (always if varies[line.result] else once).append(line)
    used = [a for line in always for a in line.arguments] + [
        operand for _, _, operand in code.outputs
    ]
    constants = tuple(dict.fromkeys(a for a in used if a[0] != "c" and not depends(a)))
    return Code(tuple(always), code.outputs), tuple(once), constants

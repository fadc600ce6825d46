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
    constant = nodes.CONSTANT
    roots = [node for vector in outputs for node in vector]
    body: list[Instruction] = []
    for node in nodes.in_order(roots, operands):
        arguments = tuple(
            [("c", x.value) if x.operation == constant else operands[id(x)] for x in node.arguments]
        )
        result = operands[id(node)] = ("t", len(body))
        body.append(Instruction(node.operation, result, arguments))
    results = []
    for i, vector in enumerate(outputs):
        for k, node in enumerate(vector):
            is_number = node.operation == constant
            results.append((i, k, ("c", node.value) if is_number else operands[id(node)]))
    return Code(tuple(body), tuple(results))


def finished(code: Code) -> Code:
    """Code ready for printing: maxima and minima are recognised, unused instructions are
    removed.
    """
    body = _selects(code.body)
    by_result = {line.result: line for line in body}
    chosen: list[Instruction] = []
    for line in body:
        operation = line.operation
        if operation == Operation.MASK:
            chosen += _extreme_of_zero(line, by_result)
        elif operation == Operation.SELECT:
            chosen.append(_extreme(line, by_result))
        else:
            chosen.append(line)
    return _without_unused(chosen, code.outputs)


def _selects(body: Sequence[Instruction]) -> list[Instruction]:
    """The instructions with each sum of a mask and its complementary mask as one
    Operation.SELECT.
    """
    masks = {line.result: line for line in body if line.operation == Operation.MASK}
    opposites = {line.result: line.arguments[0] for line in body if line.operation == Operation.NOT}
    chosen = []
    for line in body:
        if line.operation == Operation.ADD and masks.keys() >= set(line.arguments):
            first, second = line.arguments
            line = _select(line, masks[first], masks[second], opposites)
        chosen.append(line)
    return chosen


def _select(
    total: Instruction,
    first: Instruction,
    second: Instruction,
    opposites: Mapping[Operand, Operand],
) -> Instruction:
    """The sum of two masks as one selection, if one masks where the other does not."""
    for mask, complement in ((first, second), (second, first)):
        if opposites.get(complement.arguments[0]) == mask.arguments[0]:
            arguments = (*mask.arguments, complement.arguments[1])
            total = Instruction(Operation.SELECT, total.result, arguments)
    return total


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
    varying: set[Operand] = set()
    inverses: set[Operand] = set()

    def depends(operand: Operand) -> bool:
        return operand in varying or (operand[0] == "in" and operand[1] != parameter_input)

    once: list[Instruction] = []
    always: list[Instruction] = []
    for line in code.body:
        if not any(depends(a) for a in line.arguments):
            once.append(line)
            continue
        if line.operation == Operation.DIVIDE and not depends(line.arguments[1]):
            inverse = Instruction(
                Operation.INVERSE, ("t", "inverse of", line.arguments[1]), line.arguments[1:]
            )
            if inverse.result not in inverses:
                once.append(inverse)
                inverses.add(inverse.result)
            line = Instruction(Operation.MULTIPLY, line.result, (line.arguments[0], inverse.result))
        varying.add(line.result)
        always.append(line)
    used = [a for line in always for a in line.arguments] + [
        operand for _, _, operand in code.outputs
    ]
    constants = tuple(dict.fromkeys(a for a in used if a[0] != "c" and not depends(a)))
    return Code(tuple(always), code.outputs), tuple(once), constants

"""Preparation of printed functions: what they need of the parameters alone, computed once."""

from collections.abc import Mapping, Sequence

from .ir.emission import Emission, FunctionBlock
from .ir.instructions import Code, Instruction, Operand


class Preparation:
    """The instructions of `prepare(p, c)`, equal ones of several functions once, and what stands
    in c.
    """

    def __init__(self) -> None:
        self.places: dict[Operand, int] = {}
        """The index in `c` of each operand that a function reads."""
        self.steps: list[Instruction | Operand] = []
        """Instructions, and the operands that are written to `c`, in order."""
        self._known: dict[tuple[object, ...], Operand] = {}

    def add(self, body: Sequence[Instruction], parameters: int) -> dict[Operand, Operand]:
        """Gather instructions of the inputs ("in", `parameters`, i); the operands here of their
        results."""
        names: dict[Operand, Operand] = {}
        for line in body:
            arguments = tuple(self.renamed(a, parameters, names) for a in line.arguments)
            key = (line.operation, *arguments)
            result = self._known.get(key)
            if result is None:
                result = self._known[key] = ("t", len(self._known))
                self.steps.append(Instruction(line.operation, result, arguments))
            names[line.result] = result
        return names

    @staticmethod
    def renamed(operand: Operand, parameters: int, names: Mapping[Operand, Operand]) -> Operand:
        """The operand here of an operand of a function."""
        if operand[0] == "in" and operand[1] == parameters:
            return ("in", 0, operand[2])
        return names.get(operand, operand)

    def place(self, operand: Operand) -> int:
        """The index in `c` of an operand, which is written there if it was not before."""
        place = self.places.get(operand)
        if place is None:
            place = self.places[operand] = len(self.places)
            self.steps.append(operand)
        return place

    def print(self, block: FunctionBlock) -> None:
        """Append all instructions to a function of `p` and `c`, in their order."""
        values = Emission(block, ["p"], {}, {})
        for step in self.steps:
            if isinstance(step, Instruction):
                values.run([step])
            else:
                block.store("c", self.places[step], values.value_of(step))

    @property
    def code(self) -> Code:
        """The instructions, with `c` as their output."""
        body = tuple(step for step in self.steps if isinstance(step, Instruction))
        return Code(body, tuple((0, place, operand) for operand, place in self.places.items()))

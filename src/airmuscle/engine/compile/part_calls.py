"""Calls of repeated parts: each pattern is printed as one function of places in arrays and of
values.

What stands in arrays at the same distances in all calls is read by the function itself, from
addresses that a call states, and results that only an output needs are written by it.
"""

import dataclasses
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from .ir import emission
from .ir.instructions import Code, Instruction, Operand
from .ir.repeated_parts import Call, Pattern, Section
from .ir.skipped_blocks import skipping
from .llvm.emit import FunctionBody, function_of_part

LEAST_READ = 2
"""Inputs that a function reads from one address at least; a single one is passed as a value."""


class Place(NamedTuple):
    """An element of an array."""

    array: str
    element: int


class Piece(NamedTuple):
    """A piece of an array that a function of a part reads or writes: its name there, the array of
    the caller, and the input or result whose element is its first."""

    name: str
    array: str
    anchor: int


@dataclasses.dataclass(frozen=True)
class Layout:
    """Where a function of a part finds each input and leaves each result.

    read     the elements of pieces of arrays in which inputs stand; None for a value
    written  the elements in which it leaves results; None for a value that it returns
    """

    read_pieces: tuple[Piece, ...]
    written_pieces: tuple[Piece, ...]
    read: tuple[Place | None, ...]
    written: tuple[Place | None, ...]

    @property
    def arrays(self) -> list[str]:
        """The names of the arrays among the arguments."""
        return [piece.name for piece in (*self.read_pieces, *self.written_pieces)]

    @property
    def passed(self) -> list[int]:
        """The inputs that are values, which follow the arrays."""
        return [j for j, place in enumerate(self.read) if place is None]

    @property
    def returned(self) -> list[int]:
        """The results that are values."""
        return [r for r, place in enumerate(self.written) if place is None]

    @classmethod
    def of(
        cls,
        calls: Sequence[Call],
        place_of: Callable[[Operand], Place | None],
        stored: Mapping[Operand, Place],
    ) -> "Layout":
        """The layout that suits all calls of a pattern; `stored` are the elements of outputs that
        only calls compute."""
        inputs = zip(*[map(place_of, call.inputs) for call in calls], strict=True)
        results = zip(*[map(stored.get, call.results) for call in calls], strict=True)
        counts: Counter[str] = Counter()
        read_pieces, read = _pieces(list(inputs), LEAST_READ, counts)
        written_pieces, written = _pieces(list(results), 1, counts)
        return cls(read_pieces, written_pieces, read, written)


def _pieces(
    columns: Sequence[Sequence[Place | None]], least: int, counts: Counter[str]
) -> tuple[tuple[Piece, ...], tuple[Place | None, ...]]:
    """Pieces of arrays with at least so many of the columns, and the place of each column in them.

    A column holds the place of one input in all calls. Columns are in one piece if their distance
    is the same in all calls. `counts` are the numbers of pieces of each array so far.
    """
    together: dict[tuple[str, tuple[int, ...]], list[int]] = defaultdict(list)
    elements = []
    for number, column in enumerate(columns):
        places = [place for place in column if place is not None]
        elements.append(places[0].element if places else 0)
        arrays = {place.array for place in places}
        if len(places) == len(column) and len(arrays) == 1:
            distances = tuple(place.element - elements[number] for place in places)
            together[arrays.pop(), distances].append(number)
    pieces = []
    found: dict[int, Place] = {}
    for (array, _), members in together.items():
        if len(members) >= least:
            piece = Piece(f"{array}{counts[array]}", array, members[0])
            counts[array] += 1
            pieces.append(piece)
            for member in members:
                found[member] = Place(piece.name, elements[member] - elements[piece.anchor])
    return tuple(pieces), tuple(found.get(number) for number in range(len(columns)))


class PartFunctions:
    """The printed functions of patterns; those that several functions call are printed once."""

    def __init__(self) -> None:
        self.text: list[str] = []
        self._names: dict[tuple[Pattern, Layout], str] = {}

    def name_of(self, pattern: Pattern, layout: Layout, attributes: str) -> str:
        """The name of the function of a pattern, which is printed if it is new."""
        key = pattern, layout
        if key not in self._names:
            self._names[key] = f"part{len(self._names)}"
            self.text.append(_printed(self._names[key], pattern, layout, attributes))
        return self._names[key]


def _printed(name: str, pattern: Pattern, layout: Layout, attributes: str) -> str:
    """The text of the function of a pattern."""
    values = [f"value{j}" for j in layout.passed]
    arguments = [*layout.arrays, *values]
    operands: dict[Operand, Operand] = {}
    levels: dict[Operand, int] = {}
    for j, (place, kind) in enumerate(zip(layout.read, pattern.kinds, strict=True)):
        array, element = (f"value{j}", 0) if place is None else place
        operand = ("in", arguments.index(array), element)
        operands["in", 0, j] = operand
        levels[operand] = kind.level
    code = _renamed(pattern.code, operands)
    block = FunctionBody(values)
    at = emission.Emission(block, arguments, {}, {})
    at.run(skipping(code, levels.__getitem__))
    returned = []
    for (_, _, operand), place in zip(code.outputs, layout.written, strict=True):
        if place is None:
            returned.append(at.value_of(operand))
        else:
            block.store(*place, at.value_of(operand))
    return function_of_part(name, arguments, block, returned, attributes)


def _renamed(code: Code, operands: Mapping[Operand, Operand]) -> Code:
    """Code of other inputs."""
    body = []
    for line in code.body:
        arguments = tuple(operands.get(a, a) for a in line.arguments)
        body.append(Instruction(line.operation, line.result, arguments))
    return Code(tuple(body), code.outputs)


class Arguments(NamedTuple):
    """The arrays that a function reads and writes.

    inputs        their names, by the number of an input
    precomputed   operands that stand in the array `c`, with their element
    outputs       the names of arrays in which results may be stored, by the number of an output
    """

    inputs: Sequence[str]
    precomputed: Mapping[Operand, Any]
    outputs: Sequence[str]

    def array_of(self, operand: Operand) -> str:
        """The array of an operand that no instruction computes."""
        return "c" if operand in self.precomputed else self.inputs[operand[1]]

    def level(self, operand: Operand) -> int:
        """What such an operand depends on."""
        return emission.levels_of_inputs(self.inputs, self.precomputed)(operand)


class CallingFunction:
    """A function whose repeated parts are called."""

    def __init__(
        self,
        block: FunctionBody,
        arguments: Arguments,
        functions: PartFunctions,
        attributes: str = "noinline",
    ) -> None:
        self._block = block
        self._arguments = arguments
        self._functions = functions
        self._attributes = attributes
        self._values = emission.Emission(block, arguments.inputs, arguments.precomputed, {})
        self._stored: dict[Operand, Place] = {}
        """The elements of outputs that calls write."""

    def append(self, code: Code, divided: Sequence[Section]) -> dict[tuple[int, int], str]:
        """Append code that is divided into sections; the names of the results that no part stored,
        by output and index."""
        self._stored = self._results_to_store(code, divided)
        alike: dict[int, list[Call]] = defaultdict(list)
        for call in _calls(divided):
            alike[id(call.pattern)].append(call)
        layouts = {
            pattern: Layout.of(calls, self._place_of, self._stored)
            for pattern, calls in alike.items()
        }
        for section in divided:
            self._values.run(skipping(section.code, section.level))
            for call in section.calls:
                self._call(call, layouts[id(call.pattern)])
        return {
            (output, index): self._values.value_of(operand)
            for output, index, operand in code.outputs
            if operand not in self._stored
        }

    def _results_to_store(self, code: Code, divided: Sequence[Section]) -> dict[Operand, Place]:
        """The elements of outputs that calls write: of results that nothing else needs."""
        if not self._arguments.outputs:
            return {}
        read = {a for section in divided for line in section.code.body for a in line.arguments}
        results: set[Operand] = set()
        for call in _calls(divided):
            read.update(call.inputs)
            results.update(call.results)
        times = Counter(operand for _, _, operand in code.outputs)
        return {
            operand: Place(self._arguments.outputs[output], index)
            for output, index, operand in code.outputs
            if operand in results and operand not in read and times[operand] == 1
        }

    def _place_of(self, operand: Operand) -> Place | None:
        """Where an operand stands in an array; None for a value."""
        if operand in self._arguments.precomputed:
            return Place("c", self._arguments.precomputed[operand])
        if operand[0] != "in":
            return None
        array = self._arguments.inputs[operand[1]]
        return None if array in self._block.scalars else Place(array, operand[2])

    def _call(self, call: Call, layout: Layout) -> None:
        """Append a call; the values that it returns are known from then on."""
        name = self._functions.name_of(call.pattern, layout, self._attributes)
        values = [self._values.value_of(call.inputs[j]) for j in layout.passed]
        addresses = self._addresses(call, layout)
        results = self._block.call_part(name, addresses, values, len(layout.returned))
        for r, value in zip(layout.returned, results, strict=True):
            self._values.values[call.results[r]] = value

    def _addresses(self, call: Call, layout: Layout) -> list[str]:
        """Where the pieces of arrays of a call begin."""
        addresses = []
        for piece in layout.read_pieces:
            place = self._place_of(call.inputs[piece.anchor])
            assert place is not None
            addresses.append(self._block.address(*place))
        for piece in layout.written_pieces:
            place = self._stored[call.results[piece.anchor]]
            addresses.append(self._block.address(*place))
        return addresses


def _calls(divided: Sequence[Section]) -> Iterable[Call]:
    return (call for section in divided for call in section.calls)

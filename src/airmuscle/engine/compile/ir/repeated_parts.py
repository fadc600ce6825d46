"""Repeated parts of a function: instructions that compute the same from other operands, such as
the same model with other parameters.

Instructions have the same shape if they are the same expression of the same arrays, whatever the
indices. Shapes that occur often belong to parts. A part is connected: its results share
instructions. What several parts share, and what combines their results, stays outside.
"""

import dataclasses
import functools
from collections import Counter, defaultdict
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from typing import NamedTuple

from .instructions import Code, Instruction, Operand
from .skipped_blocks import levels_of

LEAST_COUNT = 8
"""How often a shape occurs at least in repeated parts. With fewer of them calls take longer than
they save: a step of Rodas4 takes 0.99 of its time with 6, 0.97 with 8, 0.81 with 24 (measured)."""
LEAST_CALLS = 2
"""Calls of a function at least; parts of one shape may differ in their results."""
LEAST_LENGTH = 24
"""Instructions from which a part is worth a call (chosen)."""


class InputKind(NamedTuple):
    """What all operands at one place of equal parts have in common: the array in which they stand,
    None for results of instructions, and what they depend on."""

    array: Hashable
    level: int


@dataclasses.dataclass(frozen=True)
class Pattern:
    """What equal parts compute: instructions of the inputs ("in", 0, j), each of a kind."""

    code: Code
    kinds: tuple[InputKind, ...]


class Call(NamedTuple):
    """A part: a pattern with the operands that it reads and those that it computes."""

    pattern: Pattern
    inputs: tuple[Operand, ...]
    results: tuple[Operand, ...]


class Section(NamedTuple):
    """Instructions, and the calls after them, which depend on them and on earlier sections."""

    code: Code
    calls: tuple[Call, ...]
    level: Callable[[Operand], int]
    """What an operand depends on."""


class _Part(NamedTuple):
    """The instructions of a part by number, renamed as in its pattern, with its operands."""

    numbers: list[int]
    lines: list[Instruction]
    inputs: list[Operand]
    results: list[int]
    names: list[Operand]
    """The results as they are called in the pattern."""


_Signature = tuple[tuple[Instruction, ...], tuple[InputKind, ...], tuple[Operand, ...]]
"""What equal parts have in common: instructions, kinds of inputs, and names of results."""


def sections(
    code: Code,
    array_of: Callable[[Operand], Hashable],
    level: Callable[[Operand], int],
    least_count: int,
) -> list[Section]:
    """The code with its repeated parts as calls; empty where there are none.

    `array_of` names the array of an operand that no instruction computes, `level` states what it
    depends on, as for `skipped_blocks.skipping`.
    """
    if len(code.body) < least_count * LEAST_LENGTH:
        return []
    graph = _Graph.of(code, array_of, least_count)
    if not any(graph.is_regular):
        return []
    groups = _Groups(graph)
    while joining := groups.joining_roots():
        for root in joining:
            graph.is_regular[root] = False
        groups = _Groups(graph)
    return _Parts(graph, groups, level).sections()


@dataclasses.dataclass(frozen=True)
class _Graph:
    """The instructions of a code by number.

    number      the number of the instruction that computes an operand
    sources     the instructions whose results each one reads
    shapes      equal for equal expressions of the same arrays
    counts      how often each shape occurs
    is_regular  whether an instruction may belong to a part
    """

    code: Code
    array_of: Callable[[Operand], Hashable]
    number: Mapping[Operand, int]
    sources: Sequence[Sequence[int]]
    shapes: Sequence[int]
    counts: Mapping[int, int]
    is_regular: list[bool]

    @classmethod
    def of(cls, code: Code, array_of: Callable[[Operand], Hashable], least_count: int) -> "_Graph":
        """The graph of a code; other arguments as of `sections`."""
        number: dict[Operand, int] = {}
        sources: list[list[int]] = []
        shapes: list[int] = []
        known: dict[Hashable, int] = {}
        for k, (operation, result, arguments) in enumerate(code.body):
            computed = []
            key: list[Hashable] = [operation]
            for argument in arguments:
                source = number.get(argument)
                if source is not None:
                    computed.append(source)
                    key.append(shapes[source])
                else:
                    key.append(argument if argument[0] == "c" else array_of(argument))
            number[result] = k
            sources.append(computed)
            shapes.append(known.setdefault(tuple(key), len(known)))
        counts = Counter(shapes)
        is_regular = [counts[shape] >= least_count for shape in shapes]
        return cls(code, array_of, number, sources, shapes, counts, is_regular)

    def outputs(self) -> set[int]:
        """The instructions that compute outputs."""
        operands = {operand for _, _, operand in self.code.outputs}
        return {self.number[operand] for operand in operands if operand in self.number}


class _Groups:
    """The group of parts that each instruction belongs to; -1 for none.

    Roots are the regular instructions that others, or the outputs, read. They belong together if
    they share instructions, unless roots of the same shape and use share these, too: such
    instructions belong to several parts.
    """

    def __init__(self, graph: _Graph) -> None:
        self._graph = graph
        self._roots = self._found_roots()
        self._uses = self._uses_of_roots()
        self.of_instruction = self._joined(self._reached())

    def _found_roots(self) -> list[int]:
        graph = self._graph
        is_root = graph.outputs()
        for sources, regular in zip(graph.sources, graph.is_regular, strict=True):
            if not regular:
                is_root.update(sources)
        return sorted(root for root in is_root if graph.is_regular[root])

    def _uses_of_roots(self) -> dict[int, tuple[Hashable, ...]]:
        """The shape of each root, and where regular instructions read it."""
        graph = self._graph
        uses: dict[int, list[tuple[int, int]]] = {root: [] for root in self._roots}
        regular = (k for k, is_regular in enumerate(graph.is_regular) if is_regular)
        for k in regular:
            operation = int(graph.code.body[k].operation)
            for place, source in enumerate(graph.sources[k]):
                if source in uses:
                    uses[source].append((operation, place))
        return {root: (graph.shapes[root], *sorted(several)) for root, several in uses.items()}

    def _reached(self) -> list[int]:
        """The roots that depend on each regular instruction, as the bits of a number."""
        graph = self._graph
        masks = [0] * len(graph.sources)
        for place, root in enumerate(self._roots):
            masks[root] = 1 << place
        for k in reversed(range(len(masks))):
            if not graph.is_regular[k]:
                masks[k] = 0
            mask = masks[k]
            if mask:
                for source in graph.sources[k]:
                    masks[source] |= mask
        return masks

    def _joined(self, reached: Sequence[int]) -> list[int]:
        """The group of each instruction from the roots that depend on it."""
        uses = [self._uses[root] for root in self._roots]
        first = list(range(len(uses)))
        """Another root of the same group, or the root itself."""

        def group_of(root: int) -> int:
            while first[root] != root:
                root = first[root]
            return root

        members = {mask: _bits(mask) for mask in set(reached) if mask}
        for several in members.values():
            if len({uses[root] for root in several}) == len(several):
                for root in several[1:]:
                    first[group_of(root)] = group_of(several[0])
        group = {0: -1}
        for mask, several in members.items():
            groups = {group_of(root) for root in several}
            group[mask] = groups.pop() if len(groups) == 1 else -1
        return [group[mask] for mask in reached]

    def joining_roots(self) -> list[int]:
        """The roots that join equal parts, such as a sum over pairs of them: the rarest ones of a
        group with several roots of one shape and use."""
        members: dict[int, list[int]] = defaultdict(list)
        for root in self._roots:
            members[self.of_instruction[root]].append(root)
        joining = []
        for group, roots in members.items():
            if group >= 0 and len({self._uses[root] for root in roots}) < len(roots):
                counts = [self._graph.counts[self._graph.shapes[root]] for root in roots]
                least = min(counts)
                joining += [root for root, n in zip(roots, counts, strict=True) if n == least]
        return joining

    def order_of(self, k: int) -> tuple[int, str]:
        """The order in which equal parts list their results."""
        return self._graph.shapes[k], str(self._uses.get(k))


class _Parts:
    """The parts of groups. A part is called at once: an instruction that depends on a result of its
    group by way of others belongs to a later part, of a later section."""

    def __init__(self, graph: _Graph, groups: _Groups, level: Callable[[Operand], int]) -> None:
        self._graph = graph
        self._groups = groups
        self._level_of_leaf = level
        self._section = self._sections_of_instructions()
        keys = list(zip(groups.of_instruction, self._section, strict=True))
        numbered: dict[tuple[int, int], int] = {}
        self._part_of = [numbered.setdefault(key, len(numbered)) for key in keys]
        self._called: set[int] = set()
        """The instructions that calls compute."""

    @functools.cached_property
    def _levels(self) -> Mapping[Operand, int]:
        return levels_of(self._graph.code.body, self._level_of_leaf)

    def _level(self, operand: Operand) -> int:
        """What an operand depends on."""
        if operand in self._graph.number:
            return self._levels[operand]
        return self._level_of_leaf(operand)

    def _sections_of_instructions(self) -> list[int]:
        """How often a way to each instruction has left a part, which has to be called before."""
        group = self._groups.of_instruction
        section: list[int] = []
        for k, sources in enumerate(self._graph.sources):
            here = 0
            for source in sources:
                leaves = group[source] not in (-1, group[k])
                here = max(here, section[source] + leaves)
            section.append(here)
        return section

    def sections(self) -> list[Section]:
        """The instructions outside the calls, section by section, each with the calls after it."""
        calls = self._calls()
        if not calls:
            return []
        lines_of: dict[int, list[Instruction]] = defaultdict(list)
        for k, line in enumerate(self._graph.code.body):
            if k not in self._called:
                lines_of[self._section[k]].append(line)
        wanted = {operand for _, _, operand in self._graph.code.outputs}
        for several in calls.values():
            wanted.update(operand for call in several for operand in call.inputs)
        for lines in lines_of.values():
            wanted.update(_read_elsewhere(lines))
        divided = []
        for number in sorted({*lines_of, *calls}):
            lines = lines_of[number]
            results = [line.result for line in lines if line.result in wanted]
            outputs = tuple((0, place, operand) for place, operand in enumerate(results))
            code = Code(tuple(lines), outputs)
            divided.append(Section(code, tuple(calls.get(number, ())), self._level))
        return divided

    def _calls(self) -> dict[int, list[Call]]:
        """The calls of all patterns that occur often enough, by the section that they end."""
        calls: dict[int, list[Call]] = defaultdict(list)
        for (lines, kinds, names), parts in self._alike().items():
            if len(parts) < LEAST_CALLS:
                continue
            outputs = tuple((0, place, name) for place, name in enumerate(names))
            pattern = Pattern(Code(lines, outputs), kinds)
            for part in parts:
                self._called.update(part.numbers)
                section = self._section[part.numbers[0]]
                calls[section].append(self._call(pattern, part))
        return calls

    def _call(self, pattern: Pattern, part: _Part) -> Call:
        body = self._graph.code.body
        results = [body[k].result for k in part.results]
        return Call(pattern, tuple(part.inputs), tuple(results))

    def _alike(self) -> dict[_Signature, list[_Part]]:
        """All parts that are long enough, by what equal ones have in common."""
        members: dict[int, list[int]] = defaultdict(list)
        for k, group in enumerate(self._groups.of_instruction):
            if group >= 0:
                members[self._part_of[k]].append(k)
        is_result = self._results()
        alike: dict[_Signature, list[_Part]] = defaultdict(list)
        for numbers in members.values():
            if len(numbers) < LEAST_LENGTH:
                continue
            part = self._part(numbers, is_result)
            kinds = tuple(map(self._kind, part.inputs))
            alike[tuple(part.lines), kinds, tuple(part.names)].append(part)
        return alike

    def _kind(self, operand: Operand) -> InputKind:
        array = None if operand in self._graph.number else self._graph.array_of(operand)
        return InputKind(array, self._level(operand))

    def _results(self) -> set[int]:
        """The instructions that outputs, or instructions outside their part, read."""
        results = self._graph.outputs()
        part_of = self._part_of
        for k, sources in enumerate(self._graph.sources):
            here = part_of[k]
            for source in sources:
                if part_of[source] != here:
                    results.add(source)
        return results

    def _part(self, numbers: Sequence[int], is_result: set[int]) -> _Part:
        """The instructions of a part from its results downwards: an order that equal parts
        share."""
        within = set(numbers)
        results = sorted((k for k in numbers if k in is_result), key=self._groups.order_of)
        ordered: list[int] = []
        lines: list[Instruction] = []
        names: dict[Operand, Operand] = {}
        inputs: list[Operand] = []
        seen: set[int] = set()
        stack = [~k for k in reversed(results)]
        while stack:
            k = stack.pop()
            if k < 0:  # its sources come first
                if ~k not in seen:
                    seen.add(~k)
                    stack.append(~k)
                    stack += [~s for s in reversed(self._graph.sources[~k]) if s in within]
                continue
            operation, result, arguments = self._graph.code.body[k]
            renamed = []
            for argument in arguments:
                name = names.get(argument)
                if name is None:
                    name = argument
                    if argument[0] != "c":
                        name = names[argument] = ("in", 0, len(inputs))
                        inputs.append(argument)
                renamed.append(name)
            names[result] = ("t", len(lines))
            lines.append(Instruction(operation, ("t", len(lines)), tuple(renamed)))
            ordered.append(k)
        of_results = [names[self._graph.code.body[k].result] for k in results]
        return _Part(ordered, lines, inputs, results, of_results)


def _read_elsewhere(lines: Sequence[Instruction]) -> Iterable[Operand]:
    """The operands that lines read but do not compute."""
    computed = {line.result for line in lines}
    return (a for line in lines for a in line.arguments if a not in computed)


def _bits(mask: int) -> list[int]:
    """The places of the ones of a number."""
    places = []
    while mask:
        lowest = mask & -mask
        places.append(lowest.bit_length() - 1)
        mask ^= lowest
    return places

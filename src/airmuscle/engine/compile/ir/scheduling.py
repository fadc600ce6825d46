"""Scheduling of instructions and conditional blocks: each after its operands and as late as
possible.
"""

import dataclasses
import heapq
from collections.abc import Iterable, Sequence

from ....core import TraceError
from .instructions import CALLED, ZERO, Code, Instruction, Operand

Gates = tuple[Operand, ...]


@dataclasses.dataclass(frozen=True)
class ConditionalBlock:
    """Instructions that are skipped if all gates are zero, and the values of their results in that
    case.
    """

    gates: Gates
    body: tuple[Instruction, ...]
    instead: tuple[tuple[Operand, Operand], ...]


Item = Instruction | ConditionalBlock
_Piece = tuple[Gates, bool]


@dataclasses.dataclass(frozen=True)
class IndependentGroup:
    """Results that need not be computed if their gates are zero, and their known values in that
    case.
    """

    gates: dict[Operand, Gates]
    instead: dict[Operand, Operand]


def in_order(code: Code, apart: IndependentGroup, early: frozenset[Operand]) -> list[Item]:
    """All instructions in their original order as far as operands permit; a block directly precedes
    its first use.

    A value that is computed long before its use would be spilled to memory. Instructions in `early`
    do not share a block with others.
    """
    items = _Pieces(code, apart, early).items()
    owner = {result: k for k, item in enumerate(items) for result in _results(item)}
    waits = [{owner[o] for o in _needs(item) if o in owner} - {k} for k, item in enumerate(items)]
    ahead: list[list[int]] = [[] for _ in items]
    for k, needed in enumerate(waits):
        for j in needed:
            ahead[j].append(k)
    turns = _turns(code, items)
    missing = [len(needed) for needed in waits]
    ready = [(turns[k], k) for k in range(len(items)) if not missing[k]]
    heapq.heapify(ready)
    ordered = []
    while ready:
        _, k = heapq.heappop(ready)
        ordered.append(items[k])
        for j in ahead[k]:
            missing[j] -= 1
            if not missing[j]:
                heapq.heappush(ready, (turns[j], j))
    return ordered


def _results(item: Item) -> list[Operand]:
    return [item.result] if isinstance(item, Instruction) else [line.result for line in item.body]


def _needs(item: Item) -> Iterable[Operand]:
    if isinstance(item, Instruction):
        return item.arguments
    return [
        *item.gates,
        *(v for _, v in item.instead),
        *(a for line in item.body for a in line.arguments),
    ]


def _turns(code: Code, items: Sequence[Item]) -> list[float]:
    """Priority of each item: the original position of an instruction, the position before the first
    use of a block; calls of the C library come first, because values in registers do not survive
    them."""
    place = {line.result: k for k, line in enumerate(code.body)}
    first: dict[Operand, int] = {}
    for k, line in enumerate(code.body):
        for operand in line.arguments:
            first.setdefault(operand, k)
    turns = []
    for item in items:
        if isinstance(item, Instruction):
            turns.append(-1.0 if item.operation in CALLED else float(place[item.result]))
        else:
            last = place[item.body[-1].result]
            turns.append(
                min((first.get(result, last) for result, _ in item.instead), default=last) - 0.5
            )
    return turns


class _Pieces:
    """Partition of the conditional results into as few blocks as their dependences allow."""

    def __init__(self, code: Code, apart: IndependentGroup, early: frozenset[Operand]) -> None:
        self._code = code
        self._apart = apart
        self._early = early
        self._wanted = {operand for _, _, operand in code.outputs} | set(apart.instead.values())
        self._wanted.update(gate for gates in apart.gates.values() for gate in gates)
        self._users: dict[Operand, list[Operand]] = {}
        for line in code.body:
            for operand in line.arguments:
                self._users.setdefault(operand, []).append(line.result)
        self._place = {line.result: k for k, line in enumerate(code.body)}
        self._pending = set(self._place)
        """The results that no item computes as yet."""
        self._blockers: dict[_Piece, Operand] = {}
        """A pending result for which each piece was last found to wait."""

    def items(self) -> list[Item]:
        """All instructions and blocks, in an executable order."""
        items: list[Item] = []
        straight: list[Instruction] = []
        pieces: dict[_Piece, list[Instruction]] = {}
        for line in self._code.body:  # of the same gates, separately for early instructions
            gates = self._apart.gates.get(line.result)
            if gates is None:
                straight.append(line)
            else:
                pieces.setdefault((gates, line.result in self._early), []).append(line)
        while straight or pieces:
            waiting = []
            for line in straight:
                if self._pending.isdisjoint(line.arguments):
                    items.append(line)
                    self._pending.discard(line.result)
                else:
                    waiting.append(line)
            straight = waiting
            ready = self._ready(pieces)
            if not ready and (straight or pieces):
                raise TraceError(
                    "the instructions have a cyclic dependence; this is an error in airmuscle,"
                    " please report it."
                )
            for piece, body in ready:
                items.append(ConditionalBlock(piece[0], tuple(body), self._seen(body)))
                self._pending.difference_update(line.result for line in body)
                pieces[piece] = [line for line in pieces[piece] if line.result in self._pending]
            pieces = {piece: lines for piece, lines in pieces.items() if lines}
        return items

    def _ready(
        self, pieces: dict[_Piece, list[Instruction]]
    ) -> list[tuple[_Piece, list[Instruction]]]:
        """The pieces that are executable completely; if there are none, the executable part of the
        first one.
        """
        executable = [
            (piece, lines) for piece, lines in pieces.items() if self._is_executable(piece, lines)
        ]
        parts = executable or [
            (piece, part) for piece, lines in pieces.items() if (part := self._part(piece, lines))
        ]
        parts.sort(key=lambda entry: self._place[entry[1][0].result])
        return executable or parts[:1]

    def _is_executable(self, piece: _Piece, lines: Sequence[Instruction]) -> bool:
        """Whether all instructions of a piece can be executed now."""
        if self._blockers.get(piece) in self._pending:
            return False
        computed: set[Operand] = set()
        for line in lines:
            for operand in (
                *piece[0],
                self._instead(line),
                *(a for a in line.arguments if a not in computed),
            ):
                if operand in self._pending:
                    self._blockers[piece] = operand
                    return False
            computed.add(line.result)
        return True

    def _part(self, piece: _Piece, lines: Sequence[Instruction]) -> list[Instruction]:
        """The instructions of a piece that can be executed now."""
        computed: set[Operand] = set()
        part = []
        for line in lines:
            if self._pending.isdisjoint(
                (*piece[0], self._instead(line), *(a for a in line.arguments if a not in computed))
            ):
                computed.add(line.result)
                part.append(line)
        return part

    def _instead(self, line: Instruction) -> Operand:
        """The value of a conditional result if its block is skipped."""
        return self._apart.instead.get(line.result, ZERO)

    def _seen(self, body: Sequence[Instruction]) -> tuple[tuple[Operand, Operand], ...]:
        """The results of a block that other instructions use, with their values if the block is
        skipped.
        """
        results = {line.result for line in body}
        return tuple(
            (line.result, self._apart.instead.get(line.result, ZERO))
            for line in body
            if line.result in self._wanted
            or not results.issuperset(self._users.get(line.result, ()))
        )

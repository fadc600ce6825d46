"""Scheduling of instructions and conditional blocks: each after its operands and as late as possible."""

from __future__ import annotations

import dataclasses
import heapq
from collections.abc import Iterable, Sequence

from ...core.errors import TraceError
from .instructions import CALLED, Code, Instruction, Operand

Gates = tuple[Operand, ...]
ZERO = ("c", 0.0)


@dataclasses.dataclass(frozen=True)
class ConditionalBlock:
    """Instructions that are skipped if all gates are zero, and the values of their results in that case."""

    gates: Gates
    body: tuple[Instruction, ...]
    instead: tuple[tuple[Operand, Operand], ...]


Item = Instruction | ConditionalBlock
_Piece = tuple[Gates, bool]


@dataclasses.dataclass(frozen=True)
class IndependentGroup:
    """Results that need not be computed if their gates are zero, and their known values in that case."""

    gates: dict[Operand, Gates]
    instead: dict[Operand, Operand]


def in_order(code: Code, apart: IndependentGroup, early: frozenset[Operand]) -> list[Item]:
    """All instructions in their original order as far as operands permit; a block directly precedes its first use.

    A value that is computed long before its use would be spilled to memory. Instructions in `early` do not share a
    block with others.
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
    return [*item.gates, *(v for _, v in item.instead), *(a for line in item.body for a in line.arguments)]


def _turns(code: Code, items: Sequence[Item]) -> list[float]:
    """Priority of each item: the original position of an instruction, the position before the first use of a block.

    Calls of the C library are executed as early as possible, because values in registers do not survive a call.
    """
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
            turns.append(min((first.get(result, last) for result, _ in item.instead), default=last) - 0.5)
    return turns


class _Pieces:
    """Partition of the conditional results into as few blocks as their dependences allow."""

    def __init__(self, code: Code, apart: IndependentGroup, early: frozenset[Operand]) -> None:
        self._code, self._apart, self._early = code, apart, early
        self._wanted = {operand for _, _, operand in code.outputs} | set(apart.instead.values())
        self._wanted.update(gate for gates in apart.gates.values() for gate in gates)
        self._users: dict[Operand, list[Operand]] = {}
        for line in code.body:
            for operand in line.arguments:
                self._users.setdefault(operand, []).append(line.result)
        self._done: set[Operand] = set()
        self._results = {line.result for line in code.body}

    def items(self) -> list[Item]:
        """All instructions and blocks, in an executable order."""
        items: list[Item] = []
        left = list(self._code.body)
        while left:
            left = self._straight(left, items)
            ready = self._ready(left)
            if left and not ready:
                raise TraceError(
                    "the instructions have a cyclic dependence; this is an error in airmuscle, please report it."
                )
            for (gates, _), body in ready.items():
                items.append(ConditionalBlock(gates, tuple(body), self._seen(body)))
                self._done.update(line.result for line in body)
            left = [line for line in left if line.result not in self._done]
        return items

    def _available(self, operands: Iterable[Operand]) -> bool:
        return all(operand in self._done or operand not in self._results for operand in operands)

    def _straight(self, left: Sequence[Instruction], items: list[Item]) -> list[Instruction]:
        """Append the unconditional instructions whose operands are available; return the remaining ones."""
        waiting = []
        for line in left:
            if line.result in self._apart.gates or not self._available(line.arguments):
                waiting.append(line)
            else:
                items.append(line)
                self._done.add(line.result)
        return waiting

    def _ready(self, left: Sequence[Instruction]) -> dict[_Piece, list[Instruction]]:
        """The blocks that are executable completely; if there are none, the executable part of one block.

        A block contains the remaining instructions with the same gates, separately for early ones.
        """
        rest: dict[_Piece, int] = {}
        parts: dict[_Piece, list[Instruction]] = {}
        within: dict[_Piece, set[Operand]] = {}
        for line in left:
            gates = self._apart.gates.get(line.result)
            if gates is None:
                continue
            piece = gates, line.result in self._early
            rest[piece] = rest.get(piece, 0) + 1
            own = within.setdefault(piece, set())
            instead = self._apart.instead.get(line.result, ZERO)
            if self._available([*gates, instead, *(a for a in line.arguments if a not in own)]):
                own.add(line.result)
                parts.setdefault(piece, []).append(line)
        whole = {piece: body for piece, body in parts.items() if len(body) == rest[piece]}
        return whole or dict(list(parts.items())[:1])

    def _seen(self, body: Sequence[Instruction]) -> tuple[tuple[Operand, Operand], ...]:
        """The results of a block that other instructions use, with their values if the block is skipped."""
        own = {line.result for line in body}
        return tuple(
            (line.result, self._apart.instead.get(line.result, ZERO))
            for line in body
            if line.result in self._wanted or not own.issuperset(self._users.get(line.result, ()))
        )

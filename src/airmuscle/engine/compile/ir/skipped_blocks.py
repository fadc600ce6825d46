"""Sparsity from zero factors: conditional evaluation of instructions that are multiplied by zero.

A *gate* is such a factor: a value that depends on the commands only, the distance of a value from
its clamping interval, or the condition of a selection. If the gate is zero (a clamped value then
equals the unclamped value, and the related comparisons have known results), some results are known
without evaluation, and the instructions that only they use are redundant. These instructions are
collected in blocks that a branch skips.

Evaluation with and without the branch gives the same values, except where a skipped value is not
finite: its product with zero would be NaN and is zero here.
"""

import dataclasses
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

from ....core import Operation
from .instructions import ONE, ZERO, Code, Instruction, Operand
from .scheduling import Gates, IndependentGroup, Item, in_order

STEADY, COMMANDED, VARYING = range(3)
"""Dependence of a value: on parameters only, on commands (and parameters) only, or on states."""
WORTH = 8
WORTH_OF_CHOICES = 30
"""Least cost of the skipped operations for which a branch saves time; greater for conditions on
states (measured).
"""
_SLOW = {Operation.DIVIDE, Operation.INVERSE, Operation.SQRT}
_SIMPLE = {
    Operation.ADD,
    Operation.SUBTRACT,
    Operation.MULTIPLY,
    Operation.NEGATE,
    Operation.SQUARE,
    Operation.TWICE,
    Operation.ABS,
    Operation.LESS_EQUAL,
    Operation.LESS,
    Operation.EQUAL,
    Operation.NOT_EQUAL,
    Operation.NOT,
    Operation.AND,
    Operation.OR,
    Operation.MASK,
    Operation.FMIN,
    Operation.FMAX,
    Operation.SELECT,
    Operation.MAXIMUM,
    Operation.MINIMUM,
}
_KEEP_ZERO = (
    Operation.NEGATE,
    Operation.SQUARE,
    Operation.TWICE,
    Operation.ABS,
    Operation.SQRT,
)
_CHOICES = (Operation.MASK, Operation.SELECT)
_EXTREMES = (Operation.MAXIMUM, Operation.MINIMUM)


@dataclasses.dataclass(frozen=True)
class _Case:
    """Gates, the results that are known if all of them are zero, and the least cost of skipped
    operations.
    """

    gates: Gates
    facts: Mapping[Operand, Operand] = dataclasses.field(default_factory=dict)
    worth: int = dataclasses.field(default_factory=lambda: WORTH)


def skipping(
    code: Code, level: Callable[[Operand], int], early: frozenset[Operand] = frozenset()
) -> list[Item]:
    """The instructions of `code` in an executable order, with those that a zero gate makes
    redundant in blocks.

    `level` classifies an input: STEADY, COMMANDED or VARYING. A result that depends on commands and
    on no varying input may be a gate. Instructions in `early` do not share a block with others, so
    that they can be executed first.
    """
    search = _Search(code, early)
    for case in _cases(code.body, _Comparisons(code.body), level):
        search.set_apart(case)
    return in_order(code, search.apart, early)


def levels_of(body: Sequence[Instruction], level: Callable[[Operand], int]) -> dict[Operand, int]:
    """What the result of each instruction depends on; `level` states it for the inputs."""
    levels: dict[Operand, int] = {}
    for line in body:
        greatest = STEADY
        for operand in line.arguments:
            if operand in levels:
                greatest = max(greatest, levels[operand])
            elif operand[0] != "c":
                greatest = max(greatest, level(operand))
        levels[line.result] = greatest
    return levels


def _cases(
    body: Sequence[Instruction], comparisons: "_Comparisons", level: Callable[[Operand], int]
) -> Iterable[_Case]:
    """The candidate gates: commands first, then clamps and conditions."""
    levels = levels_of(body, level)

    def of(operand: Operand) -> int:
        if operand in levels:
            return levels[operand]
        return STEADY if operand[0] == "c" else level(operand)

    commands: dict[Operand, None] = {}
    clamps: list[_Case] = []
    conditions: dict[Operand, None] = {}
    for line in body:
        if line.operation == Operation.MULTIPLY:
            commands.update((a, None) for a in line.arguments if of(a) == COMMANDED)
        if levels[line.result] < VARYING:
            continue
        if line.operation == Operation.SUBTRACT:
            clamps += comparisons.inside(line)
        if line.operation in _CHOICES and line.arguments[0] in levels:
            conditions[line.arguments[0]] = None
    chosen = (_Case((gate,), worth=WORTH_OF_CHOICES) for gate in conditions)
    return [*(_Case((gate,)) for gate in commands), *clamps, *chosen]


class _Clamp(NamedTuple):
    """A maximum or minimum, and the two operands that are in order where it has no effect."""

    result: Operand
    low: Operand
    high: Operand


class _Comparisons:
    """Results of comparisons that follow if values lie within their clamping intervals."""

    def __init__(self, body: Sequence[Instruction]) -> None:
        self._line = {line.result: line for line in body}
        self._not_above = {
            line.arguments: line.result for line in body if line.operation == Operation.LESS_EQUAL
        }
        self._below = {
            line.arguments: line.result for line in body if line.operation == Operation.LESS
        }

    def inside(self, difference: Instruction) -> list[_Case]:
        """The case of a value within its clamping interval, if `difference` is a value minus its
        clamped value.

        Then low <= high for each of some pairs; high <= low remains undetermined, because both may
        be equal: such a comparison becomes a further gate.
        """
        for number, clamped in (difference.arguments, difference.arguments[::-1]):
            clamps = self._clamps(number, clamped)
            if not clamps:
                continue
            facts: dict[Operand, Operand] = {clamp.result: number for clamp in clamps}
            further: dict[Operand, Operand] = {}
            for _, low, high in clamps:
                if (low, high) in self._not_above:
                    facts[self._not_above[low, high]] = ONE
                if (high, low) in self._below:
                    facts[self._below[high, low]] = ZERO
                if (high, low) in self._not_above:
                    further[self._not_above[high, low]] = ZERO
            return [_Case((difference.result, *further), facts | further)]
        return []

    def _clamps(self, number: Operand, clamped: Operand) -> list[_Clamp]:
        """The clamps from a result down to a number; none if it is not that number, clamped."""
        clamps = []
        while clamped != number and number[0] != "c":
            line = self._line.get(clamped)
            if line is None or line.operation not in _EXTREMES:
                return []
            near = [a for a in line.arguments if a in self._line]
            if number in line.arguments:
                near = [number]
            if not near:
                return []
            inner = near[0]
            bound = line.arguments[line.arguments[0] == inner]
            is_lower = line.operation == Operation.MAXIMUM
            low, high = (bound, inner) if is_lower else (inner, bound)
            clamps.append(_Clamp(clamped, low, high))
            clamped = inner
        return clamps


class _Search:
    """Search for the redundant instructions of each case, if skipping them is worth a branch."""

    def __init__(self, code: Code, early: frozenset[Operand]) -> None:
        self.apart = IndependentGroup({}, {})
        self._early = early
        self._line = {line.result: line for line in code.body}
        self._users: dict[Operand, list[Instruction]] = {}
        for line in code.body:
            for operand in dict.fromkeys(line.arguments):
                self._users.setdefault(operand, []).append(line)
        self._outputs = {operand for _, _, operand in code.outputs}
        self._kept: set[Operand] = set()

    def set_apart(self, case: _Case) -> None:
        """Collect the instructions that are redundant if the gates are zero.

        The gates and the clamped values from which they are computed are always evaluated.
        """
        if any(gate in self.apart.gates for gate in case.gates):
            return
        needed = set(case.gates)
        for operand, value in case.facts.items():
            if value[0] != "c":
                needed.add(operand)
        # early results cannot wait for a gate that is late
        ahead = frozenset() if self._early.issuperset(case.gates) else self._early
        known = self._known(case)
        superfluous, instead = self._superfluous(known, self._kept | needed | ahead)
        saved = sum(_cost(self._line[operand]) for operand in superfluous)
        if saved >= case.worth:
            self._kept |= needed
            self.apart.gates.update(dict.fromkeys(superfluous, case.gates))
            self.apart.instead.update(instead)

    def _known(self, case: _Case) -> dict[Operand, Operand]:
        """Results that equal a constant or another result in this case."""
        known = {**dict.fromkeys(case.gates, ZERO), **case.facts}
        waiting = [line for operand in known for line in self._users.get(operand, ())]
        while waiting:
            line = waiting.pop()
            if line.result not in known and line.result not in self.apart.gates:
                value = _value(line.operation, [known.get(a, a) for a in line.arguments])
                if value is not None:
                    known[line.result] = value
                    waiting += self._users.get(line.result, ())
        return known

    def _superfluous(
        self, known: Mapping[Operand, Operand], needed: set[Operand]
    ) -> tuple[set[Operand], dict[Operand, Operand]]:
        """Redundant results, none of `needed`, given the known ones; the known values of those that
        others use.
        """
        times: dict[Operand, int] = {}

        def asked(operand: Operand, more: int = 0) -> int:
            """Number of uses of a result by instructions that are not redundant."""
            if operand not in times:
                times[operand] = (
                    len(self._users.get(operand, ()))
                    + (operand in needed)
                    + (operand in self._outputs)
                )
            times[operand] += more
            return times[operand]

        named = {o: v for o, v in known.items() if o not in needed and self._worth_naming(o, v)}
        for value in named.values():
            asked(value, 1)
        superfluous: set[Operand] = set()
        waiting = list(named)
        while waiting:
            operand = waiting.pop()
            if operand in superfluous or operand not in self._line or operand in self.apart.gates:
                continue
            superfluous.add(operand)
            for argument in dict.fromkeys(self._line[operand].arguments):
                if not asked(argument, -1):
                    waiting.append(argument)
                    if argument in named and not asked(named[argument], -1):
                        waiting.append(named[argument])
        return superfluous, {o: v for o, v in named.items() if asked(o)}

    def _worth_naming(self, operand: Operand, value: Operand) -> bool:
        """Whether a known result is useful: a sum that equals one of its terms is cheaper to
        compute.
        """
        if operand not in self._line or operand in self.apart.gates:
            return False
        return value[0] == "c" or self._line[operand].operation == Operation.SELECT


def _cost(line: Instruction) -> int:
    return 1 if line.operation in _SIMPLE else 8 if line.operation in _SLOW else 20


def _value(operation: Operation, x: Sequence[Operand]) -> Operand | None:
    """The result of an operation if it is a constant or an operand for any value of the others;
    else None.
    """
    first = x[0]
    last = x[-1]
    match operation:
        case Operation.MULTIPLY | Operation.AND:
            return _product(first, last)
        case Operation.ADD if ZERO in x:
            return last if first == ZERO else first
        case Operation.SUBTRACT if first == last:
            return ZERO
        case Operation.SUBTRACT if last == ZERO:
            return first
        case Operation.NOT:
            return {ZERO: ONE, ONE: ZERO}.get(first)
        case Operation.MASK:
            return _choice(first, last, ZERO)
        case Operation.SELECT:
            return _choice(*x)
    if first == ZERO and (operation == Operation.DIVIDE or operation in _KEEP_ZERO):
        return ZERO
    return first if operation in _EXTREMES and first == last else None


def _product(first: Operand, last: Operand) -> Operand | None:
    if ZERO in (first, last):
        return ZERO
    if first == ONE:
        return last
    return first if last == ONE else None


def _choice(condition: Operand, when_true: Operand, when_false: Operand) -> Operand | None:
    if condition == ZERO:
        return when_false
    return when_true if condition == ONE or when_true == when_false else None

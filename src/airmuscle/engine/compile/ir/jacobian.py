"""Exact derivatives of a list of instructions, by elimination on its graph.

Every instruction is a vertex, every dependence an edge with a local partial derivative. A vertex v
between p and s is eliminated by c_sp += c_sv c_vp; finally, all edges lead from inputs to results.
The next vertex is always one with the fewest products (Markowitz criterion), which requires fewer
operations than the forward or reverse mode.

Reference: Griewank, A., Walther, A., Evaluating Derivatives, 2nd ed., SIAM 2008, chapters 9 and 10.
"""

import heapq
from collections.abc import Callable, Iterable, Sequence

from ....core import TraceError
from .instructions import ONE, ZERO, Instruction, Operand, Operation

Row = dict[Operand, Operand]
"""The derivatives of one result with respect to the inputs on which it depends."""
LESS, TWO, HALF = (("c", value) for value in (-1.0, 2.0, 0.5))
_COMMUTE = (Operation.ADD, Operation.MULTIPLY)
_CONDITIONS = (
    Operation.LESS_EQUAL,
    Operation.LESS,
    Operation.EQUAL,
    Operation.NOT_EQUAL,
    Operation.NOT,
    Operation.AND,
    Operation.OR,
)


class Tape:
    """Instruction list under construction, with elimination of common subexpressions and trivial
    products.
    """

    def __init__(self, body: Iterable[Instruction]) -> None:
        self.body = list(body)
        self._known: dict[tuple[Operation, tuple[Operand, ...]], Operand] = {}
        self._masks: set[Operand] = set()
        for line in self.body:
            self._note(line)

    def _note(self, line: Instruction) -> None:
        self._known[line.operation, line.arguments] = line.result
        product = line.operation == Operation.MASK and line.arguments[1] in self._masks
        if line.operation in _CONDITIONS or product:
            self._masks.add(line.result)

    def put(self, operation: Operation, *arguments: Operand) -> Operand:
        """The result of an operation; the instruction is appended unless it exists already."""
        if operation in _COMMUTE and (operation, arguments[::-1]) in self._known:
            arguments = arguments[::-1]
        if (operation, arguments) not in self._known:
            result = ("t", "d", len(self.body))
            self.body.append(Instruction(operation, result, arguments))
            self._note(self.body[-1])
        return self._known[operation, arguments]

    def add(self, a: Operand, b: Operand) -> Operand:
        """a + b."""
        return a if b == ZERO else b if a == ZERO else self.put(Operation.ADD, a, b)

    def negative(self, a: Operand) -> Operand:
        """-a."""
        return ("c", -a[1]) if a[0] == "c" else self.put(Operation.NEGATE, a)

    def times(self, a: Operand, b: Operand) -> Operand:
        """a b; a product with a condition is a mask, so that an infinite slope in an unselected
        branch is masked.
        """
        if b[0] == "c" or (a[0] != "c" and b in self._masks):
            a, b = b, a
        if a[0] == b[0] == "c":
            return ("c", a[1] * b[1])
        if a in (ZERO, ONE, LESS):
            return ZERO if a == ZERO else b if a == ONE else self.negative(b)
        return self.put(Operation.MASK if a in self._masks else Operation.MULTIPLY, a, b)

    def inverse(self, a: Operand) -> Operand:
        """1/a."""
        return self.put(Operation.INVERSE, a)


Rule = Callable[[Tape, tuple[Operand, ...], Operand], tuple[Operand, ...]]


def _power(t: Tape, x: tuple[Operand, ...], r: Operand) -> tuple[Operand, ...]:
    base, exponent = x
    less = ("c", exponent[1] - 1.0) if exponent[0] == "c" else t.add(exponent, LESS)
    by_base = t.times(exponent, t.put(Operation.POWER, base, less))
    return by_base, ZERO if exponent[0] == "c" else t.times(r, t.put(Operation.LOG, base))


def _root_of_one_more(t: Tape, x: Operand, sign: Operand, shift: Operand) -> Operand:
    """1/sqrt(shift + sign x^2)."""
    square = t.times(sign, t.put(Operation.SQUARE, x))
    return t.inverse(t.put(Operation.SQRT, t.add(shift, square)))


def _chosen(t: Tape, first: Operand) -> tuple[Operand, ...]:
    return first, t.put(Operation.NOT, first)


_RULES: dict[Operation, Rule] = {
    Operation.ADD: lambda t, x, r: (ONE, ONE),
    Operation.SUBTRACT: lambda t, x, r: (ONE, LESS),
    Operation.MULTIPLY: lambda t, x, r: (x[1], x[0]),
    Operation.DIVIDE: lambda t, x, r: (t.inverse(x[1]), t.negative(t.times(r, t.inverse(x[1])))),
    Operation.NEGATE: lambda t, x, r: (LESS,),
    Operation.SQUARE: lambda t, x, r: (t.put(Operation.TWICE, x[0]),),
    Operation.TWICE: lambda t, x, r: (TWO,),
    Operation.INVERSE: lambda t, x, r: (t.negative(t.put(Operation.SQUARE, r)),),
    Operation.SQRT: lambda t, x, r: (t.times(HALF, t.inverse(r)),),
    Operation.ABS: lambda t, x, r: (t.put(Operation.SIGN, x[0]),),
    Operation.EXP: lambda t, x, r: (r,),
    Operation.LOG: lambda t, x, r: (t.inverse(x[0]),),
    Operation.SIN: lambda t, x, r: (t.put(Operation.COS, x[0]),),
    Operation.COS: lambda t, x, r: (t.negative(t.put(Operation.SIN, x[0])),),
    Operation.TAN: lambda t, x, r: (t.add(ONE, t.put(Operation.SQUARE, r)),),
    Operation.ATAN: lambda t, x, r: (t.inverse(t.add(ONE, t.put(Operation.SQUARE, x[0]))),),
    Operation.SINH: lambda t, x, r: (t.put(Operation.COSH, x[0]),),
    Operation.COSH: lambda t, x, r: (t.put(Operation.SINH, x[0]),),
    Operation.TANH: lambda t, x, r: (t.add(ONE, t.negative(t.put(Operation.SQUARE, r))),),
    Operation.ASINH: lambda t, x, r: (_root_of_one_more(t, x[0], ONE, ONE),),
    Operation.ASIN: lambda t, x, r: (_root_of_one_more(t, x[0], LESS, ONE),),
    Operation.ACOS: lambda t, x, r: (t.negative(_root_of_one_more(t, x[0], LESS, ONE)),),
    Operation.LOG1P: lambda t, x, r: (t.inverse(t.add(ONE, x[0])),),
    Operation.EXPM1: lambda t, x, r: (t.add(ONE, r),),
    Operation.POWER: _power,
    Operation.CONSTANT_POWER: _power,
    Operation.FMAX: lambda t, x, r: _chosen(t, t.put(Operation.LESS_EQUAL, x[1], x[0])),
    Operation.FMIN: lambda t, x, r: _chosen(t, t.put(Operation.LESS_EQUAL, x[0], x[1])),
    Operation.MASK: lambda t, x, r: (ZERO, x[0]),
    Operation.SELECT: lambda t, x, r: (ZERO, x[0], t.put(Operation.NOT, x[0])),
    Operation.ASSIGN: lambda t, x, r: (ONE,),
    **{
        operation: lambda t, x, r: (ZERO,) * len(x)
        for operation in (*_CONDITIONS, Operation.SIGN, Operation.FLOOR)
    },
}


def derivatives(tape: Tape, results: Sequence[Operand], inputs: Sequence[Operand]) -> list[Row]:
    """The derivatives of results with respect to inputs, whose instructions are appended to the
    tape.

    Vertices of equal cost are eliminated in the order of the instructions or in reverse order,
    whichever requires fewer operations. Raises TraceError for an operation without a
    differentiation rule.
    """
    tries = [Tape(tape.body), Tape(tape.body)]
    candidates = [
        _eliminated(one, results, inputs, sign) for one, sign in zip(tries, (1, -1), strict=True)
    ]
    best = min((0, 1), key=lambda i: len(tries[i].body))
    vars(tape).update(vars(tries[best]))
    return candidates[best]


def nonzeros(
    tape: Tape, results: Sequence[Operand], inputs: Sequence[Operand]
) -> dict[tuple[int, int], Operand]:
    """The derivatives of results with respect to inputs that are not zero, by row and column."""
    rows = derivatives(tape, results, inputs)
    return {(i, j): row[x] for i, row in enumerate(rows) for j, x in enumerate(inputs) if x in row}


def _eliminated(
    tape: Tape, results: Sequence[Operand], inputs: Sequence[Operand], sign: int
) -> list[Row]:
    into, out = _graph(tape, set(results), set(inputs))
    ends = {("end", i): r for i, r in enumerate(results)}
    for end, result in ends.items():
        if result in into or result in set(inputs):
            into[end] = {result: ONE}
            out.setdefault(result, set()).add(end)
    order = {line.result: sign * number for number, line in enumerate(tape.body)}

    def entry(vertex: Operand) -> tuple[int, int, Operand]:
        return len(into[vertex]) * len(out.get(vertex, ())), order[vertex], vertex

    queue = [entry(v) for v in into if v not in ends]
    heapq.heapify(queue)
    while queue:
        current = heapq.heappop(queue)
        vertex = current[2]
        if vertex in into and current == entry(vertex):
            row = into.pop(vertex)
            targets = sorted(out.pop(vertex, ()), key=str)
            for source in row:
                out[source].discard(vertex)
            for target in targets:
                factor = into[target].pop(vertex)
                for source, partial in row.items():
                    into[target][source] = tape.add(
                        into[target].get(source, ZERO), tape.times(factor, partial)
                    )
                    out[source].add(target)
            for changed in {*row, *targets}:
                if changed in order and changed in into:
                    heapq.heappush(queue, entry(changed))
    return [into.get(end, {}) for end in ends]


def _graph(
    tape: Tape, results: set[Operand], inputs: set[Operand]
) -> tuple[dict[Operand, Row], dict[Operand, set[Operand]]]:
    """Incoming edges of every vertex that depends on an input and affects a result, and the
    successors of each.
    """
    moved = set(inputs)
    needed = set(results)
    lines = list(tape.body)
    for line in lines:
        if any(a in moved for a in line.arguments):
            moved.add(line.result)
    into: dict[Operand, Row] = {}
    out: dict[Operand, set[Operand]] = {}
    for line in reversed(lines):
        if line.result not in needed or line.result not in moved:
            continue
        needed.update(line.arguments)
        if line.operation not in _RULES:
            raise TraceError(
                f"operation {line.operation.name} has no derivative; write the law over"
                " airmuscle.core.ops."
            )
        row: Row = {}
        partials = _RULES[line.operation](tape, line.arguments, line.result)
        for argument, partial in zip(line.arguments, partials, strict=True):
            if argument in moved and partial != ZERO:
                row[argument] = tape.add(row.get(argument, ZERO), partial)
        if row:
            into[line.result] = row
            for argument in row:
                out.setdefault(argument, set()).add(line.result)
    return into, out

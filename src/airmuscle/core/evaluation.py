"""Recorded expressions as functions of numbers and of whole arrays of points.

A function is interpreted at first, and printed as Python text once it is called often: to print and
to compile the text takes the time of some hundred interpretations. NumPy needs about a microsecond
for an operation of few points, so that what depends on numbers alone is computed with numbers.
"""

import functools
import math
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from .errors import TraceError
from .nodes import CONSTANT, Node, in_order
from .operations import OF_NUMBERS, Operation

PRINTED_AFTER = 20
"""Calls after which a function is printed (chosen)."""
Vector = Sequence[Any]
"""Numbers, or arrays of equal shape with a number for each point."""


def _condition(holds: Any) -> Any:
    """1 or 0 where a condition holds at all points or at none, as do most of those for what lies
    beyond a validity range; else 1 or 0 for each point.
    """
    count = np.count_nonzero(holds)
    if count == 0:
        return 0.0
    return 1.0 if count == np.size(holds) else holds * 1.0


def _mask(condition: Any, x: Any) -> Any:
    if isinstance(condition, np.ndarray) and condition.ndim:
        return np.where(condition, x, 0.0)
    return x if condition else 0.0


def _select(condition: Any, x: Any, y: Any) -> Any:
    if isinstance(condition, np.ndarray) and condition.ndim:
        return np.where(condition, x, y)
    return x if condition else y


# Operations of arrays. Conditions are numbers, 1 or 0, because laws multiply by them.
OF_ARRAYS: dict[Operation, Callable[..., Any]] = {
    Operation.NEGATE: np.negative,
    Operation.INVERSE: lambda x: np.divide(1.0, x),
    Operation.TWICE: lambda x: x + x,
    Operation.SQUARE: lambda x: x * x,
    Operation.DIVIDE: np.divide,
    Operation.MULTIPLY: np.multiply,
    Operation.ADD: np.add,
    Operation.SUBTRACT: np.subtract,
    Operation.SQRT: np.sqrt,
    Operation.ABS: np.abs,
    Operation.SIN: np.sin,
    Operation.COS: np.cos,
    Operation.TAN: np.tan,
    Operation.ASIN: np.arcsin,
    Operation.ACOS: np.arccos,
    Operation.ATAN: np.arctan,
    Operation.SINH: np.sinh,
    Operation.COSH: np.cosh,
    Operation.TANH: np.tanh,
    Operation.ASINH: np.arcsinh,
    Operation.EXP: np.exp,
    Operation.LOG: np.log,
    Operation.EXPM1: np.expm1,
    Operation.LOG1P: np.log1p,
    Operation.POWER: np.power,
    Operation.SIGN: np.sign,
    Operation.FLOOR: np.floor,
    Operation.FMIN: np.fmin,
    Operation.FMAX: np.fmax,
    Operation.LESS: lambda x, y: _condition(np.less(x, y)),
    Operation.LESS_EQUAL: lambda x, y: _condition(np.less_equal(x, y)),
    Operation.EQUAL: lambda x, y: _condition(np.equal(x, y)),
    Operation.NOT_EQUAL: lambda x, y: _condition(np.not_equal(x, y)),
    Operation.NOT: lambda x: _condition(np.equal(x, 0.0)),
    Operation.AND: lambda x, y: _condition(np.logical_and(x, y)),
    Operation.OR: lambda x, y: _condition(np.logical_or(x, y)),
    Operation.MASK: _mask,
    Operation.SELECT: _select,
}
_FAST_NUMBERS: dict[Operation, Callable[..., float]] = {
    **OF_NUMBERS,
    Operation.NEGATE: operator.neg,
    Operation.DIVIDE: operator.truediv,
    Operation.INVERSE: lambda x: 1.0 / x,
    Operation.MULTIPLY: operator.mul,
    Operation.ADD: operator.add,
    Operation.SUBTRACT: operator.sub,
}
"""Operations of numbers that raise an ArithmeticError or ValueError outside their domain."""


class Recorded:
    """A function of vectors of symbols, evaluated at numbers or at arrays of points.

    inputs     the symbols of each argument
    outputs    the expressions of each result
    """

    def __init__(self, inputs: Sequence[Sequence[Node]], outputs: Sequence[Sequence[Node]]) -> None:
        self.inputs = [list(vector) for vector in inputs]
        self.outputs = [list(vector) for vector in outputs]
        self.roots = [node for vector in self.outputs for node in vector]
        self.ordered = in_order(self.roots)
        self.place = {
            id(node): (i, k)
            for i, vector in enumerate(self.inputs)
            for k, node in enumerate(vector)
        }
        self._evaluators: dict[Any, _Evaluator] = {}
        for node in self.ordered:
            if not node.arguments and id(node) not in self.place:
                raise TraceError(f"the symbol {node} is no argument of the recorded function.")

    def at_numbers(self, *vectors: Vector) -> list[list[float]]:
        """The results at numbers."""
        try:
            values = self._evaluator(frozenset())(vectors)
        except (ArithmeticError, ValueError):  # NaN or infinity, of which the module math has none
            with np.errstate(all="ignore"):
                of_numpy = [list(map(np.float64, vector)) for vector in vectors]
                values = self._evaluator(None)(of_numpy)
        return self._split([float(value) for value in values])

    def at_points(self, *vectors: Vector) -> list[list[Any]]:
        """The results at arrays of points; one that depends on no array may be a number."""
        varying = frozenset(
            i
            for i, vector in enumerate(vectors)
            if any(isinstance(value, np.ndarray) and value.ndim for value in vector)
        )
        with np.errstate(all="ignore"):
            try:
                return self._split(self._evaluator(varying)(vectors))
            except (ArithmeticError, ValueError):  # of what depends on numbers alone
                return self._split(self._evaluator(None)(vectors))

    def _split(self, values: Sequence[Any]) -> list[list[Any]]:
        parts = []
        start = 0
        for vector in self.outputs:
            parts.append(list(values[start : start + len(vector)]))
            start += len(vector)
        return parts

    def _evaluator(self, varying: frozenset[int] | None) -> "_Evaluator":
        """The evaluator for arrays in these arguments; None for NumPy's operations throughout."""
        if varying not in self._evaluators:
            arrays = range(len(self.inputs)) if varying is None else varying
            self._evaluators[varying] = _Evaluator(self, frozenset(arrays))
        return self._evaluators[varying]


class _Evaluator:
    """All results of a recorded function, for arrays in some of its arguments."""

    def __init__(self, function: Recorded, arrays: frozenset[int]) -> None:
        self.function = function
        self._calls = 0
        self._evaluate: Callable[[Sequence[Vector]], Sequence[Any]] | None = None
        self.beside = _of_arrays(function, arrays)

    def __call__(self, vectors: Sequence[Vector]) -> Sequence[Any]:
        self._calls += 1
        if self._evaluate is None:
            self._evaluate = _interpreted(self.function, self.beside)
        if self._calls == PRINTED_AFTER:
            self._evaluate = _printed(self.function, self.beside)
        return self._evaluate(vectors)


def _of_arrays(function: Recorded, arrays: frozenset[int]) -> set[int]:
    """The identities of the nodes that are arrays if these arguments are."""
    beside: set[int] = set()
    for node in function.ordered:
        if not node.arguments:
            place = function.place.get(id(node))
            if place is not None and place[0] in arrays:
                beside.add(id(node))
        elif any(id(argument) in beside for argument in node.arguments):
            beside.add(id(node))
    return beside


def _form_of_constants(node: Node, of_arrays: bool) -> Callable[[float], Any]:
    """The form of the constants of an operation: NumPy converts a number each time that it is
    combined with an array, which takes as long as the operation."""
    return np.array if of_arrays and node.operation in _INFIX else float


class _Step(NamedTuple):
    operation: Callable[..., Any]
    target: int
    sources: tuple[int, ...]
    released: tuple[int, ...]
    """Registers that no later step reads: their memory is used again while it is cached."""


def _interpreted(
    function: Recorded, beside: set[int]
) -> Callable[[Sequence[Vector]], Sequence[Any]]:
    """The function whose operations are called one after the other."""
    register: dict[int, int] = {}
    start: list[Any] = []
    inputs: list[tuple[int, int, int]] = []
    steps: list[_Step] = []

    def place_of(node: Node, form: Callable[[float], Any] = float) -> int:
        if node.operation != CONSTANT:
            return register[id(node)]
        start.append(form(node.value))
        return len(start) - 1

    for node in function.ordered:
        if not node.arguments:
            argument, element = function.place[id(node)]
            inputs.append((len(start), argument, element))
        else:
            of_arrays = id(node) in beside
            form = _form_of_constants(node, of_arrays)
            sources = tuple(place_of(argument, form) for argument in node.arguments)
            table = OF_ARRAYS if of_arrays else _FAST_NUMBERS
            steps.append(_Step(table[node.operation], len(start), sources, ()))
        register[id(node)] = len(start)
        start.append(None)
    roots = [place_of(root) for root in function.roots]
    program = _with_releases(steps, set(roots))

    def evaluate(vectors: Sequence[Vector]) -> Sequence[Any]:
        values = start.copy()
        for target, argument, element in inputs:
            values[target] = vectors[argument][element]
        for operation, target, sources, released in program:
            values[target] = operation(*[values[source] for source in sources])
            for place in released:
                values[place] = None
        return [values[place] for place in roots]

    return evaluate


def _with_releases(steps: Sequence[_Step], roots: set[int]) -> list[_Step]:
    """The steps with the registers that each is the last one to read."""
    used = set(roots)
    program = []
    for step in reversed(steps):
        released = tuple(set(step.sources) - used)
        used.update(step.sources)
        program.append(step._replace(released=released))
    return program[::-1]


# Printing

_INFIX = {
    Operation.ADD: "+",
    Operation.SUBTRACT: "-",
    Operation.MULTIPLY: "*",
    Operation.DIVIDE: "/",
}
_FORMS = {
    Operation.NEGATE: "-{0}",
    Operation.INVERSE: "1.0 / {0}",
    Operation.TWICE: "{0} + {0}",
    Operation.SQUARE: "{0} * {0}",
}
_NUMBER_FORMS = {
    Operation.MASK: "{1} if {0} else 0.0",
    Operation.SELECT: "{1} if {0} else {2}",
    Operation.LESS: "1.0 if {0} < {1} else 0.0",
    Operation.LESS_EQUAL: "1.0 if {0} <= {1} else 0.0",
    Operation.EQUAL: "1.0 if {0} == {1} else 0.0",
    Operation.NOT_EQUAL: "1.0 if {0} != {1} else 0.0",
    Operation.NOT: "0.0 if {0} else 1.0",
    Operation.AND: "1.0 if {0} and {1} else 0.0",
    Operation.OR: "1.0 if {0} or {1} else 0.0",
}


@functools.cache
def _names() -> dict[str, Any]:
    """The functions that a printed text calls: `a_` those of arrays, `n_` those of numbers."""
    space: dict[str, Any] = {"inf": math.inf, "nan": math.nan}
    for prefix, table in (("a_", OF_ARRAYS), ("n_", _FAST_NUMBERS)):
        for operation, function in table.items():
            name = operation.name.lower()
            space[f"{prefix}{name}"] = function
    return space


def _text(node: Node, names: Mapping[int, str]) -> str:
    if node.operation != CONSTANT:
        return names[id(node)]
    return f"({node.value!r})" if node.value < 0 else repr(node.value)


def _line(node: Node, texts: Sequence[str], of_arrays: bool) -> str:
    """The right side of the assignment of a node."""
    operation = node.operation
    if operation in _INFIX:
        left, right = texts
        return f"{left} {_INFIX[operation]} {right}"
    form = _FORMS.get(operation)
    if form is None and not of_arrays:
        form = _NUMBER_FORMS.get(operation)
    if form is not None:
        return form.format(*texts)
    prefix = "a_" if of_arrays else "n_"
    arguments = ", ".join(texts)
    return f"{prefix}{operation.name.lower()}({arguments})"


def _printed(function: Recorded, beside: set[int]) -> Callable[[Sequence[Vector]], Sequence[Any]]:
    """The function as Python text."""
    return _Text(function, beside).compiled()


class _Text:
    """The text of a recorded function.

    The name of a value is used again after its last use: its array is freed while it is cached.
    """

    def __init__(self, function: Recorded, beside: set[int]) -> None:
        self._function = function
        self._beside = beside
        self._names: dict[int, str] = {}
        self._constants: dict[float, str] = {}
        self._free: list[str] = []
        self._lines: list[str] = []
        self._variables = 0
        self._last = self._last_uses()

    def _last_uses(self) -> dict[int, int]:
        """The node that reads each node last; of a result, none."""
        last: dict[int, int] = {}
        for node in self._function.ordered:
            last.update((id(argument), id(node)) for argument in node.arguments)
        for root in self._function.roots:
            last.pop(id(root), None)
        return last

    def compiled(self) -> Callable[[Sequence[Vector]], Sequence[Any]]:
        """The function of the text."""
        source = self._source()
        space = dict(_names())
        for value, name in self._constants.items():
            space[name] = np.array(value)
        exec(compile(source, "<recorded function>", "exec"), space)
        evaluate: Callable[[Sequence[Vector]], Sequence[Any]] = space["evaluate"]
        return evaluate

    def _source(self) -> str:
        function = self._function
        for node in function.ordered:
            if node.arguments:
                self._append(node)
            else:
                argument, element = function.place[id(node)]
                self._names[id(node)] = f"x{argument}[{element}]"
        head = ["def evaluate(vectors):"]
        if function.inputs:
            vectors = "".join(f"x{i}, " for i in range(len(function.inputs)))
            head.append(f"    {vectors} = vectors")
        results = "".join(f"{_text(root, self._names)}, " for root in function.roots)
        return "\n".join([*head, *self._lines, f"    return ({results})"])

    def _append(self, node: Node) -> None:
        """Append the assignment of a node."""
        of_arrays = id(node) in self._beside
        form = _form_of_constants(node, of_arrays)
        texts = [self._operand(argument, form) for argument in node.arguments]
        self._release(node)
        name = self._free.pop() if self._free else self._new_name()
        self._names[id(node)] = name
        self._lines.append(f"    {name} = {_line(node, texts, of_arrays)}")

    def _release(self, node: Node) -> None:
        """Let the names of the values that a node is the last to read be used again."""
        for identity in {id(argument) for argument in node.arguments}:
            name = self._names.get(identity, "")
            if self._last.get(identity) == id(node) and name.startswith("v"):
                self._free.append(name)

    def _operand(self, argument: Node, form: Callable[[float], Any]) -> str:
        if argument.operation == CONSTANT and form is np.array:
            return self._constants.setdefault(argument.value, f"c{len(self._constants)}")
        return _text(argument, self._names)

    def _new_name(self) -> str:
        self._variables += 1
        return f"v{self._variables - 1}"

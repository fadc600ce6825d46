"""Types of the variables of a kernel: numbers, integers, flags, and arrays of them, inferred from
their use.
"""

import ast
import dataclasses
import enum
from collections.abc import Callable, Iterator, Mapping

from .source import KernelSource


class ElementType(enum.IntEnum):
    """Types of one value."""

    FLAG = 0
    INTEGER = 1
    NUMBER = 2


@dataclasses.dataclass(frozen=True)
class VariableType:
    """Type of a variable: that of its elements, and its number of dimensions (0 for one value)."""

    scalar: ElementType
    rank: int = 0


@dataclasses.dataclass(frozen=True)
class TypedKernel:
    """A function of a kernel module with the types of its variables.

    returns  types of its results
    written  arguments whose elements it changes
    calls    the printed functions that it calls, by name
    of       the type of an expression
    called   arguments that are functions of a system, such as its rates: they are called by name
    """

    source: KernelSource
    kinds: Mapping[str, VariableType]
    returns: tuple[ElementType, ...]
    written: frozenset[str]
    calls: "Mapping[str, TypedKernel]"
    of: Callable[[ast.expr], ElementType]
    called: frozenset[str] = frozenset()

    @property
    def arguments(self) -> list[str]:
        """Names of the arguments of the printed function."""
        return [name for name in self.source.arguments if name not in self.called]

    def given(self, call: ast.Call) -> dict[str, ast.expr]:
        """What a call gives for these arguments."""
        values = dict(zip(self.source.arguments, call.args, strict=True))
        return {name: values[name] for name in self.arguments}

    @property
    def changed(self) -> list[str]:
        """Names of the arguments whose elements it changes."""
        return [name for name in self.source.arguments if name in self.written]

    @property
    def returned_names(self) -> list[str] | None:
        """The names of the results, if every return statement returns the same variables."""
        results = [ast.unparse(n.value) for n in returns_of(self.source) if n.value]
        names = results[0].strip("()").split(", ") if results else []
        return (
            names if len(set(results)) <= 1 and all(name.isidentifier() for name in names) else None
        )


SAME_TYPE = ("min", "max", "abs")
"""Functions whose result has the type of their arguments."""


def invoked(call: ast.expr) -> tuple[str, list[ast.expr], int] | None:
    """The function of a system that `invoke` calls, its arguments, and how many of them, the last
    ones, it writes.
    """
    match call:
        case ast.Call(
            func=ast.Name(id="invoke"), args=[ast.Name(id=name), ast.Tuple(elts=arguments)]
        ):
            arrays = [
                argument.args[0] if isinstance(argument, ast.Call) else argument
                for argument in arguments
            ]
            return name, arrays, 2 if name == "jac" else 1
    return None


def returns_of(source: KernelSource) -> list[ast.Return]:
    """The return statements of a function."""
    return [node for node in ast.walk(source.node) if isinstance(node, ast.Return)]


def pairs(node: ast.Assign) -> list[tuple[ast.expr, ast.expr | None]]:
    """Targets and values of an assignment; of several results of one call the values are None."""
    target = node.targets[0]
    if not isinstance(target, ast.Tuple):
        return [(target, node.value)]
    if isinstance(node.value, ast.Tuple):
        return list(zip(target.elts, node.value.elts, strict=True))
    return [(element, None) for element in target.elts]


def indices(node: ast.Subscript) -> list[ast.expr]:
    """The indices of an element."""
    return node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]


class _Inference:
    """Types of one function, by the rules: what is an index is an integer, another argument is a
    number, and a local variable has the type of what is assigned to it."""

    def __init__(self, source: KernelSource, calls: Mapping[str, TypedKernel]) -> None:
        self.source = source
        self.calls = calls
        self.ranks, self.integers, self.written = (
            dict.fromkeys(source.arguments, 0),
            set[str](),
            set[str](),
        )
        self.flags, self.called = set[str](), set[str]()
        names = {
            n.id
            for n in ast.walk(source.node)
            if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
        }
        self.locals = dict.fromkeys(names - {*source.arguments}, ElementType.FLAG)

    def typed(self) -> TypedKernel:
        """The function with its types."""
        known = -1
        while known != len(self.integers):
            known = len(self.integers)
            for node in ast.walk(self.source.node):
                self._use(node)
        before: dict[str, ElementType] | None = None
        while before != self.locals:
            before = dict(self.locals)
            for node in ast.walk(self.source.node):
                self._assign(node)
        kinds = {name: VariableType(scalar) for name, scalar in self.locals.items()}
        for name in self.source.arguments:
            element = self._name(name) if name not in self.locals else ElementType.FLAG
            kinds[name] = VariableType(
                max(element, self.locals.get(name, element)), self.ranks[name]
            )
        return TypedKernel(
            self.source,
            kinds,
            self._returns(),
            frozenset(self.written),
            self.calls,
            self.of,
            frozenset(self.called),
        )

    def _returns(self) -> tuple[ElementType, ...]:
        results = [
            n.value.elts if isinstance(n.value, ast.Tuple) else [n.value]
            for n in returns_of(self.source)
            if n.value
        ]
        if len({len(values) for values in results}) > 1:
            raise self.source.unprintable(
                self.source.node, "a function with different numbers of results"
            )
        return tuple(max(map(self.of, values)) for values in zip(*results, strict=True))

    def _use(self, node: ast.AST) -> None:
        """Learn from an element, a range or a call which arguments are arrays and integers, and
        which are changed.
        """
        if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name):
            self._rank(node.value.id, len(indices(node)))
            for index in indices(node):
                self._index(index)
            if isinstance(node.ctx, ast.Store):
                self.written.add(node.value.id)
        elif isinstance(node, ast.Assign):
            for target, value in pairs(node):
                if value and isinstance(target, ast.Name) and target.id in self.integers:
                    self._index(value)
        elif isinstance(node, ast.For) and isinstance(node.iter, ast.Call):
            for bound in node.iter.args:
                self._index(bound)
        elif isinstance(node, ast.Call):
            self._call(node)
        elif isinstance(node, ast.If | ast.While) and isinstance(node.test, ast.Name):
            self.flags.add(node.test.id)

    def _call(self, node: ast.Call) -> None:
        if isinstance(node.func, ast.Name) and node.func.id in self.calls:
            called = self.calls[node.func.id]
            for name, argument in zip(called.source.arguments, node.args, strict=True):
                if name in called.called:
                    self.called.add(ast.unparse(argument))
                else:
                    self._given(argument, called.kinds[name], name in called.written)
        elif system := invoked(node):
            name, arrays, results = system
            self.called.add(name)
            numbers = VariableType(ElementType.NUMBER, 1)
            first_result = len(arrays) - results
            for i, array in enumerate(arrays):
                if isinstance(array, ast.Name | ast.Subscript):
                    self._given(array, numbers, i >= first_result)

    def _given(self, node: ast.expr, kind: VariableType, written: bool) -> None:
        inner = node
        further = 0
        if isinstance(node, ast.Subscript):
            inner = node.value
            further = len(indices(node))
        if isinstance(inner, ast.Name) and kind.rank:
            self._rank(inner.id, kind.rank + further)
            if written:
                self.written.add(inner.id)
        if kind.scalar == ElementType.INTEGER:
            self._index(node)
        elif kind.scalar == ElementType.FLAG and isinstance(node, ast.Name):
            self.flags.add(node.id)

    def _rank(self, name: str, rank: int) -> None:
        if name in self.ranks:
            self.ranks[name] = max(self.ranks[name], rank)

    def _index(self, node: ast.expr) -> None:
        """What an index is computed of is an integer."""
        if isinstance(node, ast.Name):
            self.integers.add(node.id)
        elif isinstance(node, ast.Subscript):
            self._index(node.value)
        elif isinstance(node, ast.BinOp):
            self._index(node.left)
            self._index(node.right)

    def _assign(self, node: ast.AST) -> None:
        match node:
            case ast.For(target=ast.Name(id=name)):
                self.locals[name] = ElementType.INTEGER
            case ast.AugAssign(target=ast.Name(id=name), value=value):
                self._learn(name, self.of(value))
            case ast.Assign():
                for i, (target, part) in enumerate(pairs(node)):
                    if isinstance(target, ast.Name):
                        scalar = self.of(part) if part else self._result(node.value, i)
                        self._learn(target.id, scalar)

    def _learn(self, name: str, scalar: ElementType) -> None:
        self.locals[name] = max(scalar, self.locals.get(name, scalar))

    def _result(self, call: ast.expr, i: int) -> ElementType:
        if (
            isinstance(call, ast.Call)
            and isinstance(call.func, ast.Name)
            and call.func.id in self.calls
        ):
            return self.calls[call.func.id].returns[i]
        raise self.source.unprintable(call, "an assignment to several variables")

    def of(self, node: ast.expr) -> ElementType:
        """The type of an expression."""
        match node:
            case (
                ast.Compare()
                | ast.BoolOp()
                | ast.UnaryOp(op=ast.Not())
                | ast.Constant(value=bool())
            ):
                return ElementType.FLAG
            case ast.Constant(value=int()):
                return ElementType.INTEGER
            case ast.Name(id=name):
                return self._name(name)
            case ast.Subscript(value=ast.Name(id=name)):
                return ElementType.INTEGER if name in self.integers else ElementType.NUMBER
            case ast.UnaryOp(operand=operand):
                return self.of(operand)
            case ast.BinOp(left=left, right=right, op=operator):
                number = isinstance(operator, ast.Div | ast.Pow)
                return ElementType.NUMBER if number else max(self.of(left), self.of(right))
            case ast.IfExp(body=first, orelse=second):
                return max(self.of(first), self.of(second))
            case (
                ast.Subscript(value=ast.Attribute(attr="shape")) | ast.Call(func=ast.Name(id="int"))
            ):
                return ElementType.INTEGER
            case ast.Call(func=ast.Name(id=name), args=arguments) if name in SAME_TYPE:
                return max(self.of(argument) for argument in arguments)
            case ast.Call(func=ast.Name(id=name)) if name in self.calls:
                return self._result(node, 0)
        return ElementType.NUMBER

    def _name(self, name: str) -> ElementType:
        if name in self.locals and name not in self.ranks:
            return self.locals[name]
        if isinstance(self.source.constants.get(name), int) or name in self.integers:
            return ElementType.INTEGER
        return ElementType.FLAG if name in self.flags else ElementType.NUMBER


def stored_names(nodes: list[ast.stmt]) -> Iterator[str]:
    """Names of variables and arrays to which statements write, once for each assignment."""
    for node in (inner for statement in nodes for inner in ast.walk(statement)):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id
        elif (
            isinstance(node, ast.Subscript)
            and isinstance(node.ctx, ast.Store)
            and isinstance(node.value, ast.Name)
        ):
            yield node.value.id


def typed(source: KernelSource, calls: Mapping[str, TypedKernel]) -> TypedKernel:
    """The types of a function; `calls` are the functions that it calls."""
    return _Inference(source, calls).typed()

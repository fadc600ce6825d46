"""Printer of kernels: the walk through statements and expressions that all languages share."""

import abc
import ast
import math
from collections.abc import Iterator, Mapping, Sequence

from .expressions import ExpressionPrinter
from .source import KernelSource, read_kernels
from .types import TypedKernel, invoked, pairs, stored_names, typed

WIDTH = 108
"""Characters in a line, less the indentation of inner blocks."""


class KernelPrinter(ExpressionPrinter):
    """Text of functions of kernels in a language; a subclass states what its language writes.

    The functions that a printed function calls are printed before it.
    """

    branch = "{} ({}) {{"
    otherwise = "} else {"
    close = "}"
    """Begin, middle and end of a branch, if or while."""
    remark = "// {}"
    """A comment at the end of a line."""
    end = ";"
    continuation = ""
    """What ends a statement of one word, and a line that goes on in the next."""
    prefix = ""
    """Beginning of the names of the functions of the system that kernels call."""

    def text(self, module: str, names: Sequence[str]) -> str:
        """The functions of a module of `compile/kernels/` with these names, and the constants that
        they use.

        Raises TraceError, with file and line, for a construct that has no printed form.
        """
        return self.printed(self.typed(module, names))

    def typed(self, module: str, names: Sequence[str]) -> dict[str, TypedKernel]:
        """These functions with their types, each after those that it calls."""
        self.kernels: dict[str, TypedKernel] = {}
        for name in names:
            self._add(read_kernels(module), name)
        return self.kernels

    def printed(self, kernels: dict[str, TypedKernel]) -> str:
        """Text of typed functions, each after those that it calls, and the constants that they
        use.
        """
        bodies = [self.function(kernel) for kernel in kernels.values()]
        return "\n".join([*self.constants(kernels), *bodies])

    def _add(self, sources: dict[str, KernelSource], name: str) -> None:
        if name in self.kernels:
            return
        source = sources[name]
        for node in ast.walk(source.node):
            called = (
                node.func.id
                if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
                else ""
            )
            if (module := source.imported.get(called, "calls")) != "calls":
                self._add(
                    read_kernels(module) if f"{module}.py" != source.file else sources, called
                )
        self.kernels[name] = typed(source, self.kernels)

    def constants(self, kernels: dict[str, TypedKernel]) -> list[str]:
        """Lines that define the finite constants of the functions."""
        used = {
            name: value
            for kernel in kernels.values()
            for name, value in used_constants(kernel).items()
        }
        known = [name for kernel in kernels.values() for name in kernel.source.constants]
        used = {name: used[name] for name in dict.fromkeys(known) if name in used}
        return [*(self.constant(name, value) for name, value in used.items()), ""] if used else []

    def function(self, kernel: TypedKernel) -> str:
        """The text of one function."""
        self.kernel = kernel
        self.source = kernel.source
        self.begin()
        first, *rest = self.head()
        lines = [*self.comment(self.source.description), *self._wrapped(first), *rest]
        return "\n".join([*lines, *indented(self.block(self.source.body)), self.close, ""])

    def _wrapped(self, line: str) -> list[str]:
        """A line, divided after arguments where it is too long."""
        at = line.rfind(", ", 0, WIDTH) + 1 if len(line) > WIDTH else 0
        return (
            [line[:at] + self.continuation, *self._wrapped("    " + line[at + 1 :])]
            if at > 5
            else [line]
        )

    def bound_call(
        self, kernel: TypedKernel, texts: Mapping[str, str], results: Sequence[str]
    ) -> str:
        """A call from a template: its arguments are texts, or variables of the same name; `results`
        are variables.
        """
        return self.lines(self.called_with(kernel, texts, results))

    def lines(self, line: str) -> str:
        """A line of a template, divided where it is too long."""
        return "\n".join(self._wrapped(line))

    # What a language writes

    @abc.abstractmethod
    def called_with(
        self, kernel: TypedKernel, given: Mapping[str, str], results: Sequence[str]
    ) -> str:
        """The statement of a call; arguments and results as of `bound_call`."""

    @abc.abstractmethod
    def workspace(self, arrays: Mapping[str, Sequence[str]]) -> str:
        """The declarations of arrays of these sizes."""

    @abc.abstractmethod
    def constant(self, name: str, value: float) -> str:
        """The line that defines a constant."""

    @abc.abstractmethod
    def comment(self, lines: Sequence[str]) -> list[str]:
        """The comment before a function."""

    @abc.abstractmethod
    def head(self) -> list[str]:
        """The first lines of a function."""

    @abc.abstractmethod
    def assign(self, target: ast.expr, value: ast.expr, node: ast.stmt) -> list[str]:
        """The lines that assign a value."""

    @abc.abstractmethod
    def invoke(self, name: str, given: Sequence[ast.expr], results: int) -> str:
        """The line of a call of a function of the system, of whose arguments the last ones are
        `results`.
        """

    @abc.abstractmethod
    def finish(self, values: Sequence[ast.expr], last: bool) -> list[str]:
        """The lines that return values; `last`: at the end of the function."""

    @abc.abstractmethod
    def loop(self, variable: str, first: str, limit: ast.expr) -> str:
        """The line that begins a loop from `first` to before `limit`."""

    @abc.abstractmethod
    def begin(self) -> None:
        """Prepare for the function `self.kernel`."""

    # Statements

    def block(self, nodes: Sequence[ast.stmt]) -> list[str]:
        """The lines of statements."""
        lines: list[str] = []
        for node in nodes:
            if hasattr(node, "body"):
                lines += self.statement(node)
                continue
            lines += [part for line in self.statement(node) for part in self._wrapped(line)]
            if remark := self.source.comments.get(node.end_lineno or 0):
                lines[-1] += f"  {self.remark.format(remark)}"
        return lines

    def statement(self, node: ast.stmt) -> list[str]:
        """The lines of a statement."""
        match node:
            case ast.Assign(targets=[ast.Tuple(elts=elements)], value=ast.Call() as call):
                return self.call_lines(call, elements, node)
            case ast.Assign(targets=[_]):
                return [
                    line
                    for pair in self._checked_pairs(node)
                    for line in self._assigned(*pair, node)
                ]
            case ast.AugAssign(target=target, op=operator, value=value):
                loaded = ast.parse(ast.unparse(target), mode="eval").body
                return self.assign(
                    target, ast.copy_location(ast.BinOp(loaded, operator, value), node), node
                )
            case ast.Expr(value=ast.Call() as call) if system := invoked(call):
                return [self.invoke(*system)]
            case ast.Expr(value=ast.Call() as call):
                return self.call_lines(call, [], node)
            case ast.Return(value=value):
                last = node is self.source.node.body[-1]
                values = (
                    [] if value is None else value.elts if isinstance(value, ast.Tuple) else [value]
                )
                return self.finish(values, last)
            case ast.If() | ast.While(orelse=[]) | ast.For(orelse=[]):
                return self.compound(node)
            case ast.Break() | ast.Continue():
                return [f"{ast.unparse(node)}{self.end}"]
        raise self.source.unprintable(node, f"the statement {type(node).__name__}")

    def call_lines(self, call: ast.Call, targets: Sequence[ast.expr], node: ast.stmt) -> list[str]:
        """The lines of a call of a printed function as a statement, with the targets of its
        results.
        """
        called = self.kernel.calls.get(ast.unparse(call.func))
        if called is None:
            raise self.source.unprintable(call, f"the function {ast.unparse(call.func)}")
        if any(
            self.kernel.of(target) != kind
            for target, kind in zip(targets, called.returns, strict=False)
        ):
            raise self.source.unprintable(call, "a result of another type than its variable")
        texts = {name: self.expression(value) for name, value in called.given(call).items()}
        return [self.called_with(called, texts, list(map(self.expression, targets)))]

    def _checked_pairs(self, node: ast.Assign) -> Iterator[tuple[ast.expr, ast.expr]]:
        """Targets and values, which must not read a target before them."""
        before: set[str] = set()
        for target, value in pairs(node):
            assert value is not None
            if before & {n.id for n in ast.walk(value) if isinstance(n, ast.Name)}:
                raise self.source.unprintable(
                    node, "an assignment that reads a variable which it changes"
                )
            before |= set(stored_names([ast.Assign([target], value)]))
            yield target, value

    def _assigned(self, target: ast.expr, value: ast.expr, node: ast.stmt) -> list[str]:
        if (
            isinstance(value, ast.Call)
            and isinstance(value.func, ast.Name)
            and value.func.id in self.kernel.calls
        ):
            return self.call_lines(value, [target], node)
        return self.assign(target, value, node)

    def compound(self, node: ast.If | ast.While | ast.For) -> list[str]:
        """The lines of a branch or a loop."""
        if isinstance(node, ast.For):
            lines = [self._for(node)]
        else:
            lines = [
                self.branch.format(
                    "if" if isinstance(node, ast.If) else "while", self.expression(node.test)
                )
            ]
        lines += indented(self.block(node.body))
        if node.orelse:
            lines += [self.otherwise, *indented(self.block(node.orelse))]
        return [*lines, self.close]

    def _for(self, node: ast.For) -> str:
        if (
            not isinstance(node.target, ast.Name)
            or ast.unparse(node.iter).partition("(")[0] != "range"
        ):
            raise self.source.unprintable(node.iter, "a loop over something else than a range")
        assert isinstance(node.iter, ast.Call)
        if len(node.iter.args) > 2:
            raise self.source.unprintable(node.iter, "a range with a step")
        variable = node.target.id
        if {variable, *_bounds(node.iter)} & {*stored_names(node.body)}:
            raise self.source.unprintable(
                node.iter, "a loop that changes its variable or its range"
            )
        if self._is_used_outside(variable):
            raise self.source.unprintable(node.target, "the variable of a loop outside it")
        first = self.expression(node.iter.args[0]) if len(node.iter.args) > 1 else "0"
        return self.loop(self.name(variable), first, node.iter.args[-1])

    def _is_used_outside(self, variable: str) -> bool:
        """Whether the function uses the variable of a loop outside of the loops over it."""
        inside = 0
        for node in ast.walk(self.source.node):
            if isinstance(node, ast.For) and ast.unparse(node.target) == variable:
                inside += _uses(variable, node)
        return _uses(variable, self.source.node) != inside


def _uses(name: str, root: ast.AST) -> int:
    """How often a name stands in a part of the source."""
    names = [node.id for node in ast.walk(root) if isinstance(node, ast.Name)]
    return names.count(name)


def _bounds(range_of_loop: ast.expr) -> list[str]:
    """The variables in a range, apart from arrays whose size it states."""
    nodes = list(ast.walk(range_of_loop))
    sizes = [
        node.value for node in nodes if isinstance(node, ast.Attribute) and node.attr == "shape"
    ]
    return [node.id for node in nodes if isinstance(node, ast.Name) and node not in sizes]


def used_constants(kernel: TypedKernel) -> dict[str, float]:
    """The finite constants that a function uses."""
    names = {n.id for n in ast.walk(kernel.source.node) if isinstance(n, ast.Name)} - {
        *kernel.kinds
    }
    return {
        name: value
        for name, value in kernel.source.constants.items()
        if name in names and math.isfinite(value)
    }


def indented(lines: Sequence[str]) -> list[str]:
    """Lines of an inner block."""
    return ["  " + line for line in lines]

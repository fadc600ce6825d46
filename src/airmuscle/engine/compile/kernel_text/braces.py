"""Kernels in a language of braces and semicolons, in which a variable is declared at its first assignment."""

from __future__ import annotations

import abc
import ast
import dataclasses
from collections.abc import Mapping, Sequence

from .printer import KernelPrinter
from .source import KernelSource
from .types import TypedKernel, pairs, stored_names


class BraceKernels(KernelPrinter):
    """Kernels in a language of braces; a subclass states how it declares variables and passes results."""

    counter: str
    """How the counter of a loop is declared."""

    @abc.abstractmethod
    def declaration(self, name: str, constant: bool) -> str:
        """What stands before the first assignment of a variable, which is the only one of a constant."""

    def begin(self) -> None:
        self._places = declarations(self.source, self.kernel)

    @property
    def early(self) -> list[str]:
        """The variables that are declared at the beginning of the function."""
        return list(self._places.early)

    def declared(self, target: ast.expr, node: ast.stmt, *, constant: bool = True) -> str:
        """The declaration of a target in a statement; empty where it is declared elsewhere."""
        if not isinstance(target, ast.Name) or self._places.at.get(target.id) is not node:
            return ""
        return self.declaration(target.id, constant and target.id in self._places.constant)

    def element(self, array: ast.Name, at: Sequence[ast.expr]) -> str:
        return self.name(array.id) + "".join(f"[{self.expression(index)}]" for index in at)

    def conditional(self, node: ast.IfExp) -> str:
        return f"{self.expression(node.test, 1)} ? {self.expression(node.body, 1)} : {self.expression(node.orelse)}"

    def assign(self, target: ast.expr, value: ast.expr, node: ast.stmt) -> list[str]:
        left = self.expression(target)
        if isinstance(node, ast.AugAssign):
            counts = isinstance(node.op, ast.Add) and ast.unparse(node.value) == "1"
            return [f"{left}++;" if counts else f"{left} = {self.expression(value)};"]
        return [f"{self.declared(target, node)}{left} = {self.expression(value)};"]

    def invoke(self, name: str, given: Sequence[ast.expr], results: int) -> str:
        return f"{self.prefix}{name}({self.joined(given)});"

    def loop(self, variable: str, first: str, limit: ast.expr) -> str:
        bound = self.expression(limit, 5)
        return f"for ({self.counter} {variable} = {first}; {variable} < {bound}; {variable}++) {{"

    def branch(self, word: str, test: str) -> str:
        return f"{word} ({test}) {{"


@dataclasses.dataclass(frozen=True)
class Declarations:
    """Places of declarations.

    at        the assignment that declares a variable, by name
    early     variables that are declared at the beginning of the function
    constant  variables that are assigned once
    """

    at: Mapping[str, ast.stmt]
    early: Sequence[str]
    constant: frozenset[str]


def declarations(source: KernelSource, kernel: TypedKernel) -> Declarations:
    """The declarations of the local variables: at the first assignment, if its block contains every use."""
    stored = list(stored_names(source.body))
    loops = {ast.unparse(node.target) for node in ast.walk(source.node) if isinstance(node, ast.For)}
    local = [name for name in dict.fromkeys(stored) if name not in source.arguments and name not in loops]
    places = {name: _place(name, source.body) for name in local}
    at = {name: node for name, node in places.items() if node is not None}
    once = frozenset(name for name in at if stored.count(name) == 1)
    return Declarations(at, [name for name in local if name not in at], once)


def _mentions(name: str, node: ast.AST) -> bool:
    return any(isinstance(n, ast.Name) and n.id == name for n in ast.walk(node))


def _place(name: str, block: Sequence[ast.stmt]) -> ast.stmt | None:
    """The statement of a block, or of a block within it, that declares a variable; None if there is none."""
    first, *others = [node for node in block if _mentions(name, node)]
    if isinstance(first, ast.Assign):
        targets = [target.id for target, _ in pairs(first) if isinstance(target, ast.Name)]
        return first if name in targets and not _mentions(name, first.value) else None
    if others or not isinstance(first, ast.If | ast.While | ast.For):
        return None
    inner = [part for part in (first.body, first.orelse) if any(_mentions(name, node) for node in part)]
    head = first.iter if isinstance(first, ast.For) else first.test
    return None if _mentions(name, head) or len(inner) > 1 else _place(name, inner[0])

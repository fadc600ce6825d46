"""Kernels in a language of braces and semicolons, in which a variable is declared at its first assignment."""

from __future__ import annotations

import abc
import ast
from collections.abc import Sequence

from .printer import KernelPrinter
from .scopes import declarations


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

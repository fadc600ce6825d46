"""MATLAB text of kernels, which GNU Octave runs as well: functions that return the arrays that they change."""

from __future__ import annotations

import ast
import math
from collections.abc import Sequence

from .printer import KernelPrinter, used_constants
from .types import TypedKernel

_KEYWORDS = """break case catch classdef continue do else elseif end end_try_catch end_unwind_protect endfor endfunction
endif endswitch endwhile for function global if otherwise parfor persistent return spmd switch try until unwind_protect
while"""


class MatlabKernels(KernelPrinter):
    """Kernels in MATLAB; indices begin with 1, and an array of three dimensions is a row (cell array) of tables."""

    reserved = frozenset(_KEYWORDS.split())
    spelling: dict[type, str] = {ast.NotEq: "~=", ast.Not: "~"}  # noqa: RUF012
    close, otherwise = "end", "else"

    def begin(self) -> None:
        pass  # MATLAB declares no variables

    def constants(self, kernels: dict[str, TypedKernel]) -> list[str]:
        return []  # a constant is a variable of the functions that use it

    def constant(self, name: str, value: float) -> str:
        return f"{name} = {self.number(value)};"

    def comment(self, lines: Sequence[str]) -> list[str]:
        return [f"% {line}".rstrip() for line in lines]

    def remark(self, text: str) -> str:
        return f"% {text}"

    def head(self) -> list[str]:
        results = self._results(self.kernel)
        names = results[0] if len(results) == 1 else f"[{', '.join(results)}]"
        given = ", ".join(map(self.name, self.source.arguments))
        constants = [f"  {self.constant(name, value)}" for name, value in used_constants(self.kernel).items()]
        return [f"function {f'{names} = ' if results else ''}{self.source.name}({given})", *constants]

    def _results(self, kernel: TypedKernel) -> list[str]:
        """Names of the results of a function, and of the arrays that it changes."""
        names = kernel.returned_names or [f"result_{i}" for i in range(len(kernel.returns))]
        return [self.name(name) for name in (*names, *self._changed(kernel))]

    @staticmethod
    def _changed(kernel: TypedKernel) -> list[str]:
        return [name for name in kernel.source.arguments if name in kernel.written]

    def number(self, value: float) -> str:
        return "Inf" if math.isinf(value) else repr(value).removesuffix(".0")

    def element(self, array: ast.Name, at: Sequence[ast.expr]) -> str:
        places, rank = [self._place(index) for index in at], self.kernel.kinds[array.id].rank
        if rank == 3:
            rest = f"({', '.join([*places[1:], ':'][:2])})" if len(places) > 1 else ""
            return f"{self.name(array.id)}{{{places[0]}}}{rest}"
        return f"{self.name(array.id)}({', '.join([*places, ':'][:rank])})"

    def _place(self, index: ast.expr, shift: int = 1) -> str:
        """An integer plus `shift`: an index that begins with 1, the end of a range with -1."""
        match index:
            case ast.Constant(value=int(value)):
                return str(value + shift)
            case ast.BinOp(left=left, op=ast.Add() | ast.Sub() as sign, right=ast.Constant(value=int(value))):
                shift += value if isinstance(sign, ast.Add) else -value
                index = left
        text = self.expression(index, 5)
        return f"{text} {'+' if shift > 0 else '-'} {abs(shift)}" if shift else text

    def size(self, array: str, dimension: int) -> str:
        rank = self.kernel.kinds[array].rank
        if rank == 3:
            return f"size({self.name(array)}{{1}}, {dimension})" if dimension else f"numel({self.name(array)})"
        return f"size({self.name(array)}, {dimension + 1})" if rank == 2 else f"numel({self.name(array)})"

    def call(self, name: str, arguments: Sequence[ast.expr]) -> str:
        if name in {"min", "max"} and len(arguments) > 2:
            return f"{name}([{self.joined(arguments)}])"
        usual = {"int": "fix", "pow": "power"}.get(name, name.removeprefix("np."))
        return f"{name if name in self.kernel.calls else usual}({self.joined(arguments)})"

    def conditional(self, node: ast.IfExp) -> str:
        raise self.source.unprintable(node, "a conditional value that does not stand alone in an assignment")

    def assign(self, target: ast.expr, value: ast.expr, node: ast.stmt) -> list[str]:
        if not isinstance(value, ast.IfExp):
            return [f"{self.expression(target)} = {self.expression(value)};"]
        branches = [["  " + line for line in self.assign(target, v, node)] for v in (value.body, value.orelse)]
        return [f"if {self.expression(value.test)}", *branches[0], "else", *branches[1], "end"]

    def call_lines(self, call: ast.Call, targets: Sequence[ast.expr], node: ast.stmt) -> list[str]:
        called = self.kernel.calls.get(ast.unparse(call.func))
        if called is None:
            raise self.source.unprintable(call, f"the function {ast.unparse(call.func)}")
        given = dict(zip(called.source.arguments, call.args, strict=True))
        results = [self.expression(each) for each in (*targets, *(given[name] for name in self._changed(called)))]
        text = f"{called.source.name}({self.joined(call.args)});"
        left = results[0] if len(results) == 1 else f"[{', '.join(results)}]"
        return [f"{left} = {text}" if results else text]

    def finish(self, values: Sequence[ast.expr], last: bool) -> list[str]:
        names = [] if self.kernel.returned_names else self._results(self.kernel)
        lines = [f"{name} = {self.expression(value)};" for name, value in zip(names, values, strict=False)]
        return lines if last else [*lines, "return"]

    def word(self, word: str) -> str:
        return word

    def loop(self, variable: str, first: str, limit: ast.expr) -> str:
        return f"for {variable} = {first}:{self._place(limit, -1)}"

    def branch(self, word: str, test: str) -> str:
        return f"{word} {test}"

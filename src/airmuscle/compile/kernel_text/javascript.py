"""JavaScript text of kernels: functions of numbers, typed arrays, and arrays of them."""

from __future__ import annotations

import ast
import math
from collections.abc import Sequence

from .printer import KernelPrinter
from .scopes import declarations

_KEYWORDS = """arguments await break case catch class const continue debugger default delete do else enum eval export
extends finally for function if implements import in instanceof interface let new null package private protected public
return static super switch this throw try typeof undefined var void while with yield"""


class JavaScriptKernels(KernelPrinter):
    """Kernels in JavaScript; several results are an array, and an array of two dimensions is an array of rows."""

    reserved = frozenset(_KEYWORDS.split())
    spelling: dict[type, str] = {ast.Eq: "===", ast.NotEq: "!=="}  # noqa: RUF012

    def begin(self) -> None:
        self._places = declarations(self.source, self.kernel)

    def constant(self, name: str, value: float) -> str:
        return f"const {name} = {self.number(value)};"

    def comment(self, lines: Sequence[str]) -> list[str]:
        if len(lines) < 2:
            return [f"/** {line} */" for line in lines]
        return ["/**", *(f" * {line}".rstrip() for line in lines), " */"]

    def remark(self, text: str) -> str:
        return f"// {text}"

    def head(self) -> list[str]:
        early = [f"  let {', '.join(map(self.name, self._places.early))};"] if self._places.early else []
        return [f"function {self.source.name}({', '.join(map(self.name, self.source.arguments))}) {{", *early]

    def number(self, value: float) -> str:
        return "Infinity" if math.isinf(value) else repr(value).removesuffix(".0")

    def element(self, array: ast.Name, at: Sequence[ast.expr]) -> str:
        return self.name(array.id) + "".join(f"[{self.expression(index)}]" for index in at)

    def size(self, array: str, dimension: int) -> str:
        return f"{self.name(array)}{'[0]' * dimension}.length"

    def call(self, name: str, arguments: Sequence[ast.expr]) -> str:
        usual = "Math.trunc" if name == "int" else f"Math.{name.removeprefix('np.')}"
        return f"{name if name in self.kernel.calls else usual}({self.joined(arguments)})"

    def conditional(self, node: ast.IfExp) -> str:
        return f"{self.expression(node.test, 1)} ? {self.expression(node.body, 1)} : {self.expression(node.orelse)}"

    def assign(self, target: ast.expr, value: ast.expr, node: ast.stmt) -> list[str]:
        left = self.expression(target)
        if isinstance(node, ast.AugAssign):
            counts = isinstance(node.op, ast.Add) and ast.unparse(node.value) == "1"
            return [f"{left}++;" if counts else f"{left} = {self.expression(value)};"]
        return [f"{self._declared(target, node)}{left} = {self.expression(value)};"]

    def _declared(self, target: ast.expr, node: ast.stmt) -> str:
        if not isinstance(target, ast.Name) or self._places.at.get(target.id) is not node:
            return ""
        return "const " if target.id in self._places.constant else "let "

    def call_lines(self, call: ast.Call, targets: Sequence[ast.expr], node: ast.stmt) -> list[str]:
        text = f"{ast.unparse(call.func)}({self.joined(call.args)});"
        if len(targets) < 2:
            return [f"{self._declared(t, node)}{self.expression(t)} = {text}" for t in targets] or [text]
        before = [f"let {self.expression(target)};" for target in targets if self._declared(target, node)]
        return [*before, f"[{self.joined(targets)}] = {text}"]

    def finish(self, values: Sequence[ast.expr], last: bool) -> list[str]:
        if len(values) < 2:
            return [f"return {self.expression(value)};" for value in values] or ["return;"]
        return [f"return [{self.joined(values)}];"]

    def loop(self, variable: str, first: str, limit: ast.expr) -> str:
        return f"for (let {variable} = {first}; {variable} < {self.expression(limit, 5)}; {variable}++) {{"

    def branch(self, word: str, test: str) -> str:
        return f"{word} ({test}) {{"

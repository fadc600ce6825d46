"""JavaScript text of kernels: functions of numbers, typed arrays, and arrays of them."""

from __future__ import annotations

import ast
import math
from collections.abc import Mapping, Sequence

from .braces import BraceKernels
from .types import TypedKernel

_KEYWORDS = """arguments await break case catch class const continue debugger default delete do else enum eval export
extends finally for function if implements import in instanceof interface let new null package private protected public
return static super switch this throw try typeof undefined var void while with yield"""


class JavaScriptKernels(BraceKernels):
    """Kernels in JavaScript; several results are an array, and an array of two dimensions is an array of rows."""

    reserved = frozenset(_KEYWORDS.split())
    spelling: dict[type, str] = {ast.Eq: "===", ast.NotEq: "!=="}  # noqa: RUF012

    counter = "let"

    def declaration(self, name: str, constant: bool) -> str:
        return "const " if constant else "let "

    def constant(self, name: str, value: float) -> str:
        return f"const {name} = {self.number(value)};"

    def comment(self, lines: Sequence[str]) -> list[str]:
        if len(lines) < 2:
            return [f"/** {line} */" for line in lines]
        return ["/**", *(f" * {line}".rstrip() for line in lines), " */"]

    def remark(self, text: str) -> str:
        return f"// {text}"

    def head(self) -> list[str]:
        early = [f"  let {', '.join(map(self.name, self.early))};"] if self.early else []
        return [f"function {self.source.name}({', '.join(map(self.name, self.kernel.arguments))}) {{", *early]

    def number(self, value: float) -> str:
        return "Infinity" if math.isinf(value) else repr(value).removesuffix(".0")

    def size(self, array: str, dimension: int) -> str:
        return f"{self.name(array)}{'[0]' * dimension}.length"

    def call(self, name: str, arguments: Sequence[ast.expr]) -> str:
        usual = "Math.trunc" if name == "int" else f"Math.{name.removeprefix('np.')}"
        return f"{name if name in self.kernel.calls else usual}({self.joined(arguments)})"

    def call_lines(self, call: ast.Call, targets: Sequence[ast.expr], node: ast.stmt) -> list[str]:
        called = self.kernel.calls.get(ast.unparse(call.func))
        given = called.given(call).values() if called else call.args
        text = f"{ast.unparse(call.func)}({self.joined(list(given))});"
        if len(targets) < 2:
            return [f"{self.declared(t, node)}{self.expression(t)} = {text}" for t in targets] or [text]
        before = [f"let {self.expression(target)};" for target in targets if self.declared(target, node)]
        return [*before, f"[{self.joined(targets)}] = {text}"]

    def called_with(self, kernel: TypedKernel, given: Mapping[str, str], results: Sequence[str]) -> str:
        values = ", ".join(given.get(name, name) for name in kernel.arguments)
        left = f"[{', '.join(results)}] = " if results else ""
        return f"{left}{kernel.source.name}({values});"

    def workspace(self, arrays: Mapping[str, Sequence[str]]) -> str:
        return self.lines(", ".join(f"{name}: {_zeros(*sizes)}" for name, sizes in arrays.items()))

    def finish(self, values: Sequence[ast.expr], last: bool) -> list[str]:
        if len(values) < 2:
            return [f"return {self.expression(value)};" for value in values] or ["return;"]
        return [f"return [{self.joined(values)}];"]


def _zeros(size: str, *inner: str) -> str:
    return f"Array.from({{length: {size}}}, () => {_zeros(*inner)})" if inner else f"new Float64Array({size})"

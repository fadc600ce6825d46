"""C99 text of kernels, which is C++ too: static functions of pointers and of tables with a given width."""

from __future__ import annotations

import ast
import math
from collections.abc import Mapping, Sequence

from .braces import BraceKernels
from .types import ElementType, TypedKernel

_KEYWORDS = """auto break case char const continue default do double else enum extern float for goto if inline int long
register restrict return short signed sizeof static struct switch typedef union unsigned void volatile while new delete
class this template typename private public protected operator namespace using try catch throw virtual friend"""
_NAMES = {"abs": "fabs", "np.ceil": "ceil", "np.floor": "floor", "np.sqrt": "sqrt", "np.exp": "exp", "np.log": "log"}


class CKernels(BraceKernels):
    """Kernels in C; the first result is that of the function, the others are written to pointers.

    shapes  sizes of the arrays of several dimensions, by the names of the arguments: ("", "CAPACITY")
    prefix  beginning of the names of the functions of the system
    """

    reserved = frozenset(_KEYWORDS.split())
    spelling: dict[type, str] = {}  # noqa: RUF012

    counter = "int"

    def __init__(self, shapes: Mapping[str, Sequence[str]], prefix: str = "") -> None:
        self.shapes, self.prefix = shapes, prefix

    def declaration(self, name: str, constant: bool) -> str:
        return f"{'const ' if constant else ''}{_type(self.kernel.kinds[name].scalar)} "

    def constant(self, name: str, value: float) -> str:
        return f"static const {'int' if isinstance(value, int) else 'double'} {name} = {value!r};"

    def comment(self, lines: Sequence[str]) -> list[str]:
        return ["/* " + "\n   ".join(lines).rstrip().replace("\n   \n", "\n\n") + " */"] if lines else []

    def remark(self, text: str) -> str:
        return f"/* {text} */"

    def head(self) -> list[str]:
        kernel, returned = self.kernel, self.kernel.returns
        given = [self._argument(name) for name in kernel.arguments]
        given += [f"{_type(kind)} *{self._out(i)}" for i, kind in enumerate(returned) if i]
        text = f"static {_type(returned[0]) if returned else 'void'} {kernel.source.name}({', '.join(given)})"
        return [text, "{", *(f"  {self.declaration(name, False)}{self.name(name)};" for name in self.early)]

    def _argument(self, name: str) -> str:
        kind = self.kernel.kinds[name]
        if not kind.rank:
            return f"{_type(kind.scalar)} {self.name(name)}"
        if kind.rank == 1:
            return f"{'' if name in self.kernel.written else 'const '}{_type(kind.scalar)} *{self.name(name)}"
        if len(self.shapes.get(name, ())) != kind.rank:
            raise self.source.unprintable(self.source.node, f"the array '{name}' without a shape")
        widths = "".join(f"[{width}]" for width in self.shapes[name][1:])
        return f"{_type(kind.scalar)} {self.name(name)}[]{widths}"

    def _out(self, i: int) -> str:
        names = self.kernel.returned_names
        return f"{names[i]}_out" if names else f"result_{i}"

    def number(self, value: float) -> str:
        return "HUGE_VAL" if math.isinf(value) else repr(value)

    def flag(self, value: bool) -> str:
        return "1" if value else "0"

    def size(self, array: str, dimension: int) -> str:
        try:
            return self.shapes[array][dimension] or self.shapes[array][-1]
        except (KeyError, IndexError):
            raise self.source.unprintable(self.source.node, f"the size of '{array}' without a shape") from None

    def call(self, name: str, arguments: Sequence[ast.expr]) -> str:
        if name == "int":
            return f"(int){self.expression(arguments[0], 9)}"
        numbers = any(self.kernel.of(argument) == ElementType.NUMBER for argument in arguments)
        if name in {"min", "max"}:
            return self._extreme(name, arguments, numbers)
        return f"{name if name == 'abs' and not numbers else _NAMES.get(name, name)}({self.joined(arguments)})"

    def _extreme(self, name: str, arguments: Sequence[ast.expr], numbers: bool) -> str:
        first, *others = arguments
        if not others:
            return self.expression(first)
        if numbers:
            rest = self._extreme(name, others, numbers)
            return f"f{name}({self.expression(first)}, {rest})"
        if len(others) > 1:
            raise self.source.unprintable(first, "the extreme of more than two integers")
        a, b = (self.expression(each, 5) for each in arguments)
        return f"({a} {'<' if name == 'min' else '>'} {b} ? {a} : {b})"

    def call_lines(self, call: ast.Call, targets: Sequence[ast.expr], node: ast.stmt) -> list[str]:
        called = self.kernel.calls.get(ast.unparse(call.func))
        if called is None:
            raise self.source.unprintable(call, f"the function {ast.unparse(call.func)}")
        for target, kind in zip(targets, called.returns, strict=False):
            if self.kernel.of(target) != kind:
                raise self.source.unprintable(call, "a result of another type than its variable")
        before = [f"{self.declared(t, node, constant=False)}{self.expression(t)};"
                  for t in targets[1:] if self.declared(t, node)]  # fmt: skip
        given = [*map(self.expression, called.given(call).values()), *(f"&{self.expression(t)}" for t in targets[1:])]
        left = f"{self.declared(targets[0], node)}{self.expression(targets[0])} = " if targets else ""
        return [*before, f"{left}{called.source.name}({', '.join(given)});"]

    def called_with(self, kernel: TypedKernel, given: Mapping[str, str], results: Sequence[str]) -> str:
        values = [given.get(name, name) for name in kernel.arguments] + [f"&{name}" for name in results[1:]]
        return f"{f'{results[0]} = ' if results else ''}{kernel.source.name}({', '.join(values)});"

    def workspace(self, arrays: Mapping[str, Sequence[str]]) -> str:
        texts = [name + "".join(f"[{size}]" for size in sizes) for name, sizes in arrays.items()]
        return self.lines(f"double {', '.join(texts)};") if texts else ""

    def finish(self, values: Sequence[ast.expr], last: bool) -> list[str]:
        lines = [f"*{self._out(i)} = {self.expression(value)};" for i, value in enumerate(values) if i]
        return [*lines, f"return {self.expression(values[0])};"] if values else ["return;"]


def _type(scalar: ElementType) -> str:
    return "double" if scalar == ElementType.NUMBER else "int"

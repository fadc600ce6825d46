"""MATLAB text of kernels, which GNU Octave runs as well: functions that return the arrays that they
change.
"""

import ast
from collections.abc import Mapping, Sequence

from .printer import KernelPrinter, indented, used_constants
from .types import TypedKernel, indices

_KEYWORDS = """break case catch classdef continue do else elseif end end_try_catch end_unwind_protect endfor endfunction
endif endswitch endwhile for function global if otherwise parfor persistent return spmd switch try until unwind_protect
while"""  # noqa: E501


class MatlabKernels(KernelPrinter):
    """Kernels in MATLAB; indices begin with 1, and an array of three dimensions is a row (cell
    array) of tables.

    shapes  sizes of arrays, by the names of the arguments: a loop over all elements of arrays of
            one size, which are columns, is printed as operations on whole arrays
    """

    reserved = frozenset(_KEYWORDS.split())
    spelling: dict[type, str] = {ast.NotEq: "~=", ast.Not: "~"}  # noqa: RUF012
    branch = "{} {}"
    otherwise = "else"
    close = "end"
    remark = "% {}"
    end = ""
    continuation = " ..."
    infinity = "Inf"

    def __init__(self, shapes: Mapping[str, Sequence[str]] | None = None) -> None:
        self.shapes = shapes or {}

    def begin(self) -> None:
        self._counter, self._columns = (
            "",
            set[str](),
        )  # of a loop that is printed as operations on whole arrays

    def constants(self, kernels: dict[str, TypedKernel]) -> list[str]:
        return []  # a constant is a variable of the functions that use it

    def constant(self, name: str, value: float) -> str:
        return f"{name} = {self.number(value)};"

    def comment(self, lines: Sequence[str]) -> list[str]:
        return [f"% {line}".rstrip() for line in lines]

    def head(self) -> list[str]:
        results = self._results(self.kernel)
        names = results[0] if len(results) == 1 else f"[{', '.join(results)}]"
        arguments = ", ".join(map(self.name, self.kernel.arguments))
        constants = [
            f"  {self.constant(name, value)}" for name, value in used_constants(self.kernel).items()
        ]
        return [
            f"function {f'{names} = ' if results else ''}{self.source.name}({arguments})",
            *constants,
        ]

    def _results(self, kernel: TypedKernel) -> list[str]:
        """Names of the results of a function, and of the arrays that it changes."""
        names = kernel.returned_names or [f"result_{i}" for i in range(len(kernel.returns))]
        return [self.name(name) for name in (*names, *kernel.changed)]

    def element(self, array: ast.Name, at: Sequence[ast.expr]) -> str:
        rank = self.kernel.kinds[array.id].rank
        name = self.name(array.id)
        if self._counter and ast.unparse(at[-1]) == self._counter:
            return name if rank == 1 else f"{name}({self._place(at[0])}, :)'"
        first, *further = [self._place(index) for index in at]
        if rank < 3:
            places = [first, *further, ":"]
            return f"{name}({', '.join(places[:rank])})"
        cell = f"{name}{{{first}}}"
        if not further:
            return cell
        places = [*further, ":"]
        return f"{cell}({', '.join(places[:2])})"

    def _place(self, index: ast.expr, shift: int = 1) -> str:
        """An integer plus `shift`: an index that begins with 1, the end of a range with -1."""
        match index:
            case ast.Constant(value=int(value)):
                return str(value + shift)
            case ast.BinOp(
                left=left, op=ast.Add() | ast.Sub() as sign, right=ast.Constant(value=int(value))
            ):
                shift += value if isinstance(sign, ast.Add) else -value
                index = left
        text = self.expression(index, 5)
        return f"{text} {'+' if shift > 0 else '-'} {abs(shift)}" if shift else text

    def size(self, array: str, dimension: int) -> str:
        rank = self.kernel.kinds[array].rank
        if rank == 3:
            return (
                f"size({self.name(array)}{{1}}, {dimension})"
                if dimension
                else f"numel({self.name(array)})"
            )
        return (
            f"size({self.name(array)}, {dimension + 1})"
            if rank == 2
            else f"numel({self.name(array)})"
        )

    def call(self, name: str, arguments: Sequence[ast.expr]) -> str:
        if name in {"min", "max"} and len(arguments) > 2:
            return f"{name}([{self.joined(arguments)}])"
        usual = {"int": "fix", "pow": "power"}.get(name, name.removeprefix("np."))
        return f"{name if name in self.kernel.calls else usual}({self.joined(arguments)})"

    def conditional(self, node: ast.IfExp) -> str:
        raise self.source.unprintable(
            node, "a conditional value that does not stand alone in an assignment"
        )

    def assign(self, target: ast.expr, value: ast.expr, node: ast.stmt) -> list[str]:
        if self._counter:
            return [self._assigned_columns(target, value, node)]
        if not isinstance(value, ast.IfExp):
            return [f"{self.expression(target)} = {self.expression(value)};"]
        when_true = indented(self.assign(target, value.body, node))
        when_false = indented(self.assign(target, value.orelse, node))
        test = self.expression(value.test)
        return [f"if {test}", *when_true, "else", *when_false, "end"]

    def _assigned_columns(self, target: ast.expr, value: ast.expr, node: ast.stmt) -> str:
        """An assignment to all elements of a column, or the sum of its elements."""
        left = self.expression(target)
        if isinstance(target, ast.Name) and isinstance(node, ast.AugAssign):
            return f"{left} = {left} + sum({self.expression(node.value)});"
        if isinstance(target, ast.Name):
            self._columns.add(target.id)
        elif not self._is_column(value):
            left += "(:)"
        return f"{left} = {self.expression(value)};"

    @staticmethod
    def _left(names: Sequence[str]) -> str:
        return (names[0] if len(names) == 1 else f"[{', '.join(names)}]") + " = " if names else ""

    def invoke(self, name: str, arguments: Sequence[ast.expr], results: int) -> str:
        changed = [self.expression(argument) for argument in arguments[-results:]]
        values = self.joined(arguments[:-results])
        return f"{self._left(changed)}{name}({values});"

    # Operations on whole arrays

    def compound(self, node: ast.If | ast.While | ast.For) -> list[str]:
        if not isinstance(node, ast.For) or not self._is_elementwise(node):
            return super().compound(node)
        self._counter = ast.unparse(node.target)
        lines = []
        for inner in node.body:
            lines += self.statement(inner)
        self._counter = ""
        self._columns = set()
        return lines

    def _is_elementwise(self, node: ast.For) -> bool:
        """Whether a loop computes every element of columns of one size from the same elements of
        others.
        """
        counter = ast.unparse(node.target)
        sizes = set()
        for statement in node.body:
            if not isinstance(statement, ast.Assign | ast.AugAssign):
                return False
            for part in ast.walk(statement):
                if isinstance(part, ast.IfExp | ast.BoolOp | ast.Compare):
                    return False
                if isinstance(part, ast.Subscript) and isinstance(part.value, ast.Name):
                    *_, last = map(ast.unparse, indices(part))
                    if last == counter:
                        sizes.add(self.shapes.get(part.value.id, ("",))[-1])
                    elif counter in {n.id for n in ast.walk(part) if isinstance(n, ast.Name)}:
                        return False
        return len(sizes) == 1 and "" not in sizes

    def _is_column(self, node: ast.expr) -> bool:
        names = {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}
        return bool(self._counter) and bool(names & {self._counter, *self._columns})

    def operator(self, text: str, left: ast.expr, right: ast.expr) -> str:
        columns = self._is_column(left), self._is_column(right)
        return (
            f".{text}" if (text == "*" and all(columns)) or (text == "/" and columns[1]) else text
        )

    def called_with(
        self, kernel: TypedKernel, texts: Mapping[str, str], results: Sequence[str]
    ) -> str:
        values = [texts.get(name, name) for name in kernel.arguments]
        changed = [texts.get(name, name) for name in kernel.changed]
        left = self._left([*results, *changed])
        return f"{left}{kernel.source.name}({', '.join(values)});"

    def workspace(self, arrays: Mapping[str, Sequence[str]]) -> str:
        first: dict[str, str] = {}  # of arrays of one size
        texts = []
        for name, sizes in arrays.items():
            value = f"zeros({', '.join([*sizes, '1'][:2])})"
            texts.append(f"{name} = {first.get(value, value)};")
            first.setdefault(value, name)
        return "\n".join(" ".join(texts[i : i + 6]) for i in range(0, len(texts), 6))

    def finish(self, values: Sequence[ast.expr], last: bool) -> list[str]:
        names = [] if self.kernel.returned_names else self._results(self.kernel)
        lines = [
            f"{name} = {self.expression(value)};"
            for name, value in zip(names, values, strict=False)
        ]
        return lines if last else [*lines, "return"]

    def loop(self, variable: str, first: str, limit: ast.expr) -> str:
        return f"for {variable} = {first}:{self._place(limit, -1)}"

"""Kernels in languages of braces, C99 (C++ too) and JavaScript; variables are declared at their
first assignment.
"""

import abc
import ast
import math
from collections.abc import Collection, Mapping, Sequence

from .printer import KernelPrinter
from .types import ElementType, TypedKernel, pairs, stored_names

_JAVASCRIPT_KEYWORDS = """
arguments await break case catch class const continue debugger default delete do else enum eval export extends
finally for function if implements import in instanceof interface let new null package private protected public
return static super switch this throw try typeof undefined var void while with yield"""  # noqa: E501
_C_KEYWORDS = """
auto break case char const continue default do double else enum extern float for goto if inline int long register
restrict return short signed sizeof static struct switch typedef union unsigned void volatile while new delete class
this template typename private public protected operator namespace using try catch throw virtual friend"""  # noqa: E501
_NAMES = {
    "abs": "fabs",
    "np.ceil": "ceil",
    "np.floor": "floor",
    "np.sqrt": "sqrt",
    "np.exp": "exp",
    "np.log": "log",
}


class BraceKernels(KernelPrinter):
    """Kernels in a language of braces; a subclass states how it declares variables and passes
    results.
    """

    counter: str
    """How the counter of a loop is declared."""
    joins_results = False
    """Whether several results of a function are assigned at once."""

    @abc.abstractmethod
    def declaration(self, name: str, constant: bool) -> str:
        """What stands before the first assignment of a variable, which is the only one of a
        constant.
        """

    def begin(self) -> None:
        """Find where local variables are declared: at the first assignment, if its block contains
        every use.
        """
        source = self.source
        stored = list(stored_names(source.body))
        loops = {
            ast.unparse(node.target) for node in ast.walk(source.node) if isinstance(node, ast.For)
        }
        local = [
            name
            for name in dict.fromkeys(stored)
            if name not in source.arguments and name not in loops
        ]
        self._places = {name: _place(name, source.body) for name in local}
        self.early = [name for name, node in self._places.items() if node is None]
        """The variables that are declared at the beginning of the function."""
        self._once = {name for name in local if stored.count(name) == 1}

    def declared(self, target: ast.expr, node: ast.stmt, *, constant: bool = True) -> str:
        """The declaration of a target in a statement; empty where it is declared elsewhere."""
        if not isinstance(target, ast.Name) or self._places.get(target.id) is not node:
            return ""
        return self.declaration(target.id, constant and target.id in self._once)

    def element(self, array: ast.Name, at: Sequence[ast.expr]) -> str:
        return self.name(array.id) + "".join(f"[{self.expression(index)}]" for index in at)

    def conditional(self, node: ast.IfExp) -> str:
        return (
            f"{self.expression(node.test, 1)} ? {self.expression(node.body, 1)} :"
            f" {self.expression(node.orelse)}"
        )

    def assign(self, target: ast.expr, value: ast.expr, node: ast.stmt) -> list[str]:
        left = self.expression(target)
        declaration = ""
        if not isinstance(node, ast.AugAssign):
            declaration = self.declared(target, node)
        elif isinstance(node.op, ast.Add) and ast.unparse(node.value) == "1":
            return [f"{left}++;"]
        right = self.expression(value)
        return [f"{declaration}{left} = {right};"]

    def call_lines(self, call: ast.Call, targets: Sequence[ast.expr], node: ast.stmt) -> list[str]:
        [line] = super().call_lines(call, targets, node)
        early = targets if self.joins_results and len(targets) > 1 else targets[1:]
        before = [
            f"{text}{self.expression(t)};"
            for t in early
            if (text := self.declared(t, node, constant=False))
        ]
        return [
            *before,
            "".join(self.declared(t, node) for t in targets[: len(targets) - len(early)]) + line,
        ]

    def invoke(self, name: str, arguments: Sequence[ast.expr], results: int) -> str:
        return f"{self.prefix}{name}({self.joined(arguments)});"

    def loop(self, variable: str, first: str, limit: ast.expr) -> str:
        test = f"{variable} < {self.expression(limit, 5)}"
        return f"for ({self.counter} {variable} = {first}; {test}; {variable}++) {{"


def _mentions(name: str, node: ast.AST) -> bool:
    return any(isinstance(n, ast.Name) and n.id == name for n in ast.walk(node))


def _place(name: str, block: Sequence[ast.stmt]) -> ast.stmt | None:
    """The statement of a block, or of a block within it, that declares a variable; None if there is
    none.
    """
    first, *further = [node for node in block if _mentions(name, node)]
    if isinstance(first, ast.Assign):
        targets = [target.id for target, _ in pairs(first) if isinstance(target, ast.Name)]
        is_declaration = name in targets and not _mentions(name, first.value)
        return first if is_declaration else None
    if further or not isinstance(first, ast.If | ast.While | ast.For):
        return None
    head = first.iter if isinstance(first, ast.For) else first.test
    if _mentions(name, head):
        return None
    inner = []
    for part in (first.body, first.orelse):
        if any(_mentions(name, node) for node in part):
            inner.append(part)
    return _place(name, inner[0]) if len(inner) == 1 else None


class CKernels(BraceKernels):
    """Kernels in C; the first result is that of the function, the others are written to pointers.

    shapes  sizes of the arrays of several dimensions, by the names of the arguments: ("",
            "CAPACITY")
    prefix  beginning of the names of the functions of the system
    number  type of all numbers, double or float
    tables  arguments of several dimensions that are tables of constants
    """

    reserved = frozenset(_C_KEYWORDS.split())
    spelling: dict[type, str] = {}  # noqa: RUF012
    remark = "/* {} */"
    counter = "int"
    infinity = "HUGE_VAL"
    flags = ("0", "1")

    def __init__(
        self,
        shapes: Mapping[str, Sequence[str]],
        prefix: str = "",
        number: str = "double",
        tables: Collection[str] = (),
    ) -> None:
        self.shapes = shapes
        self.tables = frozenset(tables)
        self.prefix = prefix
        self.type = number
        self.suffix = "f" if number == "float" else ""

    def declaration(self, name: str, constant: bool) -> str:
        return f"{'const ' if constant else ''}{self._type(self.kernel.kinds[name].scalar)} "

    def constant(self, name: str, value: float) -> str:
        kind = "int" if isinstance(value, int) else self.type
        return f"static const {kind} {name} = {self.number(value) if kind == self.type else value};"

    def comment(self, lines: Sequence[str]) -> list[str]:
        return (
            ["/* " + "\n   ".join(lines).rstrip().replace("\n   \n", "\n\n") + " */"]
            if lines
            else []
        )

    def head(self) -> list[str]:
        kernel = self.kernel
        returned = self.kernel.returns
        declarations = [self._argument(name) for name in kernel.arguments]
        declarations += [
            f"{self._type(kind)} *{self._out(i)}" for i, kind in enumerate(returned) if i
        ]
        text = (
            f"static {self._type(returned[0]) if returned else 'void'}"
            f" {kernel.source.name}({', '.join(declarations)})"
        )
        return [
            text,
            "{",
            *(f"  {self.declaration(name, False)}{self.name(name)};" for name in self.early),
        ]

    def _argument(self, name: str) -> str:
        kind = self.kernel.kinds[name]
        scalar = self._type(kind.scalar)
        printed = self.name(name)
        if not kind.rank:
            return f"{scalar} {printed}"
        if kind.rank == 1:
            constant = "" if name in self.kernel.written else "const "
            return f"{constant}{scalar} *{printed}"
        shape = self.shapes.get(name, ())
        if len(shape) != kind.rank:
            raise self.source.unprintable(self.source.node, f"the array '{name}' without a shape")
        widths = "".join(f"[{width}]" for width in shape[1:])
        if name in self.tables and name in self.kernel.written:
            raise self.source.unprintable(self.source.node, f"the constant table '{name}', written")
        constant = "const " if name in self.tables else ""
        return f"{constant}{scalar} {printed}[]{widths}"

    def _type(self, scalar: ElementType) -> str:
        return self.type if scalar == ElementType.NUMBER else "int"

    def _out(self, i: int) -> str:
        names = self.kernel.returned_names
        return f"{names[i]}_out" if names else f"result_{i}"

    def number(self, value: float) -> str:
        return self.infinity if math.isinf(value) else f"{value!r}{self.suffix}"

    def size(self, array: str, dimension: int) -> str:
        try:
            return self.shapes[array][dimension] or self.shapes[array][-1]
        except (KeyError, IndexError):
            raise self.source.unprintable(
                self.source.node, f"the size of '{array}' without a shape"
            ) from None

    def call(self, name: str, arguments: Sequence[ast.expr]) -> str:
        if name == "int":
            return f"(int){self.expression(arguments[0], 9)}"
        numbers = any(self.kernel.of(argument) == ElementType.NUMBER for argument in arguments)
        if name in {"min", "max"}:
            return self._extreme(name, arguments, numbers)
        called = _NAMES.get(name, name)
        suffix = "" if name in self.kernel.calls else self.suffix
        if name == "abs" and not numbers:  # of integers
            called = name
            suffix = ""
        return f"{called}{suffix}({self.joined(arguments)})"

    def _extreme(self, name: str, arguments: Sequence[ast.expr], numbers: bool) -> str:
        first, *further = arguments
        if not further:
            return self.expression(first)
        if numbers:
            rest = self._extreme(name, further, numbers)
            return f"f{name}{self.suffix}({self.expression(first)}, {rest})"
        if len(further) > 1:
            raise self.source.unprintable(first, "the extreme of more than two integers")
        a, b = (self.expression(argument, 5) for argument in arguments)
        comparison = "<" if name == "min" else ">"
        return f"({a} {comparison} {b} ? {a} : {b})"

    def called_with(
        self, kernel: TypedKernel, texts: Mapping[str, str], results: Sequence[str]
    ) -> str:
        values = [texts.get(name, name) for name in kernel.arguments]
        values += [f"&{name}" for name in results[1:]]
        left = f"{results[0]} = " if results else ""
        return f"{left}{kernel.source.name}({', '.join(values)});"

    def workspace(self, arrays: Mapping[str, Sequence[str]]) -> str:
        texts = [name + "".join(f"[{size}]" for size in sizes) for name, sizes in arrays.items()]
        return self.lines(f"{self.type} {', '.join(texts)};") if texts else ""

    def finish(self, values: Sequence[ast.expr], last: bool) -> list[str]:
        lines = [
            f"*{self._out(i)} = {self.expression(value)};" for i, value in enumerate(values) if i
        ]
        return [*lines, f"return {self.expression(values[0])};"] if values else ["return;"]


class JavaScriptKernels(BraceKernels):
    """Kernels in JavaScript; several results are an array, and an array of two dimensions is an
    array of rows.
    """

    reserved = frozenset(_JAVASCRIPT_KEYWORDS.split())
    spelling: dict[type, str] = {ast.Eq: "===", ast.NotEq: "!=="}  # noqa: RUF012
    infinity = "Infinity"
    counter = "let"
    joins_results = True

    def declaration(self, name: str, constant: bool) -> str:
        return "const " if constant else "let "

    def constant(self, name: str, value: float) -> str:
        return f"const {name} = {self.number(value)};"

    def comment(self, lines: Sequence[str]) -> list[str]:
        if len(lines) < 2:
            return [f"/** {line} */" for line in lines]
        return ["/**", *(f" * {line}".rstrip() for line in lines), " */"]

    def head(self) -> list[str]:
        early = [f"  let {', '.join(map(self.name, self.early))};"] if self.early else []
        return [
            f"function {self.source.name}({', '.join(map(self.name, self.kernel.arguments))}) {{",
            *early,
        ]

    def size(self, array: str, dimension: int) -> str:
        return f"{self.name(array)}{'[0]' * dimension}.length"

    def call(self, name: str, arguments: Sequence[ast.expr]) -> str:
        usual = "Math.trunc" if name == "int" else f"Math.{name.removeprefix('np.')}"
        return f"{name if name in self.kernel.calls else usual}({self.joined(arguments)})"

    def called_with(
        self, kernel: TypedKernel, texts: Mapping[str, str], results: Sequence[str]
    ) -> str:
        values = ", ".join(texts.get(name, name) for name in kernel.arguments)
        left = (
            f"[{', '.join(results)}] = "
            if len(results) > 1
            else "".join(f"{result} = " for result in results)
        )
        return f"{left}{kernel.source.name}({values});"

    def workspace(self, arrays: Mapping[str, Sequence[str]]) -> str:
        return self.lines(", ".join(f"{name}: {_zeros(*sizes)}" for name, sizes in arrays.items()))

    def finish(self, values: Sequence[ast.expr], last: bool) -> list[str]:
        if len(values) < 2:
            return [f"return {self.expression(value)};" for value in values] or ["return;"]
        return [f"return [{self.joined(values)}];"]


def _zeros(size: str, *inner: str) -> str:
    return (
        f"Array.from({{length: {size}}}, () => {_zeros(*inner)})"
        if inner
        else f"new Float64Array({size})"
    )

"""Source of kernels: functions and constants of a module of `compile/kernels/` as syntax trees."""

import ast
import contextlib
import dataclasses
import functools
import inspect
import io
import math
import tokenize
from collections.abc import Callable, Mapping
from importlib import resources
from typing import Any

import numpy as np

from ....core import Status, TraceError
from .. import kernel_layout

_PACKAGE = __package__.rpartition(".")[0] + ".kernels"


@dataclasses.dataclass(frozen=True)
class KernelSource:
    """A function of a kernel module.

    constants  values of the constants of its module, by name
    imported   modules of the functions that it may call, by name
    comments   comments by line
    """

    file: str
    node: ast.FunctionDef
    constants: Mapping[str, float]
    imported: Mapping[str, str]
    comments: Mapping[int, str]

    @property
    def name(self) -> str:
        """Name of the function."""
        return self.node.name

    @property
    def arguments(self) -> list[str]:
        """Names of the arguments."""
        return [argument.arg for argument in self.node.args.args]

    @property
    def description(self) -> list[str]:
        """Lines of the docstring."""
        return inspect.cleandoc(ast.get_docstring(self.node) or "").splitlines()

    @property
    def body(self) -> list[ast.stmt]:
        """Statements after the docstring."""
        return self.node.body[1:] if ast.get_docstring(self.node) else self.node.body

    def unprintable(self, node: ast.AST, what: str) -> TraceError:
        """The error of a construct that has no printed form."""
        line = getattr(node, "lineno", self.node.lineno)
        text = f": `{ast.unparse(node)}`" if isinstance(node, ast.expr) else ""
        return TraceError(
            f"{self.file}, line {line}, {self.name}: {what} has no printed form{text}."
        )


def read_kernels(module: str) -> dict[str, KernelSource]:
    """The functions of a module of `compile/kernels/`, by name."""
    text = resources.files(_PACKAGE).joinpath(f"{module}.py").read_text(encoding="utf-8")
    return read_text(text, f"{module}.py")


@functools.lru_cache(maxsize=8)
def read_text(text: str, file: str) -> dict[str, KernelSource]:
    """The functions of the text of a module, by name; `file` is its name in messages."""
    nodes = ast.parse(text).body
    defined = [node for node in nodes if isinstance(node, ast.FunctionDef)]
    imported = {node.name: file.removesuffix(".py") for node in defined}
    for node in nodes:
        if isinstance(node, ast.ImportFrom) and node.level == 1 and node.module:
            imported |= {alias.name: node.module for alias in node.names}
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    comments = {
        t.start[0]: t.string.lstrip("# ")
        for t in tokens
        if t.type == tokenize.COMMENT and t.start[1]
    }
    comments = {
        line: text
        for line, text in comments.items()
        if not text.startswith(("fmt:", "type:", "noqa"))
    }
    return {
        node.name: KernelSource(file, node, _constants(nodes), imported, comments)
        for node in defined
    }


@functools.cache
def plain_kernels(module: str) -> Mapping[str, Callable[..., Any]]:
    """The functions of a module of `compile/kernels/` in plain Python, by name: for few numbers,
    without numba.

    A table is a sequence of rows, which may be mappings from the column."""
    path = resources.files(_PACKAGE).joinpath(f"{module}.py")
    defined = read_kernels(module)
    nodes = ast.parse(path.read_text(encoding="utf-8")).body
    tree = ast.Module(
        [_Plain().visit(node) for node in nodes if isinstance(node, ast.FunctionDef)], []
    )
    names: dict[str, Any] = {"np": math, "sqrt": math.sqrt}
    for source in defined.values():
        names |= source.constants
        for name, module_of_import in source.imported.items():
            if module_of_import != module and name in read_kernels(module_of_import):
                names[name] = plain_kernels(module_of_import)[name]
    exec(compile(ast.fix_missing_locations(tree), str(path), "exec"), names)
    return {name: names[name] for name in defined}


class _Plain(ast.NodeTransformer):
    """Functions without decorators, constants known already, and elements of rows of tables."""

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        node.decorator_list = []
        return self.generic_visit(node)

    def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
        self.generic_visit(node)
        if isinstance(node.slice, ast.Tuple):
            *rows, node.slice = node.slice.elts
            for row in rows:
                node.value = ast.Subscript(node.value, row, ast.Load())
        return node


def _constants(nodes: list[ast.stmt]) -> dict[str, float]:
    """The values of the constants of a module, except those of values that another module
    computes.
    """
    values: dict[str, Any] = {"np": np, "Status": Status, **vars(kernel_layout)}
    for node in nodes:
        if isinstance(node, ast.Assign):
            with contextlib.suppress(NameError):
                exec(compile(ast.Module([node], []), "constants", "exec"), values)
    return {
        name: value
        for name, value in values.items()
        if name.isupper() and isinstance(value, int | float)
    }

"""Scopes of variables: the statements at which a language with blocks declares the variables of a kernel."""

from __future__ import annotations

import ast
import dataclasses
from collections.abc import Mapping, Sequence

from .source import KernelSource
from .types import TypedKernel, pairs, stored_names


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

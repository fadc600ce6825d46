"""Readability of the source: figures that packing cannot improve, none of which may become worse.

Nodes of the syntax tree for each line of code, code beyond column 100, statements that the formatter
leaves alone, parallel assignments, names that say nothing, and functions with many branches.
"""

from __future__ import annotations

import ast
import functools
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[2] / "src" / "airmuscle"
COLUMNS = 100
VAGUE_NAMES = {
    "each",
    "found",
    "own",
    "one",
    "other",
    "others",
    "few",
    "some",
    "kept",
    "held",
    "handed",
    "given",
    "told",
    "ways",
    "whole",
}
BRANCHES = (
    ast.If,
    ast.For,
    ast.While,
    ast.IfExp,
    ast.ExceptHandler,
    ast.comprehension,
    ast.BoolOp,
    ast.match_case,
)
# Each bound is the figure of the tree at the last change of this table, with a margin of 1 %.
# A change that improves a figure lowers its bound; no change raises one.
BOUNDS = {
    "nodes in all": 1_021_000,
    "nodes per line of code": 10.65,
    "% of the lines of code beyond column 100": 0.05,
    "statements that the formatter leaves alone": 2,
    "parallel assignments per 1000 statements": 1.3,
    "names that say nothing per 1000 statements": 7.5,
    "functions with 15 branches": 25,
    "functions with 14 nodes a line": 239,
}


def lines_of_code(text: str, tree: ast.Module) -> list[str]:
    """The lines that are no docstring, import, comment or blank line."""
    left_out: set[int] = set()
    for node in ast.walk(tree):
        is_text = (
            isinstance(node, ast.Expr)
            and isinstance(node.value, ast.Constant)
            and isinstance(node.value.value, str)
        )
        if is_text or isinstance(node, ast.Import | ast.ImportFrom):
            left_out.update(range(node.lineno, node.end_lineno + 1))
    numbered = enumerate(text.splitlines(), 1)
    return [
        line
        for number, line in numbered
        if line.strip() and not line.strip().startswith("#") and number not in left_out
    ]


def is_parallel_assignment(node: ast.AST) -> bool:
    return (
        isinstance(node, ast.Assign)
        and isinstance(node.targets[0], ast.Tuple)
        and isinstance(node.value, ast.Tuple)
    )


def branches(function: ast.AST) -> int:
    return sum(isinstance(node, BRANCHES) for node in ast.walk(function))


def is_dense(function: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    lines = function.end_lineno - function.lineno + 1
    return lines >= 6 and sum(1 for _ in ast.walk(function)) / lines >= 14


@functools.cache
def figures() -> dict[str, float]:
    """The figures of `BOUNDS` for the package as it is."""
    code: list[str] = []
    nodes: list[ast.AST] = []
    unformatted = 0
    for path in sorted(SOURCE.rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        tree = ast.parse(text)
        code += lines_of_code(text, tree)
        nodes += ast.walk(tree)
        unformatted += text.count("fmt: skip") + text.count("fmt: off")
    functions = [node for node in nodes if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
    thousands = sum(isinstance(node, ast.stmt) for node in nodes) / 1000
    vague = sum(isinstance(node, ast.Name) and node.id in VAGUE_NAMES for node in nodes)
    return {
        "nodes in all": len(nodes),
        "nodes per line of code": len(nodes) / len(code),
        "% of the lines of code beyond column 100": 100
        * sum(len(line) > COLUMNS for line in code)
        / len(code),
        "statements that the formatter leaves alone": unformatted,
        "parallel assignments per 1000 statements": sum(map(is_parallel_assignment, nodes))
        / thousands,
        "names that say nothing per 1000 statements": vague / thousands,
        "functions with 15 branches": sum(branches(function) >= 15 for function in functions),
        "functions with 14 nodes a line": sum(map(is_dense, functions)),
    }


@pytest.mark.parametrize("figure", BOUNDS)
def test_no_figure_of_readability_becomes_worse(figure: str):
    assert figures()[figure] <= BOUNDS[figure]

"""Blocks of code of the documentation, and the alternatives that their comments give."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

ALTERNATIVE = re.compile(r"#\s*or\s+(?P<code>.+)")


def python_blocks(page: Path) -> list[str]:
    """The blocks of Python of a page."""
    return re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)


def comments(block: str) -> Iterator[tuple[int, str]]:
    """The line and the text of each comment."""
    for token in tokenize.generate_tokens(io.StringIO(block).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string


def is_expression(text: str) -> bool:
    """Whether a text is an expression with a call, and not a word."""
    try:
        tree = ast.parse(text, mode="eval")
    except SyntaxError:
        return False
    return any(isinstance(node, ast.Call) for node in ast.walk(tree))


def alternatives(block: str) -> list[str]:
    """The block with the value of an assignment replaced by the alternative in its comment, `x =
    f()  # or g()`, one for each such comment."""
    statements = ast.parse(block).body
    replaced = []
    for line, comment in comments(block):
        match = ALTERNATIVE.match(comment)
        if match is None or not is_expression(match["code"]):
            continue
        (statement,) = (each for each in statements if each.lineno <= line <= each.end_lineno)
        assert isinstance(statement, ast.Assign), f"no assignment before {comment}"
        value = statement.value
        lines = block.splitlines(keepends=True)
        before = "".join(lines[: value.lineno - 1]) + lines[value.lineno - 1][: value.col_offset]
        after = lines[value.end_lineno - 1][value.end_col_offset :]
        rest = "".join(lines[value.end_lineno :])
        replaced.append(before + match["code"] + re.sub(r"\s*#.*", "", after) + rest)
    return replaced

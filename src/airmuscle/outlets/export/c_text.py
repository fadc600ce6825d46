"""C text of constants: arrays of numbers and of texts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ...engine.compile.text.programs import CBody
from .provenance import filled

WIDTH = 116
_PROGRAM = "add_executable({0}_run main.c)\ntarget_link_libraries({0}_run PRIVATE {0})"
_PLAIN = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 _.,:;[](){}<>+-*/=^%!'|~#$@&")
_BODIES = {number: CBody(number=number) for number in ("double", "float")}


def c_number(value: float, number: str = "double") -> str:
    """A double, which is read back bit by bit, or the nearest float."""
    return _BODIES[number].constant(float(value)).strip("()")


def c_string(text: str) -> str:
    """A text as a string of ASCII characters; all others are written as octal bytes of their UTF-8 form."""
    encoded = text.encode("utf-8", "replace")
    return '"' + "".join(chr(b) if chr(b) in _PLAIN else f"\\{b:03o}" for b in encoded) + '"'


def c_strings(declaration: str, texts: Iterable[str]) -> str:
    """An array of texts, with an empty one at its end."""
    return f"{declaration} = {{{_wrapped([*map(c_string, texts), c_string('')])}}};\n"


def c_array(declaration: str, values: Any, padding: int = 0, number: str = "double") -> str:
    """An array (N,) or a table (N, m) of a type of numbers, each row with so many zeros at its end."""
    table = np.asarray(values, dtype=float)
    if table.ndim == 1:
        return f"{declaration} = {{{_wrapped(_numbers(table.tolist(), padding, number))}}};\n"
    texts = [f"{{{', '.join(_numbers(row, padding, number))}}}" for row in table.tolist()]
    return f"{declaration} = {{{_wrapped(texts)}}};\n"


def _numbers(values: Sequence[float], padding: int, number: str) -> list[str]:
    return [c_number(value, number) for value in (*values, *[0.0] * padding)]


def c_integers(declaration: str, values: Sequence[Any]) -> str:
    """An array of whole numbers, or a table of rows of them; of none, one zero, because C has no empty array."""
    rows = [f"{{{', '.join(map(str, row))}}}" if isinstance(row, tuple) else str(row) for row in values]
    return f"{declaration} = {{{_wrapped(rows or ['0'])}}};\n"


def with_cmake(name: str, files: Mapping[str, str]) -> dict[str, str]:
    """The files of a C program or law with a CMakeLists.txt, which compiles them as C99 or as C++."""
    main = "main.c" if "main.c" in files else ""
    places = {
        "file": name, "sources": " ".join(file for file in files if file.endswith(".c") and file != main),
        "main": f" {main}" if main else "", "program": _PROGRAM.format(name) if main else "",
    }  # fmt: skip
    return {**files, "CMakeLists.txt": filled("CMakeLists.txt", places, name).rstrip() + "\n"}


def _wrapped(items: Sequence[str]) -> str:
    """The items with commas, in one line or in lines of at most WIDTH characters."""
    if sum(len(item) + 2 for item in items) < WIDTH - 60:
        return ", ".join(items)
    lines = [""]
    for item in items:
        if lines[-1] and len(lines[-1]) + len(item) > WIDTH:
            lines.append("")
        lines[-1] += f" {item},"
    return "\n" + "\n".join(f" {line}" for line in lines).removesuffix(",") + "\n"

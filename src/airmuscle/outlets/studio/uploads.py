"""Texts of users: size and contents that a muscle or scenario file may have when it comes over the network.

Files in the library folder may refer to other files. A text over the network must not, because it would read files of
the machine of the server.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...bench.readers.file_kind import parse_toml
from ...core.errors import ParameterError
from ...core.units import is_known_unit
from ...files.library.files import is_path

MAX_TEXT = 64 * 1024
"""Largest size of a muscle or scenario file [bytes] (chosen)."""
FILE_KEYS = ("file", "mapping")
"""Keys whose value is a path."""
TEXT_KEYS = ("title", "provenance", "note", "warning", "source", "sources", "reference")
"""Keys of texts that are shown and not read as names."""


def read_text_tables(text: str) -> dict[str, Any]:
    """The tables of a TOML text that refers to no file. Raises FileError or ParameterError."""
    tables = parse_toml(text.removeprefix("\ufeff"), "the text")
    check_self_contained(tables)
    return tables


def check_self_contained(value: Any, path: str = "") -> None:
    """Raise ParameterError if tables refer to a file; names of the library are allowed."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            inner = f"{path}.{key}" if path else key
            if key in FILE_KEYS:
                raise ParameterError(_refusal(inner))
            if key not in TEXT_KEYS:
                check_self_contained(item, inner)
    elif isinstance(value, list):
        for i, item in enumerate(value):
            check_self_contained(item, f"{path}[{i}]")
    elif isinstance(value, str) and is_path(value) and not _is_quantity(value):
        raise ParameterError(_refusal(path))


def _is_quantity(text: str) -> bool:
    number, _, unit = text.strip().partition(" ")
    try:
        float(number)
    except ValueError:
        return False
    return is_known_unit(unit.strip())


def _refusal(path: str) -> str:
    return (
        f"{path[:200]}: a text in the studio must not refer to files; write the numbers themselves, or a name of the "
        "library. The command line reads files that refer to others."
    )

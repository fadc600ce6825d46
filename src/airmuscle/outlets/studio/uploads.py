"""Texts of users: size and contents that a muscle or scenario file may have when it comes over the network.

Files in the library folder may refer to other files. A text over the network must not, because it would read files of
the machine of the server.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from typing import Any

from ...core.errors import FileError, ParameterError
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
    try:
        tables = tomllib.loads(text.removeprefix("\ufeff"))
    except tomllib.TOMLDecodeError as error:
        raise FileError(f"the text is not valid TOML: {error}.") from None
    except (ValueError, RecursionError):
        raise FileError("the text cannot be read as TOML; its brackets are nested too deeply.") from None
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

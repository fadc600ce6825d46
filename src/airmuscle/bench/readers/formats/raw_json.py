"""Reader of JSON: arrays of episodes as lists, or steps with an observation and an action."""

import functools
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ....core import FileError, abridged
from ..tables import STEPS, Arrays, flat, numbers_of, reading

LINES = ".jsonl"
"""Extension of files with an object in each line."""


def read_json_arrays(path: Path) -> list[Arrays]:
    """The arrays of every episode in an object of lists, or in a list of such objects. Lists of
    texts are left out. Raises FileError, also for a name that occurs twice in an object, and
    ColumnError.
    """
    with reading(path, "JSON"):
        text = path.read_text(encoding="utf-8-sig")
        tables = _tables(path, text)
    if "observation" in tables[0]:  # a list of steps, which have no lists of rows
        tables = [{STEPS: tables}]
    return [
        {
            name: numbers_of(path, name, values)
            for name, values in flat(table)
            if isinstance(values, list) and not _is_of_words(values)
        }
        for table in tables
    ]


def _tables(path: Path, text: str) -> list[dict[str, Any]]:
    if path.suffix.lower() == LINES:
        content: Any = [_parsed(path, line) for line in text.splitlines() if line.strip()]
    else:
        content = _parsed(path, text)
    tables = content.get("episodes", [content]) if isinstance(content, dict) else content
    is_list = isinstance(tables, list) and bool(tables)
    if not is_list or not all(isinstance(table, dict) for table in tables):
        raise FileError(
            f"{path.name}: an object of lists is expected, or a list of such objects, one for each"
            " episode."
        )
    return list(tables)


def _parsed(path: Path, text: str) -> Any:
    return json.loads(text, object_pairs_hook=functools.partial(_object, path))


def _object(path: Path, pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    """An object, whose names must differ, because only one of two equal ones would be read."""
    table = dict(pairs)
    if len(table) < len(pairs):
        names = [name for name, _ in pairs]
        repeated = next(name for name in names if names.count(name) > 1)
        raise FileError(
            f"{path.name}: the name {abridged(repeated)} occurs twice in an object. Rename one of"
            " the two."
        )
    return table


def _is_of_words(values: Sequence[Any]) -> bool:
    """Whether a list contains words, and no numbers in quotation marks."""
    return all(isinstance(value, str) and not _is_number(value) for value in values) and bool(
        values
    )


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True

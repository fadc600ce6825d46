"""Arrays by name, of which episodes consist: those of nested tables have dotted names.

The steps of an RLDS episode have `observation.angle` and `action`. A row of an array is a step.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ....core import Array, ColumnError
from .channels import RawTable

Arrays = Mapping[str, Array]
STEPS = "steps"
"""The table of an RLDS episode whose name is left out."""
_OF_ONE_EPISODE = (STEPS, "observation")
"""Tables that are parts of an episode, and no episodes of their own."""


def numbers_of(path: Path, name: str, values: Any) -> Array:
    """Values as an array of numbers. Raises ColumnError for rows of different lengths, and for
    numbers in quotation marks.
    """
    array: Any = None
    try:
        array = np.asarray(values)
        if array.dtype.kind in "biufO":
            return np.asarray(array, dtype=float)
    except (TypeError, ValueError, OverflowError):
        array = None
    if array is not None and array.dtype.kind == "U":
        raise ColumnError(
            f"{path.name}: '{name}' contains numbers in quotation marks, or texts; write numbers"
            " without them."
        )
    raise ColumnError(
        f"{path.name}: '{name}' is no array of numbers; its rows must have the same length."
    )


def flat(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """The arrays of nested tables with dotted names; a list of objects, such as steps, becomes
    columns.
    """
    for key, content in table.items():
        name = f"{prefix}{key}".replace("/", ".").removeprefix(f"{STEPS}.")
        values = _columns(content) if _is_list_of_tables(content) else content
        if isinstance(values, Mapping):
            yield from flat(values, "" if name == STEPS else f"{name}.")
        else:
            yield name, values


def _is_list_of_tables(content: Any) -> bool:
    return isinstance(content, list) and bool(content) and isinstance(content[0], Mapping)


def _columns(steps: Sequence[Any]) -> dict[str, Any]:
    """The fields that all steps have, as columns."""
    tables = [step for step in steps if isinstance(step, Mapping)]
    names = [name for name in tables[0] if all(name in table for table in tables)]
    return {name: [table[name] for table in tables] for name in names}


def episodes_of(table: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The tables of the episodes in nested tables: those of the groups and of arrays of structs, or
    the table itself without any.
    """
    inner: list[Mapping[str, Any]] = []
    for name, content in sorted(table.items()):
        if name in _OF_ONE_EPISODE:
            continue
        if isinstance(content, Mapping):
            inner.append(content)
        elif _is_list_of_tables(content):
            inner += content
    return inner or [table]


def arrays_of_table(table: RawTable) -> dict[str, Array]:
    """The columns of numbers of a table."""
    return {
        heading: cells
        for heading, cells in zip(table.headings, table.columns, strict=True)
        if isinstance(cells, np.ndarray)
    }

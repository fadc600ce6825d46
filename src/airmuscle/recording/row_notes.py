"""Notes on rows that were left out or filled while a file was read."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from .recording import Recording


class RowNote(str):
    """Note on rows that were left out or filled, which the commands print and the reports contain."""

    __slots__ = ()


def row_notes(recordings: Iterable[Recording]) -> list[str]:
    """The notes of the recordings on rows that were left out or filled, each once."""
    return list(dict.fromkeys(note for each in recordings for note in each.notes if isinstance(note, RowNote)))


def list_rows(label: str, rows: Sequence[Any] | Any, most: int) -> str:
    """The first of the row numbers, with the word for a row: `lines 12, 15 and 5 more`."""
    numbers = [str(row) for row in rows[:most]]
    more = len(rows) - len(numbers)
    if len(rows) == 1:
        return f"{label} {numbers[0]}"
    if more:
        return f"{label}s {', '.join(numbers)} and {more} more"
    return f"{label}s {', '.join(numbers[:-1])} and {numbers[-1]}"

"""Chapter on the rows of measurement files that were left out or filled."""

from __future__ import annotations

from collections.abc import Iterable

from ...recording import Recording
from ...recording.row_notes import row_notes
from ...report.chapter import Chapter


def reading_chapters(recordings: Iterable[Recording]) -> list[Chapter]:
    """One chapter with the notes on the rows that were left out or filled; none if all rows are as measured."""
    notes = row_notes(recordings)
    return [Chapter("reading", "Rows left out or filled", "\n\n".join(notes))] if notes else []

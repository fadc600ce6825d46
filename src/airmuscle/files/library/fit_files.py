"""Files of a static fit: the file of the fitted muscle and its report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ...bench.identify import Fit
from ...bench.identify.static_fit_chapter import fit_chapter
from ...recording import Recording
from ...report.chapter import Chapter
from ...report.write import write_into
from .entry import Entry
from .write import save


def write_fit(
    folder: Path, result: Fit, entry: Entry, recordings: Sequence[Recording], chapters: Sequence[Chapter] = ()
) -> None:
    """Write muscle.toml and the report into a folder made by `atomic_folder`; `chapters` precede that of the fit."""
    save(entry, folder / "muscle.toml")
    notes = tuple(dict.fromkeys(note for recording in recordings for note in recording.notes))
    write_into(folder, [*chapters, fit_chapter(result, entry, notes)], title="Fit")

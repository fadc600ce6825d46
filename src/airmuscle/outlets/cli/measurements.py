"""Measurement files as arguments of a command, with the options that complete them."""

import dataclasses
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import airmuscle as am

from ...bench import diagnosis, inspection
from ...bench.readers import ColumnMapping
from ...core import ParameterError
from ...recording import Recording
from ...recording.recording import row_notes
from ...report.chapter import Chapter
from ..requests import ReadingRequest
from .options import complete_data
from .parser import Argument
from .terminal import echo, progress_bars

MEASURED = (
    "CSV, LVM, Excel, MAT, TDMS or MDF files with pressure, contraction or length, and force."
)
INSPECTED = (
    "Files, folders or glob patterns: CSV, LVM, Excel, MAT, TDMS, MDF; '-' is text on standard"
    " input."
)
AnyFiles = Annotated[list[str], Argument("FILES", INSPECTED)]
Files = Annotated[list[Path], Argument("FILES", MEASURED, complete_data)]
_OPTIONS = {
    "units": "unit",
    "columns": "column",
    "constants": "constant",
    "drop_outliers": "outliers",
}
"""Options by the names of their fields, where these differ."""


def print_row_notes(recordings: Iterable[Recording]) -> None:
    """Print the notes on rows that were left out or filled, on the error stream."""
    for note in row_notes(recordings):
        echo(f"note: {note}", err=True)


def read_recordings(files: list[Path], reading: ReadingRequest) -> list[Recording]:
    """The recordings of the files, read together so that their units can be compared, then library
    data sets.

    A name without suffix and folder that is not in the working directory is a data set of the
    library. Raises ParameterError for options that a data set does not take.
    """
    mapping = reading.column_mapping()
    local = {entry.name for entry in Path().iterdir()}
    names = [f for f in files if not f.suffix and len(f.parts) == 1 and f.name not in local]
    paths = [f for f in files if f not in names]
    default = ColumnMapping()
    fields = [
        f.name
        for f in dataclasses.fields(mapping)
        if getattr(mapping, f.name) != getattr(default, f.name)
    ]
    named = dict.fromkeys([*fields, *mapping.constants])
    set_options = [f"--{_OPTIONS.get(name, name).replace('_', '-')}" for name in named]
    if names and set_options:
        raise ParameterError(
            f"{names[0]}: a data set of the library contains its units and constants; omit"
            f" {', '.join(set_options)}."
        )
    with progress_bars() as progress:
        recordings = diagnosis.read(paths, mapping, progress=progress) if paths else ()
    if recordings:
        inspection.check_contents(recordings)
    print_row_notes(recordings)
    return [*recordings, *(am.load_data(str(name)) for name in names)]


def reading_chapters(recordings: Iterable[Recording]) -> list[Chapter]:
    """One chapter with the notes on the rows that were left out or filled; none if all rows are as
    measured.
    """
    notes = row_notes(recordings)
    return [Chapter("reading", "Rows left out or filled", "\n\n".join(notes))] if notes else []

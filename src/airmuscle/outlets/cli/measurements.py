"""Measurement files as arguments of a command, with the options that complete them; `airmuscle
inspect` and `airmuscle convert`: such files before a fit, and in another file format."""

import dataclasses
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated

import click

import airmuscle as am

from ...bench.diagnosis import complete_bench, level_tables, read
from ...bench.inspection import check_contents, inspect_all, inspection_chapters
from ...bench.readers import (
    ColumnMapping,
    Decimation,
    Proposal,
    RecordedTime,
    RigFiles,
    describe_files,
    find_files,
    kind_of_file,
    read_rig,
    write,
)
from ...bench.readers.writer import EXTENSIONS
from ...core import FileError, ParameterError, atomic_file
from ...recording import Recording
from ...recording.recording import row_notes
from ...report.chapter import Chapter, NamedValue, Table
from ..requests import ReadingRequest, option, optional, request
from .delivery import deliver
from .hints import in_options
from .options import Json, OptionalFolder, complete_data
from .parser import Argument
from .requested import with_requests
from .terminal import echo, print_json, progress_bars
from .way_on import possible_commands, print_mapping, proposed_mapping, way_on

MEASURED = (
    "CSV, LVM, Excel, MAT, TDMS or MDF files with pressure, contraction or length, and force."
)
MAX_FILES = 60
"""Maximum number of files that the brief view lists where some cannot be read (chosen)."""
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
        recordings = read(paths, mapping, progress=progress) if paths else ()
    check_contents(recordings)
    print_row_notes(recordings)
    return [*recordings, *(am.load_data(str(name)) for name in names)]


def reading_chapters(recordings: Iterable[Recording]) -> list[Chapter]:
    """One chapter with the notes on the rows that were left out or filled; none if all rows are as
    measured.
    """
    notes = row_notes(recordings)
    return [Chapter("reading", "Rows left out or filled", "\n\n".join(notes))] if notes else []


INSPECTED = (
    "Files, folders or glob patterns: CSV, LVM, Excel, MAT, TDMS, MDF; '-' is text on standard"
    " input."
)
AnyFiles = Annotated[list[str], Argument("FILES", INSPECTED)]


@request
class InspectRequest:
    """What an inspection writes."""

    save_mapping: Path | None = optional(
        "File of the mapping that is proposed for what the files do not state (TOML).",
        metavar="FILE",
    )


@with_requests
def inspect(
    files: AnyFiles,
    request: InspectRequest,
    reading: ReadingRequest,
    json: Json = False,
    out: OptionalFolder = None,
) -> None:
    """Inspect measurement files: columns, runs, sampling, outliers.

    \b
    Shows how the files are interpreted: columns and units, sampling, runs, branches, plateaus and
    suspected outliers, and what can be done with them. The data are not changed. A folder may
    contain files of several formats; one that cannot be read does not hinder the others. What the
    files do not state is proposed as a mapping, with question marks for what only you know;
    --save-mapping writes it. With --out, DIR/report.html shows all of each recording, with a
    figure. Sensor properties are estimated from all files together, as from one test rig.

    \b
    Examples:
      airmuscle inspect bench.csv
      ssh rig cat log.csv | airmuscle inspect -
      airmuscle inspect runs/ --resting-length "300 mm" --out inspection
      airmuscle inspect log.mat --save-mapping rig.toml
      airmuscle inspect runs/*.tdms --mapping rig.toml --json
    """
    unordered = ColumnMapping(
        time=RecordedTime(ordered=False)
    )  # stamps that repeat or decrease are shown
    mapping = reading.column_mapping(unordered)
    with progress_bars() as progress:
        rig = read_rig(files, mapping, progress=progress)
    recordings = complete_bench(rig.recordings, mapping)
    proposal = proposed_mapping(rig.failures, rig.paths, mapping)
    if request.save_mapping is not None and proposal:
        with atomic_file(request.save_mapping) as path:
            path.write_text(proposal.toml, encoding="utf-8")
    problems = [in_options(text, "inspect") for text in rig.describe_failures()]
    if recordings:
        chapters = _inspected(files, rig, recordings, problems, proposal)
        deliver("inspect", chapters, json=json, out=out, title="Inspection")
    else:
        for problem in problems:
            echo(f"error: {problem}", err=True)
        if json:
            print_json({"problems": problems, "mapping": proposal.toml if proposal else None})
    if not json:
        print_mapping(proposal, files, request.save_mapping, echo)
    if not recordings:
        raise click.exceptions.Exit(1)


def _inspected(
    files: Sequence[str],
    rig: RigFiles,
    recordings: Sequence[Recording],
    problems: Sequence[str],
    proposal: Proposal,
) -> list[Chapter]:
    """The chapters of an inspection: the files, the recordings, their levels, and the way on."""
    chapters = inspection_chapters(inspect_all(recordings))
    if len(rig.files) > 1 or problems:
        chapters[0] = dataclasses.replace(
            chapters[0],
            summary=f"{chapters[0].summary} Files: {describe_files(rig.files)}.",
            tables=(*chapters[0].tables, _file_table(rig)),
            problems=(*problems, *chapters[0].problems),
        )
    tables = level_tables(recordings)
    if tables:
        chapters.append(
            Chapter("level-records", "Isometric and isobaric records", "", tables=tables)
        )
    further = way_on(files, recordings)
    possible = possible_commands(recordings)
    is_understood = not problems and not proposal
    if len(recordings) > 1 and is_understood and possible:
        commands = f"Possible now: airmuscle {', '.join(possible)}."
        chapters[0] = dataclasses.replace(chapters[0], summary=f"{chapters[0].summary} {commands}")
        further = dataclasses.replace(further, brief=False)
    if proposal:
        further = dataclasses.replace(
            further, values=(NamedValue("mapping", proposal.toml, brief=False),)
        )
    return [*chapters, further]


def _file_table(rig: RigFiles) -> Table:
    """What each file was taken for."""
    unread = {failure.path for failure in rig.failures}
    columns = {
        "file": [str(path) for path in rig.files],
        "taken for": [kind_of_file(path) for path in rig.files],
        "read": ["no" if path in unread else "yes" for path in rig.files],
    }
    return Table("kinds", "Files and formats", columns, brief=MAX_FILES if unread else 0)


Source = Annotated[str, Argument("FILE", "A file, folder or glob pattern, as for inspect.")]
Target = Annotated[Path, Argument("TARGET", f"The file to write: {', '.join(EXTENSIONS)}.")]


@request
class ConvertRequest:
    """Form of the files that are written."""

    plain: bool = option(
        "CSV without comments, as pandas and spreadsheets expect it.", default=False
    )
    max_rows: int | None = optional(
        "Keep every n-th row, N at most; default: all rows.", bounds=(1, math.inf)
    )


@with_requests
def convert(
    source: Source,
    target: Target,
    request: ConvertRequest,
    reading: ReadingRequest,
    json: Json = False,
) -> None:
    """Write measurement files as CSV, Parquet or HDF5.

    \b
    Values are in SI units, and all rows are kept. One recording becomes TARGET; several become
    files with a number before the extension.

    \b
    Examples:
      airmuscle convert bench.tdms bench.parquet
      airmuscle convert "runs/*.csv" runs.h5 --mapping rig.toml
      airmuscle convert logger.csv run.parquet --time uniform --resting-length "300 mm"
      airmuscle convert run/recording.csv plain.csv --plain
    """
    if request.plain and target.suffix.lower() != ".csv":
        raise click.BadParameter("--plain belongs to a target that ends in .csv.")
    if target.suffix.lower() not in EXTENSIONS:
        raise FileError(f"{target}: the extension must be one of {', '.join(EXTENSIONS)}.")
    all_rows = 2**62  # no file has as many
    recordings = read(
        source, reading.column_mapping(), downsampling=Decimation(request.max_rows or all_rows)
    )
    print_row_notes(recordings)
    numbered = [
        target.with_name(f"{target.stem}_{i:03d}{target.suffix}")
        for i in range(1, len(recordings) + 1)
    ]
    paths = numbered if len(recordings) > 1 else [target]
    sources = {path.resolve() for path in find_files(source)}
    for path in paths:
        if path.resolve() in sources:
            raise FileError(
                f"{path}: is a file to be converted and would be lost. Choose another target."
            )
    for recording, path in zip(recordings, paths, strict=True):
        write(recording, path, comments=not request.plain)
    if json:
        print_json(
            {
                "files": [
                    {"file": str(p), "rows": len(r)} for r, p in zip(recordings, paths, strict=True)
                ]
            }
        )
        return
    for recording, path in zip(recordings, paths, strict=True):
        echo(f"file: {path}: {len(recording)} rows of {', '.join(recording)}")

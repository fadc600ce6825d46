"""`airmuscle inspect` and `airmuscle convert`: measurement files before a fit, and in another file format."""

import math
from pathlib import Path
from typing import Annotated

import typer

from ...bench.readers import ColumnMapping, Decimation, RecordedTime, read, write
from ...bench.readers.reader import find_files
from ...bench.readers.writer import EXTENSIONS
from ...bench.segment import inspect_all, inspection_chapters
from ...core import FileError
from ..requests import ReadingRequest, option, request
from .bench_files import print_row_notes
from .delivery import deliver
from .options import Json, OptionalFolder, with_requests
from .terminal import echo, print_json, reading_progress

UNORDERED = ColumnMapping(time=RecordedTime(ordered=False))
"""Stamps that repeat or decrease are shown, not refused."""
Files = Annotated[
    list[str],
    typer.Argument(
        metavar="FILES",
        help="Files, folders or glob patterns: CSV, LVM, Excel, MAT, TDMS, MDF; '-' is text on standard input.",
    ),
]


@with_requests
def inspect(files: Files, reading: ReadingRequest, json: Json = False, out: OptionalFolder = None) -> None:
    """Inspect measurement files: columns, runs, sampling, outliers.

    \b
    Shows how the files are interpreted: columns and units, sampling, runs, branches, plateaus and suspected outliers.
    The data are not changed. With --out, DIR/report.html shows all of each recording, with a figure.
    Sensor properties are estimated from all files together, as from one test rig.

    \b
    Examples:
      airmuscle inspect bench.csv
      ssh rig cat log.csv | airmuscle inspect -
      airmuscle inspect runs/ --resting-length "300 mm" --out inspection
      airmuscle inspect log.mat --column "data(:,1)=time [s]" --column "data(:,2)=pressure [bara]"
      airmuscle inspect runs/*.tdms --mapping rig.toml --json
    """
    with reading_progress() as progress:
        recordings = read(files, reading.column_mapping(UNORDERED), progress=progress)
    chapters = inspection_chapters(inspect_all(recordings))
    deliver("inspect", chapters, json=json, out=out, title="Inspection")


EVERY_ROW = 2**62
"""A number of rows that no file has."""

Source = Annotated[str, typer.Argument(metavar="FILE", help="A file, folder or glob pattern, as for inspect.")]
Target = Annotated[Path, typer.Argument(metavar="TARGET", help=f"The file to write: {', '.join(EXTENSIONS)}.")]


@request
class ConvertRequest:
    """Form of the files that are written."""

    plain: bool = option("CSV without comments, as pandas and spreadsheets expect it.", default=False)
    max_rows: int | None = option(
        "Keep every n-th row, N at most; default: all rows.", default=None, bounds=(1, math.inf)
    )


@with_requests
def convert(
    source: Source, target: Target, request: ConvertRequest, reading: ReadingRequest, json: Json = False
) -> None:
    """Write measurement files as CSV, Parquet or HDF5.

    \b
    Values are in SI units, and all rows are kept. One recording becomes TARGET; several become files with a number
    before the extension.

    \b
    Examples:
      airmuscle convert bench.tdms bench.parquet
      airmuscle convert "runs/*.csv" runs.h5 --mapping rig.toml
      airmuscle convert logger.csv run.parquet --time uniform --resting-length "300 mm"
      airmuscle convert run/recording.csv plain.csv --plain
    """
    if request.plain and target.suffix.lower() != ".csv":
        raise typer.BadParameter("--plain belongs to a target that ends in .csv.")
    if target.suffix.lower() not in EXTENSIONS:
        raise FileError(f"{target}: the extension must be one of {', '.join(EXTENSIONS)}.")
    rows = Decimation(request.max_rows or EVERY_ROW)
    recordings = read(source, reading.column_mapping(), downsampling=rows)
    print_row_notes(recordings)
    paths = [_path(target, i, len(recordings)) for i in range(len(recordings))]
    _check_no_source(paths, source)
    for recording, path in zip(recordings, paths, strict=True):
        write(recording, path, comments=not request.plain)
    if json:
        print_json({"files": [{"file": str(p), "rows": len(r)} for r, p in zip(recordings, paths, strict=True)]})
        return
    for recording, path in zip(recordings, paths, strict=True):
        echo(f"file: {path}: {len(recording)} rows of {', '.join(recording)}")


def _check_no_source(targets: list[Path], source: str) -> None:
    """Raise FileError if a file to be written is one of those that were read."""
    sources = {path.resolve() for path in find_files(source)}
    for target in targets:
        if target.resolve() in sources:
            raise FileError(f"{target}: is a file to be converted and would be lost. Choose another target.")


def _path(target: Path, number: int, count: int) -> Path:
    return target if count == 1 else target.with_name(f"{target.stem}_{number + 1:03d}{target.suffix}")

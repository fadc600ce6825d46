"""`airmuscle convert`: measurement files in another file format."""

import math
from pathlib import Path
from typing import Annotated

import click

from ...bench.diagnosis import read
from ...bench.readers import Decimation, find_files, write
from ...bench.readers.writer import EXTENSIONS
from ...core import FileError
from ...files import library
from ..requests import ReadingRequest, option, optional, request
from .measurements import print_row_notes
from .options import Json
from .parser import Argument
from .requested import with_requests
from .terminal import echo, print_json

Source = Annotated[str, Argument("FILE", "A file, folder or glob pattern, as for inspect.")]
Target = Annotated[Path, Argument("TARGET", f"The file to write: {', '.join(EXTENSIONS)}.")]


MUSCLE_FORMS = ("json", "csv-map")
"""Forms of a muscle file besides TOML."""


@request
class ConvertRequest:
    """Form of the files that are written."""

    plain: bool = option(
        "CSV without comments, as pandas and spreadsheets expect it.", default=False
    )
    max_rows: int | None = optional(
        "Keep every n-th row, N at most; default: all rows.", bounds=(1, math.inf)
    )
    to: str | None = optional(
        "FILE is a muscle file or a library entry, and TARGET: json (all parameters with units) or"
        " csv-map (forces: contraction down, pressure across).",
        choices=MUSCLE_FORMS,
        metavar="FORM",
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
    files with a number before the extension. With --to, FILE is a muscle.

    \b
    Examples:
      airmuscle convert bench.tdms bench.parquet
      airmuscle convert "runs/*.csv" runs.h5 --mapping rig.toml
      airmuscle convert logger.csv run.parquet --time uniform --resting-length "300 mm"
      airmuscle convert run/recording.csv plain.csv --plain
      airmuscle convert dmsp-20-300 map.csv --to csv-map
      airmuscle convert my/muscle.toml muscle.json --to json
    """
    if request.to is not None:
        _convert_muscle(source, target, request.to, json)
        return
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


def _convert_muscle(name: str, target: Path, form: str, json: bool) -> None:
    """Write a muscle in another form."""
    entry = library.load_law(name)
    if target.exists() and Path(name).exists() and target.samefile(name):
        raise FileError(f"{target}: is the muscle and would be lost. Choose another target.")
    as_text = library.muscle_json if form == "json" else library.force_map_csv
    library.write_text(target, as_text(entry))
    if json:
        print_json({"files": [{"file": str(target)}]})
        return
    echo(f"file: {target}")
    if form == "csv-map":
        echo(f'read it back by: --grid "{library.GRID}"')

"""`airmuscle inspect`: inspection of measurement files before a fit."""

from typing import Annotated

import typer

from ...bench.readers import ColumnMapping, RecordedTime, read
from ...bench.segment import inspect_all, inspection_chapters
from ..requests.reading import ReadingRequest
from .delivery import deliver
from .options import Json, OptionalFolder, with_requests
from .terminal import reading_progress

UNORDERED = ColumnMapping(time=RecordedTime(ordered=False))
"""Stamps that repeat or decrease are shown, not refused."""
Files = Annotated[
    list[str],
    typer.Argument(
        metavar="FILES",
        help="Files, folders or glob patterns: CSV, Excel, MAT, TDMS, MDF; '-' is text on standard input.",
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

"""Measurement files as arguments of a command, with the options that complete them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from ..core.errors import ParameterError
from ..library.catalogue import load_data
from ..recording import Recording, read
from ..recording.segment import AT_REST, check_swept, estimate_sensors, find_runs
from .progress import reading_progress

Files = Annotated[
    list[Path],
    typer.Argument(
        metavar="FILES", help="CSV, Excel, MAT, TDMS or MDF files with pressure, contraction or length, and force."
    ),
]
Units = Annotated[
    list[str] | None,
    typer.Option("--unit", metavar="COLUMN=UNIT", help="Unit of a column whose header states none; repeatable."),
]
Length = Annotated[
    str | None, typer.Option(metavar="QUANTITY", help="Length without pressure and load, such as '300 mm'.")
]
AmbientPressure = Annotated[
    str | None,
    typer.Option(metavar="QUANTITY", help="Ambient pressure, subtracted from absolute pressures, such as '98 kPa'."),
]


def read_recordings(files: list[Path], unit: list[str] | None, **options: Any) -> list[Recording]:
    """The recordings of the files, read together so that their units can be compared, then library data sets.

    A name without suffix and folder that is not in the working directory is a data set of the library. `options` are
    those of `recording.read`. Raises ParameterError for options that a data set does not take.
    """
    options = {"units": parse_pairs("--unit", unit), **options}
    local = {entry.name for entry in Path().iterdir()}
    names = [f for f in files if not f.suffix and len(f.parts) == 1 and f.name not in local]
    paths = [f for f in files if f not in names]
    set_options = ["--unit" if name == "units" else f"--{name.replace('_', '-')}"
                   for name, value in options.items() if value]  # fmt: skip
    if names and set_options:
        raise ParameterError(
            f"{names[0]}: a data set of the library contains its units and constants; omit {', '.join(set_options)}."
        )
    with reading_progress() as progress:
        recordings = read(paths, progress=progress, **options) if paths else ()
    _check_content(recordings)
    return [*recordings, *(load_data(str(name)) for name in names)]


def _check_content(recordings: Sequence[Recording]) -> None:
    """Raise where a recording contradicts its file, or where a single recording contains no variation."""
    sensors = estimate_sensors(recordings) if recordings else {}
    for recording in recordings:
        runs = find_runs(recording, {name: s for name, s in sensors.items() if name in recording.columns})
        if len(recordings) == 1 or all(run.kind is not AT_REST for run in runs):
            check_swept(recording, runs)


def parse_pairs(option: str, texts: list[str] | None) -> dict[str, str]:
    """The values of a repeatable option such as --unit COLUMN=UNIT, by name. Raises BadParameter."""
    parts = [text.partition("=") for text in texts or ()]
    if not all(name.strip() and sign for name, sign, _ in parts):
        raise typer.BadParameter(f"{option} must be NAME=TEXT, not {', '.join(texts or ())}")
    return {name.strip(): value.strip() for name, _, value in parts}

"""Measurement files as arguments of a command, with the options that complete them."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from ..core.errors import ParameterError
from ..library.catalogue import load_data
from ..recording import ColumnMapping, Recording, read
from ..recording.mapping import read_mapping
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
_SINGULAR = {"units": "unit", "columns": "column", "constants": "constant"}
"""Options that may be repeated, by the names of their fields."""
Columns = Annotated[
    list[str] | None,
    typer.Option(
        "--column",
        metavar="COLUMN=HEADER",
        help="Header of a column, by name or number: 'Channel 1=pressure [bara]', '3=length [mm]'. Repeatable.",
    ),
]
Constants = Annotated[
    list[str] | None,
    typer.Option(
        "--constant",
        metavar="NAME=QUANTITY",
        help="Quantity that was held and not recorded, 'length=73.2 mm', or specimen, run. Repeatable.",
    ),
]
NamePattern = Annotated[
    str | None,
    typer.Option(
        "--file-name",
        metavar="PATTERN",
        help="Values in the names of the files: 'cut{specimen}_held{length [cm]}cm'; {} is any text.",
    ),
]
TimeOption = Annotated[
    str | None,
    typer.Option(
        "--time",
        metavar="BASE",
        help="Time base: recorded, uniform (by the number of rows, for rounded stamps), unordered or none.",
    ),
]


def column_mapping(
    path: Path | None, *, column: list[str] | None = None, constant: list[str] | None = None, **options: Any
) -> ColumnMapping:
    """The mapping of the file at `path`, if any, with the options taking precedence. Raises BadParameter."""
    base = read_mapping(path) if path else ColumnMapping()
    columns, constants = parse_pairs("--column", column), parse_pairs("--constant", constant)
    return base.with_overrides(columns=columns, constants=constants, **options)


def read_recordings(files: list[Path], unit: list[str] | None, mapping: ColumnMapping) -> list[Recording]:
    """The recordings of the files, read together so that their units can be compared, then library data sets.

    A name without suffix and folder that is not in the working directory is a data set of the library. Raises
    ParameterError for options that a data set does not take.
    """
    units = parse_pairs("--unit", unit)
    local = {entry.name for entry in Path().iterdir()}
    names = [f for f in files if not f.suffix and len(f.parts) == 1 and f.name not in local]
    paths = [f for f in files if f not in names]
    default = ColumnMapping()
    fields = [f.name for f in dataclasses.fields(mapping) if getattr(mapping, f.name) != getattr(default, f.name)]
    named = dict.fromkeys([*(["unit"] if units else []), *fields, *mapping.constants])
    set_options = [f"--{_SINGULAR.get(name, name).replace('_', '-')}" for name in named]
    if names and set_options:
        raise ParameterError(
            f"{names[0]}: a data set of the library contains its units and constants; omit {', '.join(set_options)}."
        )
    with reading_progress() as progress:
        recordings = read(paths, mapping=mapping, units=units, progress=progress) if paths else ()
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

"""`airmuscle inspect`: what was understood of bench files, before anything is fitted."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .bench_files import Length, Surroundings, Units, pairs
from .options import Json, Map, OptionalFolder
from .terminal import print_json, print_table

if TYPE_CHECKING:
    from ..recording import ColumnMapping, Recording
    from ..recording.segment import Inspection, Sampling

Files = Annotated[
    list[str], typer.Argument(metavar="FILE...", help="Files, globs or folders: CSV, Excel, MAT, TDMS, MDF.")
]
Columns = Annotated[
    list[str] | None,
    typer.Option("--column", metavar="COLUMN=HEADING", help="'Channel 1=pressure [bara]', '3=length [mm]'; repeat it."),
]
Text = Annotated[str | None, typer.Option(metavar="SIGN", help="Of text files, where it is not recognised.")]
Sheet = Annotated[str | None, typer.Option(metavar="NAME", help="Worksheet of an Excel file; all without it.")]
Group = Annotated[str | None, typer.Option(metavar="NAME", help="Group of a TDMS or MDF file, struct of a MAT file.")]


def inspect(
    files: Files,
    mapping: Map = None,
    column: Columns = None,
    unit: Units = None,
    resting_length: Length = None,
    ambient: Surroundings = None,
    delimiter: Text = None,
    decimal: Text = None,
    sheet: Sheet = None,
    group: Group = None,
    json: Json = False,
    out: OptionalFolder = None,
) -> None:
    """Show what was understood of bench files: columns, units, sampling, runs, branches, plateaus, glitches.

    \b
    Nothing is changed or left out. With --out, DIR gets a figure for each recording.
    The sensors of several files are estimated together, as those of one rig.

    \b
    Examples:
      airmuscle inspect bench.csv
      airmuscle inspect runs/ --resting-length "300 mm" --out seen
      airmuscle inspect log.mat --column "data(:,1)=time [s]" --column "data(:,2)=pressure [bara]"
      airmuscle inspect runs/*.tdms --mapping rig.toml --json
    """
    from ..recording.segment import inspect_all

    told = _told(mapping, column=column, resting_length=resting_length, ambient=ambient, delimiter=delimiter,
                 decimal=decimal, sheet=sheet, group=group)  # fmt: skip
    seen = inspect_all(_recordings(files, told, pairs("--unit", unit)))
    if out:
        _draw(seen, out)
    if json:
        print_json([as_data(each) for each in seen])
        return
    for each in seen:
        _print(each)
    if out:
        typer.echo(f"figures: {out}")


def _told(path: Path | None, *, column: list[str] | None, **given: Any) -> ColumnMapping:
    from ..recording import ColumnMapping
    from ..recording.mapping import read_mapping

    base = read_mapping(path) if path else ColumnMapping()
    return base.with_overrides(columns=pairs("--column", column), **given)


def _recordings(files: list[str], told: ColumnMapping, units: dict[str, str]) -> tuple[Recording, ...]:
    from ..recording import read
    from .progress import reading_progress

    with reading_progress() as progress:
        return read(files, mapping=told, units=units, ordered=False, progress=progress)


def _draw(seen: tuple[Inspection, ...], out: Path) -> None:
    import re

    from ..core.plotting import save
    from ..report.output_folder import atomic_folder

    with atomic_folder(out) as place:
        for i, each in enumerate(seen, 1):
            stem = re.sub(r"[^\w.-]+", "-", each.recording.origin).strip("-")
            name = f"{stem}.png" if len(seen) == 1 else f"{i:0{len(str(len(seen)))}}-{stem}.png"
            save(each.plot(), place / name)


def as_data(seen: Inspection) -> dict[str, Any]:
    """An inspection as plain data, all numbers SI, rows counted from 1."""
    import dataclasses

    recording = seen.recording
    return {
        "origin": recording.origin,
        "rows": len(recording),
        "columns": [_column(recording, name) for name in recording],
        "constants": dict(recording.constants),
        "notes": list(recording.notes),
        "sampling": _sampling(seen.sampling) if seen.sampling else None,
        "sensors": [dataclasses.asdict(sensor) | {"deviation": sensor.std} for sensor in seen.sensors.values()],
        "runs": [
            {"kind": run.kind.name, "first_row": run.interval.start + 1, "last_row": run.interval.stop,
             "held": run.constant_column, "value": run.constant_value, "swept": run.swept_columns} for run in seen.runs
        ],
        "branches": [
            {"branch": b.name, "first_row": b.interval.start + 1, "last_row": b.interval.stop,
             "start_pressure": b.start_pressure, "end_pressure": b.end_pressure} for b in seen.branches
        ],
        "branch_agreement": seen.branch_agreement,
        "plateaus": [
            {"first_row": p.interval.start + 1, "last_row": p.interval.stop, "values": dict(p.values),
             "deviations": dict(p.standard_errors)} for p in seen.plateaus
        ],
        "quasi_static": seen.quasi_static,
        "suspected_glitches": [dataclasses.asdict(o) | {"row": o.row + 1} for o in seen.outliers],
        "findings": [dataclasses.asdict(finding) for finding in seen.findings],
    }  # fmt: skip


def _sampling(timing: Sampling) -> dict[str, Any]:
    return {
        "rate": timing.rate,
        "step": timing.sample_time,
        "jitter": timing.jitter,
        "duration": timing.duration,
        "gaps": [{"after_row": gap.row + 1, "start": gap.start, "length": gap.duration} for gap in timing.gaps],
        "repeating_rows": [row + 1 for row in timing.repeated_rows],
        "backward_rows": [row + 1 for row in timing.backward_rows],
    }


def _column(recording: Recording, name: str) -> dict[str, Any]:
    from ..recording.columns import quantity_of

    quantity = quantity_of(name)
    values = recording[name]
    return {
        "name": name,
        "unit": quantity.unit if quantity else None,
        "written_in": recording.units.get(name),
        "min": float(values.min()),
        "max": float(values.max()),
    }


def _print(seen: Inspection) -> None:
    from .inspection_text import COLUMNS, column_rows, summary

    typer.echo(f"{seen.recording.origin}: {len(seen.recording)} rows")
    print_table(COLUMNS, column_rows(seen), right=("min", "max", "resolution", "noise"))
    for line in summary(seen):
        typer.echo(line)
    typer.echo("")

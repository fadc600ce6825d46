"""`airmuscle inspect`: inspection of measurement files before a fit."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from ...bench.readers import ColumnMapping, RecordedTime, read
from ...bench.segment import Inspection, Sampling, inspect_all
from ...core.atomic_output import atomic_folder
from ...core.plotting import save
from ...recording import Recording
from ...recording.columns import quantity_of
from .inspection_text import COLUMNS, FILES, column_rows, common_lines, file_row, summary
from .options import Json, OptionalFolder
from .progress import reading_progress
from .reading_options import NO_OPTIONS, ReadingOptions, with_reading_options
from .terminal import echo, print_json, print_table

UNORDERED = ColumnMapping(time=RecordedTime(ordered=False))
"""Stamps that repeat or decrease are shown, not refused."""
Files = Annotated[
    list[str],
    typer.Argument(metavar="FILES", help="Files, folders or glob patterns: CSV, Excel, MAT, TDMS, MDF."),
]


@with_reading_options
def inspect(
    files: Files,
    reading: ReadingOptions = NO_OPTIONS,
    json: Json = False,
    out: OptionalFolder = None,
) -> None:
    """Inspect measurement files: columns, runs, sampling, outliers.

    \b
    Shows how the files are interpreted: columns and units, sampling, runs, branches, plateaus and suspected outliers.
    The data are not changed. With --out, one figure per recording is written to DIR.
    Sensor properties are estimated from all files together, as from one test rig.

    \b
    Examples:
      airmuscle inspect bench.csv
      airmuscle inspect runs/ --resting-length "300 mm" --out inspection
      airmuscle inspect log.mat --column "data(:,1)=time [s]" --column "data(:,2)=pressure [bara]"
      airmuscle inspect runs/*.tdms --mapping rig.toml --json
    """
    inspections = inspect_all(_read(files, reading.column_mapping(UNORDERED)))
    if out:
        _save_figures(inspections, out)
    if json:
        print_json([_to_dict(each) for each in inspections])
        return
    if len(inspections) > 1:
        _print_many(inspections)
    else:
        for each in inspections:
            _print(each)
    if out:
        echo(f"figures: {out}")


def _read(files: list[str], mapping: ColumnMapping) -> tuple[Recording, ...]:
    with reading_progress() as progress:
        return read(files, mapping, progress=progress)


def _save_figures(inspections: tuple[Inspection, ...], out: Path) -> None:
    digits = len(str(len(inspections)))
    with atomic_folder(out) as folder:
        for i, each in enumerate(inspections, 1):
            stem = re.sub(r"[^\w.-]+", "-", each.recording.origin).strip("-")
            name = f"{stem}.png" if len(inspections) == 1 else f"{i:0{digits}}-{stem}.png"
            save(each.plot(), folder / name)


def _to_dict(inspection: Inspection) -> dict[str, Any]:
    """An inspection as plain data, all numbers SI, rows counted from 1."""
    recording, sensors = inspection.recording, inspection.sensors.values()
    return {
        "origin": recording.origin,
        "rows": len(recording),
        "columns": [_column_to_dict(recording, name) for name in recording],
        "constants": dict(recording.constants),
        "notes": list(recording.notes),
        "sampling": _sampling_to_dict(inspection.sampling) if inspection.sampling else None,
        "sensors": [dataclasses.asdict(sensor) | {"deviation": sensor.std} for sensor in sensors],
        "runs": [
            {"kind": run.kind.name, "first_row": run.interval.start + 1, "last_row": run.interval.stop,
             "constant": run.constant_column, "value": run.constant_value, "swept": run.swept_columns}
            for run in inspection.runs
        ],
        "branches": [
            {"branch": b.name, "column": b.column, "first_row": b.interval.start + 1, "last_row": b.interval.stop,
             "start_pressure": b.start_pressure, "end_pressure": b.end_pressure} for b in inspection.branches
        ],
        "branch_agreement": inspection.branch_agreement,
        "plateaus": [
            {"first_row": p.interval.start + 1, "last_row": p.interval.stop, "values": dict(p.values),
             "deviations": dict(p.standard_errors)} for p in inspection.plateaus
        ],
        "quasi_static": inspection.quasi_static,
        "suspected_outliers": [dataclasses.asdict(o) | {"row": o.row + 1} for o in inspection.outliers],
        "findings": [dataclasses.asdict(finding) for finding in inspection.findings],
    }  # fmt: skip


def _sampling_to_dict(sampling: Sampling) -> dict[str, Any]:
    return {
        "rate": sampling.rate,
        "step": sampling.sample_time,
        "jitter": sampling.jitter,
        "duration": sampling.duration,
        "gaps": [{"after_row": gap.row + 1, "start": gap.start, "length": gap.duration} for gap in sampling.gaps],
        "repeating_rows": [row + 1 for row in sampling.repeated_rows],
        "backward_rows": [row + 1 for row in sampling.backward_rows],
    }


def _column_to_dict(recording: Recording, name: str) -> dict[str, Any]:
    column_quantity = quantity_of(name)
    values = recording[name]
    return {
        "name": name,
        "unit": column_quantity.unit if column_quantity else None,
        "written_in": recording.units.get(name),
        "min": float(values.min()),
        "max": float(values.max()),
    }


def _print_many(inspections: Sequence[Inspection]) -> None:
    """One line for each file, then each finding once with its files; a single file is printed in full."""
    print_table(FILES, map(file_row, inspections), right=FILES[1:-2])
    for line in common_lines(inspections):
        echo(line)
    echo("Give one file for its columns, sensors, branches and outliers; --json prints all.")


def _print(inspection: Inspection) -> None:
    echo(f"{inspection.recording.origin}: {len(inspection.recording)} rows")
    print_table(COLUMNS, column_rows(inspection), right=("min", "max", "resolution", "noise"))
    for line in summary(inspection):
        echo(line)
    echo()

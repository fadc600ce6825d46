"""Sheet of uploaded files: columns, recordings with runs and findings, problems, and the points of the chart."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import airmuscle as am

from ...bench.readers.constants import CONSTANT_QUANTITIES
from ...bench.segment import Inspection, Outlier, Run, inspect_all, kept_rows
from ...core import AirmuscleError
from ...recording.columns import display_scale
from ..requests.declaration import RequestError
from .fit_reading import FileColumn, ReadSet, in_page_words, read_set
from .fit_settings import FitSettings, Rule, used_rows
from .fit_uploads import FILES

MAX_POINTS, DIGITS = 9000, 7
"""Maximum number of points of the chart, of more rows every n-th one, and their significant digits (chosen)."""
MAX_LISTED = 60
"""Maximum number of runs or findings of a recording that are listed (chosen)."""
SHOWN = ("time", "pressure", "contraction", "length", "force")


def sheet_of_files(folder: str, settings: FitSettings) -> dict[str, Any]:
    """What was understood of the files of a set; problems are part of the sheet, and no exception."""
    read = read_set(Path(folder), settings)
    names = sorted(path.name for path in (Path(folder) / FILES).iterdir())
    used = _selected_rows(read, settings.rules)
    inspections: Sequence[Inspection | None] = [None] * len(read.recordings)
    try:
        inspections = inspect_all(read.recordings) if read.recordings else ()
    except AirmuscleError as error:
        read.complain(error, "files")
    step = max(1, math.ceil(sum(map(len, read.recordings)) / MAX_POINTS))
    rows = zip(read.recordings, read.files, inspections, used, read.outliers, strict=True)
    return {
        "files": [{"name": name, "columns": [_column(each) for each in read.columns.get(name, [])]} for name in names],
        "recordings": [_recording(*row, step) for row in rows],
        "problems": [{"field": each.field, "text": str(each.message)} for each in read.problems],
        "remarks": read.remarks,
        "step": step,
        "ready": bool(read.recordings) and not read.problems,
    }


def _selected_rows(read: ReadSet, rules: Sequence[Rule]) -> list[Any]:
    """The used rows of each recording; all where a rule is not possible, which becomes a problem."""
    used = []
    for recording, outliers in zip(read.recordings, read.outliers, strict=True):
        try:
            used.append(used_rows(recording, rules, outliers))
        except RequestError as error:
            read.complain(error)
            used.append(np.ones(len(recording), dtype=bool))
    if used and not any(rows.any() for rows in used):
        read.complain(RequestError("no row is left; remove a selection.", "rules"))
    return used


def _column(column: FileColumn) -> dict[str, Any]:
    factor, shown = display_scale(column.name) if column.known else (1.0, "")
    own = {key: getattr(column, key) for key in ("key", "heading", "unit", "stated", "used")}
    return {**own, "quantity": column.name if column.known else "", "factor": factor, "shown_unit": shown}


def _recording(
    recording: am.Recording, file: str, inspection: Inspection | None, used: Any, outliers: Sequence[Outlier], step: int
) -> dict[str, Any]:
    columns, constants, ranges = [name for name in SHOWN if name in recording], {}, {}
    for name, value in recording.constants.items():
        factor, unit = display_scale(CONSTANT_QUANTITIES.get(name, ""))
        constants[name] = f"{value * factor:.5g} {unit}".strip() if isinstance(value, float | int) else str(value)
    for name in recording if len(recording) else ():
        factor, _ = display_scale(name)
        ranges[name] = [float(recording[name].min()) * factor, float(recording[name].max()) * factor]
    return {
        "origin": recording.origin, "file": file, "rows": len(recording), "used": int(np.count_nonzero(used)),
        "constants": constants, "notes": [in_page_words(note) for note in recording.notes], "ranges": ranges,
        **({} if inspection is None else _inspected(inspection)),
        "left_out": [int(row) for row in np.flatnonzero(~kept_rows(recording, outliers)) if row % step == 0],
        "points": {name: [float(f"{x:.{DIGITS}g}") for x in recording[name][::step]] for name in columns},
    }  # fmt: skip


def _inspected(inspection: Inspection) -> dict[str, Any]:
    sampling, findings = inspection.sampling, inspection.findings[:MAX_LISTED]
    return {
        "runs": [_run(run) for run in inspection.runs[:MAX_LISTED]], "run_count": len(inspection.runs),
        "branches": len(inspection.branches),
        "sampling": None if sampling is None else {"rate": sampling.rate, "duration": sampling.duration},
        "outliers": len({each.row for each in inspection.outliers}),
        "findings": [{"text": in_page_words(each.text), "serious": each.serious} for each in findings],
    }  # fmt: skip


def _run(run: Run) -> dict[str, Any]:
    level = ""
    if run.constant_column is not None and run.constant_value is not None:
        factor, unit = display_scale(run.constant_column)
        level = f"{run.constant_column} {run.constant_value * factor:.4g} {unit}"
    rows = [run.interval.start, run.interval.stop]
    return {"kind": run.kind.name, "level": level, "swept": list(run.swept_columns), "rows": rows}

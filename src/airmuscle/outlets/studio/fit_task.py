"""Tasks of the tab Fit: what was understood of uploaded files, and the fit: the comparison of all
laws on the selected rows, its report, and the friction of both branches.

The computation is that of `airmuscle fit --compare` and `airmuscle hysteresis`. All files of the
result are moved into their folder together at the end.
"""

import itertools
import math
import warnings
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import airmuscle as am

from ...bench.comparison.comparison_chapter import LawSelection
from ...bench.diagnosis import DataUse, support_of
from ...bench.hysteresis import LoopFit, find_loops, fit_jointly, fit_loop, loops_not_joined
from ...bench.hysteresis.hysteresis_chapter import hysteresis_chapters, joint_friction_chapter
from ...bench.hysteresis.joint import select_friction
from ...bench.inspection import Inspection, Outlier, Run, check_contents, inspect_all, kept_rows
from ...bench.readers.tables.constants import CONSTANT_QUANTITIES
from ...bench.statics.static_fit_chapter import band_curves, equation_section
from ...core import AirmuscleError, AirmuscleWarning, atomic_folder
from ...files.library import missing_geometry, part_toml, resting_lengths, save
from ...recording.columns import display_scale
from ...report.chapter import Chapter
from ...report.data import as_sheet, in_words
from ...report.formulas import to_display_mathml
from ...report.json_text import as_json
from ...report.write import write_into
from ..requests import FitRequest, RequestError, fit_requested, problem_of_lengths
from .arm_task import ArmTexts, run_arm_fit
from .fit_reading import FileColumn, ReadSet, as_field_error, in_page_words, read_set
from .fit_settings import FitSettings, Rule, selected, used_rows
from .fit_uploads import FILES

Report = Callable[[float, str], None]
DOWNLOADS = (
    "report.html",
    "muscle.toml",
    "scenario.toml",
    "controlled.toml",
    "report.zip",
    "friction.html",
    "friction.toml",
)
"""Files of a result that the page offers."""
RESULT = "result.json"
SHARES = (0.05, 0.75, 0.95)
"""Completed fractions after reading, comparison and friction (chosen for the progress)."""
GEOMETRY = (
    "The muscle file contains no geometry, because the law needs none. A plant takes the enclosed"
    " volume from it: add radius and angle of the braid under Muscle, or a table [geometry] to the"
    " file, before a simulation."
)
"""Remark on a muscle without geometry."""
FRICTION_LAWS = 4
"""Number of friction laws that are fitted to each loop and to all loops together, for the
progress.
"""
MAX_POINTS = 2000
MAX_PARITY_POINTS = 4000
"""Maximum number of points of a loop and of the parity chart; of more rows every n-th one is shown
(chosen).
"""


def run_fit(folder: str, out: str, settings: FitSettings | ArmTexts, report: Report) -> None:
    """Fit the selected rows of a set of files, and write result.json, report and muscle into `out`.
    Raises RequestError for input of the page that is not possible."""
    if not isinstance(settings, FitSettings):
        run_arm_fit(folder, out, settings, report, _pack)
        return
    report(0.0, "reading the files")
    recordings, names = _recordings(Path(folder), settings)
    report(SHARES[0], "comparison of the laws")
    braid = settings.braid
    if braid is not None and (problem := problem_of_lengths(resting_lengths(recordings))):
        raise RequestError(problem, "resting_length")

    def progress(name: str, fraction: float) -> None:
        report(
            SHARES[0] + (SHARES[1] - SHARES[0]) * fraction,
            f"comparison: {name}" if name else "comparison",
        )

    named = settings.entry or None
    split = settings.leave_out
    request = FitRequest(  # the page shows the misfit before the muscle is taken
        compare=True, characteristic=named, leave_out=split, braid=braid, accept_misfit=True
    )
    try:
        fitted = fit_requested(request, names, recordings, progress)
    except AirmuscleError as error:
        raise as_field_error(error, "fit") from None
    assert fitted.selection is not None
    chapters = [in_words(chapter, in_page_words) for chapter in fitted.chapters]
    with atomic_folder(out) as staging, warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        sheet = {**result_sheet(fitted.selection, fitted.fit), "rows": sum(map(len, recordings))}
        sheet["hysteresis"] = (
            _friction(recordings, staging, report) if settings.hysteresis else None
        )
        report(SHARES[2], "report")
        save(fitted.entry, staging / "muscle.toml")
        write_into(staging, chapters, title="Fit")
        sheet["notes"] = [
            *map(in_page_words, fitted.notes),
            *([GEOMETRY] if missing_geometry(fitted.entry) else []),
        ]
        sheet["files"] = _pack(staging)
        (staging / RESULT).write_text(as_json(sheet), encoding="utf-8")


def _recordings(folder: Path, settings: FitSettings) -> tuple[list[am.Recording], list[Path]]:
    """The selected rows of all recordings, and the names of the files. Raises the first problem as
    RequestError.
    """
    read = read_set(folder, settings)
    if read.problems:
        raise read.problems[0]
    if not read.recordings:
        raise RequestError("there is no file; drop a measurement file first.", "files")
    recordings = selected(read.recordings, settings.rules, read.outliers)
    try:
        check_contents(recordings)
        support_of(recordings).check(DataUse.FIT)
    except AirmuscleError as error:
        raise as_field_error(error, "rules" if settings.rules else "files") from None
    return recordings, [Path(name) for name in dict.fromkeys(read.files)]


def _friction(recordings: Sequence[am.Recording], folder: Path, report: Report) -> dict[str, Any]:
    """The friction of the loops, with its report; the reason if there is no loop."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", AirmuscleWarning)
        try:
            loops = find_loops(recordings)
        except AirmuscleError as error:
            return {"reason": in_page_words(error.message), "loops": []}
    remarks = [
        in_page_words(warning.message.args[0])
        for warning in caught
        if isinstance(warning.message, AirmuscleWarning)
    ]
    steps, total = itertools.count(), FRICTION_LAWS * (len(loops) + 1)

    def progress(name: str) -> None:
        share = min(1.0, next(steps) / total)
        report(SHARES[1] + (SHARES[2] - SHARES[1]) * share, f"friction: {name}")

    fits = [fit_loop(loop, progress=progress) for loop in loops]
    joint = fit_jointly(fits, progress=progress)
    report_folder = folder / "friction"
    chapters = hysteresis_chapters(fits, joint)
    report_folder.mkdir()
    write_into(
        report_folder, [in_words(chapter, in_page_words) for chapter in chapters], title="Friction"
    )
    (report_folder / "report.html").replace(folder / "friction.html")
    chosen = select_friction(fits, joint)
    if chosen is not None:
        friction, _, verdict = chosen
        text = f"# {verdict}\n{part_toml('friction', friction)}"
        (folder / "friction.toml").write_text(text, encoding="utf-8")
    together = _sheet(joint_friction_chapter(joint, loops_not_joined(fits))) if joint else None
    return {
        "reason": "",
        "loops": [_loop(fit) for fit in fits],
        "joint": together,
        "remarks": remarks,
    }


def _sheet(chapter: Chapter) -> dict[str, Any]:
    return as_sheet(in_words(chapter, in_page_words))


def _loop(fit: LoopFit) -> dict[str, Any]:
    recording = fit.loop.recording
    varied = fit.loop.varied
    rows = slice(None, None, max(1, -(-len(recording) // MAX_POINTS)))
    return {
        **_sheet(fit.chapter()),
        "justified": fit.recommended is not None,
        "varied": varied,
        "x": recording[varied][rows],
        "force": recording["force"][rows],
        "direction": fit.loop.direction[rows],
    }


def _pack(folder: Path) -> list[str]:
    """Write all files of the result into one archive; returns the names of the files that the page
    offers.
    """
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    with zipfile.ZipFile(folder / "report.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        for path in files:
            archive.write(path, path.relative_to(folder).as_posix())
    return [name for name in DOWNLOADS if (folder / name).exists()]


# The comparison for the page, all SI


def result_sheet(selection: LawSelection, fit: am.Fit) -> dict[str, Any]:
    """The selection and the recommended fit as plain data."""
    best = selection.recommended[0]
    equations, _ = equation_section(fit)
    quantity = fit.fitted_quantity
    step = max(1, math.ceil(fit.rows_used / MAX_PARITY_POINTS))
    columns = {
        "measured": fit.recording[quantity.name],
        "modelled": fit.modelled,
        "residual": fit.residuals,
        "censored": fit.censoring != 0,
        **{name: fit.recording[name] for name in ("pressure", "contraction", "force")},
    }
    return {
        "recommended": best.candidate.name,
        "parameters": best.parameter_count,
        "error": best.cross_validated_rmse,
        "reason": selection.reason,
        "comparisons": [
            {
                "purpose": comparison.purpose,
                "group": comparison.leave_out.group_name,
                **_sheet(comparison.chapter()),
            }
            for comparison in selection.comparisons
        ],
        "fit": _sheet(fit.chapter()),
        "equations": [
            {
                "title": equation.title,
                "note": equation.note,
                "lines": [to_display_mathml(line) for line in equation.lines],
                "sources": dict(equation.sources),
            }
            for equation in equations
        ],
        "parity": {
            "quantity": quantity.name,
            "unit": quantity.unit,
            "step": step,
            **{name: column[::step] for name, column in columns.items()},
        },
        "bands": _bands(fit),
    }


def _bands(fit: am.Fit) -> dict[str, Any] | None:
    curves = band_curves(fit)
    if not curves:
        return None
    rows = [
        {
            "level": curve.level,
            "x": curve.points,
            **{key: getattr(curve.confidence, key) for key in ("value", "low", "high")},
            "prediction_low": curve.prediction.low,
            "prediction_high": curve.prediction.high,
        }
        for curve in curves
    ]
    constant = curves[0].constant
    varying = curves[0].varying
    return {"constant": constant, "varying": varying, "basis": fit.error_basis, "curves": rows}


# What was understood of uploaded files: columns, recordings with runs and findings, problems,
# points of the chart

SHOWN_POINTS = 9000
DIGITS = 7
MAX_LISTED = 60
"""Maximum number of points of the chart, of more rows every n-th one, and their significant digits;
maximum number of runs or findings of a recording that are listed (chosen)."""
SHOWN = ("time", "pressure", "contraction", "length", "force")


def sheet_of_files(folder: str, settings: FitSettings) -> dict[str, Any]:
    """What was understood of the files of a set; problems are part of the sheet, and no
    exception.
    """
    read = read_set(Path(folder), settings)
    names = sorted(path.name for path in (Path(folder) / FILES).iterdir())
    used = _selected_rows(read, settings.rules)
    inspections: Sequence[Inspection | None] = [None] * len(read.recordings)
    try:
        inspections = inspect_all(read.recordings) if read.recordings else ()
    except AirmuscleError as error:
        read.complain(error, "files")
    step = max(1, math.ceil(sum(map(len, read.recordings)) / SHOWN_POINTS))
    rows = zip(read.recordings, read.files, inspections, used, read.outliers, strict=True)
    return {
        "files": [
            {"name": name, "columns": [_column(column) for column in read.columns.get(name, [])]}
            for name in names
        ],
        "recordings": [_recording(*row, step) for row in rows],
        "problems": [
            {"field": problem.field, "text": str(problem.message)} for problem in read.problems
        ],
        "remarks": read.remarks,
        "step": step,
        "ready": bool(read.recordings) and not read.problems,
    }


def _selected_rows(read: ReadSet, rules: Sequence[Rule]) -> list[Any]:
    """The used rows of each recording; all where a rule is not possible, which becomes a
    problem.
    """
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
    stated = {key: getattr(column, key) for key in ("key", "heading", "unit", "stated", "used")}
    return {
        **stated,
        "quantity": column.name if column.known else "",
        "factor": factor,
        "shown_unit": shown,
    }


def _recording(
    recording: am.Recording,
    file: str,
    inspection: Inspection | None,
    used: Any,
    outliers: Sequence[Outlier],
    step: int,
) -> dict[str, Any]:
    columns = [name for name in SHOWN if name in recording]
    constants = {}
    ranges = {}
    inspected: dict[str, Any] = {}
    if inspection is not None:
        sampling = inspection.sampling
        findings = inspection.findings[:MAX_LISTED]
        inspected = {
            "runs": [_run(run) for run in inspection.runs[:MAX_LISTED]],
            "run_count": len(inspection.runs),
            "branches": len(inspection.branches),
            "sampling": (
                None if sampling is None else {"rate": sampling.rate, "duration": sampling.duration}
            ),
            "outliers": len({outlier.row for outlier in inspection.outliers}),
            "findings": [
                {"text": in_page_words(finding.text), "serious": finding.serious}
                for finding in findings
            ],
        }
    for name, value in recording.constants.items():
        factor, unit = display_scale(CONSTANT_QUANTITIES.get(name, ""))
        constants[name] = (
            f"{value * factor:.5g} {unit}".strip() if isinstance(value, float | int) else str(value)
        )
    for name in recording if len(recording) else ():
        factor, _ = display_scale(name)
        ranges[name] = [
            float(recording[name].min()) * factor,
            float(recording[name].max()) * factor,
        ]
    return {
        "origin": recording.origin,
        "file": file,
        "rows": len(recording),
        "used": int(np.count_nonzero(used)),
        "constants": constants,
        "notes": [in_page_words(note) for note in recording.notes],
        "ranges": ranges,
        **inspected,
        "left_out": [
            int(row) for row in np.flatnonzero(~kept_rows(recording, outliers)) if row % step == 0
        ],
        "points": {
            name: [float(f"{x:.{DIGITS}g}") for x in recording[name][::step]] for name in columns
        },
    }


def _run(run: Run) -> dict[str, Any]:
    level = ""
    rows = [run.interval.start, run.interval.stop]
    if run.constant_column is not None and run.constant_value is not None:
        factor, unit = display_scale(run.constant_column)
        level = f"{run.constant_column} {run.constant_value * factor:.4g} {unit}"
    return {
        "kind": run.kind.name,
        "level": level,
        "swept": list(run.swept_columns),
        "rows": rows,
    }

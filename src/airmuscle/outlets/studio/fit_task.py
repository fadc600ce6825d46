"""Task of a fit: the comparison of all laws on the selected rows, its report, and the friction of both branches.

The computation is that of `airmuscle fit --compare` and `airmuscle hysteresis`. All files of the result are moved into
their folder together at the end.
"""

from __future__ import annotations

import dataclasses
import itertools
import warnings
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import airmuscle as am

from ...bench.identify.compare_chapter import compare_chapters
from ...bench.identify.hysteresis import LoopFit, find_loops, fit_jointly, fit_loop, loops_not_joined, preferred_fit
from ...bench.identify.hysteresis.hysteresis_chapter import hysteresis_chapters
from ...bench.identify.hysteresis.joint import select_friction
from ...bench.identify.law_selection import LawSelection, select_law
from ...bench.identify.specimen_errors import odd_specimen_notes, ranked_specimen_errors
from ...bench.segment import check_contents, motion_direction
from ...core.atomic_output import atomic_folder
from ...core.errors import AirmuscleError, AirmuscleWarning
from ...files.library.entry import Entry
from ...files.library.fitted_entry import fitted_entry, left_out_ratio, missing_geometry
from ...files.library.initial_law import find_initial_law, resting_lengths
from ...files.library.write import part_toml, write_fit
from ...report.write import as_json, write_into
from .fit_hints import as_field_error, in_page_words
from .fit_reading import read_set
from .fit_result import result_sheet
from .fit_selection import selected
from .fit_settings import SPLITS, FieldError, FitSettings

Report = Callable[[float, str], None]
DOWNLOADS = ("report.html", "muscle.toml", "report.zip", "friction.html", "friction.toml")
"""Files of a result that the page offers."""
RESULT = "result.json"
SHARES = (0.05, 0.75, 0.95)
"""Completed fractions after reading, comparison and friction (chosen for the progress)."""
GEOMETRY = (
    "The muscle file contains no geometry, because the law needs none. A plant takes the enclosed volume from it: add "
    "radius and angle of the braid under Muscle, or a table [geometry] to the file, before a simulation."
)
"""Remark on a muscle without geometry."""
FRICTION_LAWS = 4
"""Number of friction laws that are fitted to each loop and to all loops together, for the progress."""
MAX_POINTS = 2000
"""Maximum number of points of a loop that the page draws (chosen)."""


def run_fit(folder: str, out: str, settings: FitSettings, report: Report) -> None:
    """Fit the selected rows of a set of files, and write result.json, report and muscle into `out`.

    Raises FieldError for input of the page that is not possible.
    """
    report(0.0, "reading the files")
    recordings, names = _recordings(Path(folder), settings)
    report(SHARES[0], "comparison of the laws")
    braid = settings.braid(resting_lengths(recordings))
    try:
        selection, geometry = _select(recordings, settings, report)
    except AirmuscleError as error:
        raise as_field_error(error, "fit") from None
    best = selection.recommended
    own = isinstance(getattr(best.candidate.law, "geometry", None), am.geometry.Geometry)
    initial = Entry(
        best.candidate.name, best.candidate.name, "chosen", best.candidate.law, geometry if own else braid or geometry
    )
    errors = ranked_specimen_errors(best, selection.comparisons, recordings)
    entry = fitted_entry(best.fit, initial, names, left_out_ratio(best), recordings, errors)
    chapters = compare_chapters(selection.comparisons, best, selection.reason)
    with atomic_folder(out) as staging, warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        sheet = {**result_sheet(selection, best.fit), "rows": sum(map(len, recordings))}
        sheet["hysteresis"] = _friction(recordings, staging, report) if settings.hysteresis else None
        report(SHARES[2], "report")
        write_fit(staging, best.fit, entry, recordings, chapters)
        odd = [in_page_words(note) for note in odd_specimen_notes(errors)]
        unused = [f"The braid is not used: {best.candidate.name} contains its geometry, which was fitted."]
        sheet["notes"] = [*odd, *(unused if own and braid else []), *([GEOMETRY] if missing_geometry(entry) else [])]
        sheet["files"] = _pack(staging)
        (staging / RESULT).write_text(as_json(sheet), encoding="utf-8")


def _recordings(folder: Path, settings: FitSettings) -> tuple[list[am.Recording], list[Path]]:
    """The selected rows of all recordings, and the names of the files. Raises the first problem as FieldError."""
    read = read_set(folder, settings)
    if read.problems:
        raise read.problems[0]
    if not read.recordings:
        raise FieldError("there is no file; drop a measurement file first.", "files")
    recordings = selected(read.recordings, settings.rules, read.outliers)
    try:
        check_contents(recordings)
    except AirmuscleError as error:
        raise as_field_error(error, "rules" if settings.rules else "files") from None
    return recordings, [Path(name) for name in dict.fromkeys(read.files)]


def _select(
    recordings: Sequence[am.Recording], settings: FitSettings, report: Report
) -> tuple[LawSelection, am.geometry.Geometry | None]:
    """The selected law, in the words of the page, and the geometry of the library entry if its law is selected."""

    def progress(name: str, fraction: float) -> None:
        report(SHARES[0] + (SHARES[1] - SHARES[0]) * fraction, f"comparison: {name}" if name else "comparison")

    named = find_initial_law(settings.entry, recordings, 5, "library entry") if settings.entry else None
    candidates: list[am.bench.Candidate] | None = None
    if named is not None:
        own = am.bench.Candidate(f"{settings.entry} (named)", named.entry.characteristic, named.fixed)
        candidates = [*am.bench.standard_candidates(recordings), own]
    selection = select_law(recordings, candidates, leave_out=SPLITS[settings.leave_out], progress=progress)
    is_named = candidates is not None and selection.recommended.candidate is candidates[-1]
    return _in_page_words(selection), named.entry.geometry if named is not None and is_named else None


def _in_page_words(selection: LawSelection) -> LawSelection:
    """The selection whose reasons and notes name fields of the page."""
    best = selection.recommended
    fit = best.fit.with_notes(map(in_page_words, best.fit.notes))
    comparisons = tuple(
        dataclasses.replace(
            each, excluded=tuple(dataclasses.replace(e, reason=in_page_words(e.reason)) for e in each.excluded)
        )
        for each in selection.comparisons
    )
    return dataclasses.replace(selection, comparisons=comparisons, recommended=dataclasses.replace(best, fit=fit))


def _friction(recordings: Sequence[am.Recording], folder: Path, report: Report) -> dict[str, Any]:
    """The friction of the loops, with its report; the reason if there is no loop."""

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", AirmuscleWarning)
        try:
            loops = find_loops(recordings)
        except AirmuscleError as error:
            return {"reason": in_page_words(error.message), "loops": []}
    remarks = [in_page_words(each.message.args[0]) for each in caught if isinstance(each.message, AirmuscleWarning)]
    steps, total = itertools.count(), FRICTION_LAWS * (len(loops) + 1)

    def progress(name: str) -> None:
        share = min(1.0, next(steps) / total)
        report(SHARES[1] + (SHARES[2] - SHARES[1]) * share, f"friction: {name}")

    fits = [fit_loop(loop, progress=progress) for loop in loops]
    joint = fit_jointly(fits, progress=progress)
    _write_friction(folder, fits, joint)
    return {
        "reason": "",
        "loops": [_loop(fit) for fit in fits],
        "joint": "" if not joint else str(preferred_fit(joint) or joint[0]),
        "remarks": [*remarks, *(loops_not_joined(fits) if joint else ())],
    }


def _write_friction(folder: Path, fits: Sequence[LoopFit], joint: Any) -> None:
    write_into(_made(folder / "friction"), hysteresis_chapters(fits, (), joint), title="Friction")
    chosen = select_friction(fits, joint)
    if chosen is not None:
        text = f"# {chosen.verdict}\n{part_toml('friction', chosen.friction)}"
        (folder / "friction.toml").write_text(text, encoding="utf-8")
    (folder / "friction" / "report.html").replace(folder / "friction.html")


def _made(folder: Path) -> Path:
    folder.mkdir()
    return folder


def _loop(fit: LoopFit) -> dict[str, Any]:
    recording, best = fit.loop.recording, fit.recommended
    varied = "contraction" if {"contraction", "length"} & set(fit.loop.run.swept_columns) else "pressure"
    direction = motion_direction(fit.loop.friction_path.displacement(recording), recording.columns.get("time"))
    rows = slice(None, None, max(1, -(-len(recording) // MAX_POINTS)))
    return {
        "title": f"{recording.origin}: {fit.loop.description}",
        "varied": varied,
        "x": recording[varied][rows],
        "force": recording["force"][rows],
        "direction": np.asarray(direction)[rows],
        "models": [
            {
                "model": type(each.friction).__name__, "without": each.rmse_without_friction, "error": each.rmse,
                "gap_without": each.gap, "gap": each.residual_gap, "p_value": each.p_value, "justified": each.justified,
            }
            for each in fit.fits
        ],
        "verdict": str(best) if best is not None else "The data justify no friction model for this loop.",
        "usable": fit.usable_in_plant,
        "failed": [f"{name} was not fitted: {in_page_words(reason)}" for name, reason in fit.failed.items()],
    }  # fmt: skip


def _pack(folder: Path) -> list[str]:
    """Write all files of the result into one archive; returns the names of the files that the page offers."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    with zipfile.ZipFile(folder / "report.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        for path in files:
            archive.write(path, path.relative_to(folder).as_posix())
    return [name for name in DOWNLOADS if (folder / name).exists()]

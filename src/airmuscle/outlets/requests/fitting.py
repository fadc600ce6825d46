"""Computation of a requested static fit: the fit or the comparison, the muscle, and the chapters of
its report.
"""

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from ...bench import comparison, statics
from ...bench.comparison.result_chapter import result_chapter, without_opening_figures
from ...bench.comparison.specimen_errors import (
    ranked_specimen_errors,
    specimen_errors,
    specimen_notes,
)
from ...bench.diagnosis import DataUse, support_of
from ...bench.estimation import UNCENSORED
from ...bench.statics import Candidate, Fit, fit, profile, standard_candidates, weakly_determined
from ...bench.statics.fit_problem import fitted_quantity_of
from ...bench.statics.static_fit_chapter import fit_chapter
from ...bench.statics.surface_violations import shape_violations_of_fit
from ...core import ParameterError
from ...engine.processes import Workers
from ...files.library import Entry, find_initial_law, missing_geometry, resting_lengths
from ...files.library.fitted_entry import fitted_entry, left_out_ratio, list_files
from ...physics import ContractileSurface, Geometry
from ...recording import Recording
from ...report.chapter import Chapter, Table
from .fit import WEAK, FitRequest, check_one_length, with_braid

Progress = Callable[[str, float], None]
"""Called with a step and the fraction done."""
RANKED = 5
"""Laws of each ranking in the brief view, besides the recommended one, if there are several
rankings (chosen).
"""


@dataclasses.dataclass(frozen=True, eq=False)
class FittedMuscle:
    """The fit, the muscle with its law, the chapters of the report, remarks on the specimens, the
    selection of the law, if laws were compared, and why the muscle must not be written, if the
    misfit of its law is not accepted."""

    fit: Fit
    entry: Entry
    chapters: list[Chapter]
    notes: Sequence[str]
    selection: "comparison.LawSelection | None" = None
    refusal: str = ""


def fit_requested(
    request: FitRequest,
    names: Sequence[Path],
    recordings: Sequence[Recording],
    progress: Progress | None = None,
    workers: Workers = 1,
) -> FittedMuscle:
    """The fit of the named law, or the recommended one of the comparison, with what else is
    requested.

    `names` are those of the files. Raises IdentificationError, ParameterError and others of the
    fit.
    """
    recordings = list(recordings)
    steps = _compare if request.compare else _fit_named
    found = steps(request, names, recordings, progress, workers)
    misfit = found.fit.misfit
    refusal = "" if misfit is None or request.accept_misfit else misfit.refusal
    if not refusal:
        return found
    shown = next(chapter for chapter in found.chapters if chapter.brief)
    chapters = [
        dataclasses.replace(chapter, problems=(*chapter.problems, refusal))
        if chapter.opening or chapter is shown
        else chapter
        for chapter in found.chapters
    ]
    return dataclasses.replace(found, chapters=chapters, refusal=refusal)


def _fit_named(
    request: FitRequest,
    names: Sequence[Path],
    recordings: list[Recording],
    progress: Progress | None,
    workers: Workers,
) -> FittedMuscle:
    assert request.characteristic is not None
    if not request.uncensored:  # else forces of zero and below are measured values
        support_of(recordings).check(DataUse.FIT)
    initial, scaling = find_initial_law(request.characteristic, recordings, request.degree)
    start = with_braid(initial, request.braid, recordings)
    law = start.characteristic
    fixed = (*request.fix, *scaling)
    fitted = fit(
        law,
        recordings,
        loss=request.loss(fitted_quantity_of(law).unit),
        fixed=fixed,
        censoring=UNCENSORED if request.uncensored else None,
        sigma=1.0 if request.equal_weights else None,
    )
    errors = specimen_errors(fitted, recordings, fixed)
    entry = fitted_entry(fitted, start, names, recordings=recordings, errors=errors)
    entry, chapters, notes = _more(request, fitted, entry, recordings, progress, workers)
    of_specimens = specimen_notes(errors)
    chapter = fit_chapter(
        fitted, entry, [*notes, *of_specimens, *missing_geometry(entry)], _notes_of(recordings)
    )
    result = result_chapter(_measured_in(names), fitted, chapter, recordings)
    chapter = without_opening_figures(chapter, result)
    return FittedMuscle(fitted, entry, [result, chapter, *chapters], of_specimens)


def _compare(
    request: FitRequest,
    names: Sequence[Path],
    recordings: list[Recording],
    progress: Progress | None,
    workers: Workers,
) -> FittedMuscle:
    if request.braid is not None:
        check_one_length(resting_lengths(recordings))
    # without a named law those that the data determine
    named = None
    candidates = None
    if request.characteristic is not None:
        named, scaling = find_initial_law(request.characteristic, recordings, request.degree)
        named_candidate = Candidate(
            f"{request.characteristic} (named)", named.characteristic, (*request.fix, *scaling)
        )
        candidates = [*standard_candidates(recordings), named_candidate]
    both = None if request.purpose is None else request.purpose == "both"
    selection = comparison.select_law(
        recordings,
        candidates,
        leave_out=request.split,
        both=both,
        loss=request.loss("N"),
        workers=workers,
        progress=progress,
    )
    best = selection.recommended[0]
    geometry = named.geometry if named and candidates and best.candidate is candidates[-1] else None
    initial = Entry(
        best.candidate.name, best.candidate.name, "chosen", best.candidate.law, geometry
    )
    unused = []
    if not isinstance(getattr(best.candidate.law, "geometry", None), Geometry):
        initial = with_braid(initial, request.braid, recordings)
    elif request.braid is not None:
        unused = [
            f"The braid is not used: {best.candidate.name} contains its geometry, which was fitted."
        ]
    errors = ranked_specimen_errors(best, selection.comparisons, recordings)
    entry = fitted_entry(best.fit, initial, names, left_out_ratio(best), recordings, errors)
    entry, more, notes = _more(request, best.fit, entry, recordings, progress, workers)
    comparisons = _in_one_screen(
        comparison.compare_chapters(selection.comparisons, best, selection.reason)
    )
    of_specimens = specimen_notes(errors)
    notes = [*notes, *unused, *of_specimens, *missing_geometry(entry)]
    comparisons[0] = dataclasses.replace(comparisons[0], notes=(*comparisons[0].notes, *notes))
    fitted = dataclasses.replace(
        fit_chapter(best.fit, entry, (), _notes_of(recordings)), brief=False
    )
    result = result_chapter(_measured_in(names), best.fit, fitted, recordings, selection)
    chapters = [result, without_opening_figures(fitted, result), *comparisons, *more]
    return FittedMuscle(best.fit, entry, chapters, [*of_specimens, *unused], selection)


def _more(
    request: FitRequest,
    fitted: Fit,
    entry: Entry,
    recordings: list[Recording],
    progress: Progress | None,
    workers: Workers,
) -> tuple[Entry, list[Chapter], list[str]]:
    """The entry with a constrained surface if one is requested, chapters of further results, and
    notes.
    """
    chapters = list[Chapter]()
    notes = list[str]()
    sample = None
    weak = weakly_determined(fitted) if WEAK in request.profile else ()
    names = dict.fromkeys((*weak, *(name for name in request.profile if name != WEAK)))
    if request.bootstrap is not None:
        report = None if progress is None else lambda fraction: progress("refits", fraction)
        sample = statics.bootstrap(
            fitted,
            recordings,
            refits=request.bootstrap,
            by=request.split,
            progress=report,
            workers=workers,
        )
    profiles = tuple(profile(fitted, name) for name in names)
    if request.shape:
        if not isinstance(fitted.model, ContractileSurface):
            raise ParameterError(
                f"--shape: the shape of {type(fitted.model).__name__} is given by its formula; only"
                " a ContractileSurface can be constrained. Give --characteristic"
                " ContractileSurface, or omit --shape."
            )
        free = None
        if request.free_contraction:
            pressure, contraction = np.array(request.free_contraction).T
            free = Recording(
                {"pressure": pressure, "contraction": contraction}, "--free-contraction"
            )
        shaped = statics.fit_shape_constrained(fitted.model, recordings, free=free)
        chapters.append(shaped.chapter(fitted))
        note = f"{entry.note} With shape constraints: rms error {shaped.rmse:.4g} N."
        entry = dataclasses.replace(entry, characteristic=shaped.model, note=note, error_band=None)
    else:
        notes = list(map(str, shape_violations_of_fit(fitted)))
    none_weak = WEAK in request.profile and not weak
    if sample is not None or profiles or none_weak:
        chapters.append(statics.Uncertainty(fitted, sample, profiles, none_weak).chapter())
    if request.length_error:
        errors = [
            statics.estimate_length_error(fitted.model, recordings, name)
            for name in request.length_error
        ]
        chapters.append(statics.length_error_chapter(errors))
    return entry, chapters, notes


def _in_one_screen(chapters: Sequence[Chapter]) -> list[Chapter]:
    """The chapters of a comparison, each without the notes that one before states. Of several
    chapters, the brief view has fewer laws of the ranking, and those that are not ranked once."""
    stated = set[str]()
    brief = list[Chapter]()
    for chapter in chapters:
        notes = tuple(note for note in chapter.notes if note not in stated)
        tables = chapter.tables
        if len(chapters) > 1:
            tables = tuple(_shortened(chapter, table, not brief) for table in tables)
        brief.append(dataclasses.replace(chapter, notes=notes, tables=tables))
        stated |= set(chapter.notes)
    return brief


def _shortened(chapter: Chapter, table: Table, first: bool) -> Table:
    """A table of laws with fewer rows in the brief view: of a ranking the first ones and the
    recommended law.
    """
    if isinstance(table.brief, int):
        return table if first else dataclasses.replace(table, brief=0)
    recommended = next(row.value for row in chapter.values if row.name == "recommended")
    laws = list(table.columns["law"].values)
    return dataclasses.replace(
        table, brief=sorted({*table.brief[:RANKED], laws.index(recommended)})
    )


def _measured_in(names: Sequence[Path]) -> str:
    """The heading of a report: what was measured."""
    return f"Muscle measured in {list_files([name.name for name in names])}"


def _notes_of(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """The notes on the reading of the recordings, each once."""
    return tuple(dict.fromkeys(note for recording in recordings for note in recording.notes))

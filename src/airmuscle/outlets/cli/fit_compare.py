"""Model comparison of `airmuscle fit --compare`."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import typer

from ...bench.identify import Candidate, Comparison, standard_candidates
from ...bench.identify.compare_chapter import compare_chapters
from ...bench.identify.law_selection import LawSelection, select_law
from ...bench.identify.specimen_errors import odd_specimen_notes, ranked_specimen_errors
from ...core.atomic_output import check_writable
from ...files.library.entry import Entry
from ...files.library.fitted_entry import fitted_entry, left_out_ratio, missing_geometry
from ...files.library.initial_law import InitialLaw, find_initial_law, resting_lengths
from ...physics.muscle.geometry import Geometry
from ...recording import Recording
from .fit_geometry import check_one_length, with_braid
from .fit_options import FitRequest, robust_loss
from .fit_output import fit_to_dict, print_results, write_results
from .option_hints import in_options
from .progress import computation_progress
from .terminal import print_json


def compare_models(
    files: list[Path], recordings: list[Recording], characteristic: str | None, request: FitRequest
) -> None:
    """Rank all candidates, print the ranking, and write the recommended muscle with its report."""
    if request.uncensored or request.equal_weights:
        raise typer.BadParameter(
            "--compare ranks by errors of rows with positive force: --uncensored and --equal-weights do not apply"
        )
    check_writable(request.out)
    if request.braid is not None:
        check_one_length(resting_lengths(recordings))
    named = None if characteristic is None else find_initial_law(characteristic, recordings, request.degree)
    candidates = _candidates(recordings, characteristic, named, request)
    given = None if named is None else candidates
    selection = _select(recordings, given, request)
    best = selection.recommended
    extras = request.options.evaluate(best.fit, recordings)
    geometry = named.entry.geometry if named is not None and best.candidate is candidates[-1] else None
    initial, notes = _initial_entry(best.candidate, geometry, recordings, request)
    errors = ranked_specimen_errors(best, selection.comparisons, recordings)
    entry = fitted_entry(best.fit, initial, files, left_out_ratio(best), recordings, errors)
    notes += [*(in_options(note, "fit") for note in odd_specimen_notes(errors)), *missing_geometry(entry)]
    chapters = compare_chapters(selection.comparisons, best, selection.reason)
    write_results(best.fit, entry, recordings, request.out, [*chapters, *extras.chapters()])
    if request.json:
        print_json(_selection_to_dict(selection) | {"notes": notes} | extras.to_dict())
        return
    lines = [*map(str, selection.comparisons), *([selection.reason] if len(selection.comparisons) > 1 else [])]
    print_results([*lines, *extras.lines(), *(f"note: {note}" for note in notes)], request.out)


def _select(recordings: list[Recording], given: list[Candidate] | None, request: FitRequest) -> LawSelection:
    """The law for the requested purpose, with reasons of exclusion that name options."""
    options = request.options
    both = True if options.purpose == "both" else None if options.purpose is None else False
    with computation_progress("comparison") as show, request.execution.executor() as workers:
        selection = select_law(
            recordings, given, leave_out=options.split, both=both, loss=robust_loss(request.robust, "N"),
            workers=workers, progress=lambda name, fraction: show(fraction),
        )  # fmt: skip
    return dataclasses.replace(selection, comparisons=tuple(_with_option_names(selection.comparisons)))


def _selection_to_dict(selection: LawSelection) -> dict[str, Any]:
    """Plain data, all numbers SI; with two purposes the ranking at the top is that for the first."""
    data = _to_dict(selection.comparisons[0])
    if len(selection.comparisons) == 1:
        return data
    purposes = [{**_to_dict(each), "fit": None} for each in selection.comparisons]
    name, fit = selection.recommended.candidate.name, fit_to_dict(selection.recommended.fit)
    return data | {"recommended": name, "reason": selection.reason, "fit": fit, "purposes": purposes}


def _with_option_names(comparisons: Sequence[Comparison]) -> Iterator[Comparison]:
    """The comparisons with command-line options instead of Python arguments in their texts, and each note once."""
    stated: dict[str, None] = {}
    for each in comparisons:
        excluded = tuple(dataclasses.replace(model, reason=in_options(model.reason, "fit")) for model in each.excluded)
        notes = [note for text in each.notes if (note := in_options(text, "fit")) not in stated]
        stated |= dict.fromkeys(notes)
        yield dataclasses.replace(each, excluded=excluded, notes=tuple(notes))


def _candidates(
    recordings: list[Recording], characteristic: str | None, named: InitialLaw | None, request: FitRequest
) -> list[Candidate]:
    """All models whose initial values can be estimated from data, and the one given with --characteristic."""
    candidates = list(standard_candidates(recordings))
    if named is not None:
        law = named.entry.characteristic
        candidates.append(Candidate(f"{characteristic} (named)", law, (*request.fixed, *named.fixed)))
    return candidates


def _initial_entry(
    candidate: Candidate, geometry: Geometry | None, recordings: list[Recording], request: FitRequest
) -> tuple[Entry, list[str]]:
    """The entry of the recommended candidate, with the braid of --braid if its law contains no geometry, and notes."""
    entry = Entry(candidate.name, candidate.name, "chosen", candidate.law, geometry)
    if not isinstance(getattr(candidate.law, "geometry", None), Geometry):
        return with_braid(entry, request.braid, recordings), []
    unused = f"--braid is not used: {candidate.name} contains its geometry, which was fitted."
    return entry, [] if request.braid is None else [unused]


def _to_dict(comparison: Comparison) -> dict[str, Any]:
    """A comparison as plain data, all numbers SI."""
    return {
        "recommended": comparison.recommended.candidate.name,
        "reason": comparison.reason,
        "left_out": comparison.leave_out.group_name,
        "purpose": comparison.purpose,
        "ranking": [
            {
                "law": c.candidate.name,
                "parameters": c.parameter_count,
                "in_sample": c.in_sample_rmse,
                "cross_validated": c.cross_validated_rmse,
                "aicc": c.aicc,
                "notes": list(c.notes),
                "groups": {score.fold: score.rmse for score in c.fold_scores},
            }
            for c in comparison.ranking
        ],
        "excluded": {each.name: each.reason for each in comparison.excluded},
        "causes": {each.name: each.cause for each in (*comparison.excluded, *comparison.unavailable)},
        "fit": fit_to_dict(comparison.recommended.fit),
    }

"""Model comparison of `airmuscle fit --compare`."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import typer

from ..identify import Candidate, Comparison, compare, standard_candidates
from ..library.entry import Entry
from ..recording import Recording
from ..report.compare_chapter import compare_chapter
from ..report.output_folder import check_writable
from .fit_options import FitRequest
from .fit_output import fit_to_dict, fitted_entry, print_results, write_results
from .initial_law import find_initial_law
from .remedies import in_options
from .terminal import echo, print_json


def compare_models(
    files: list[Path], recordings: list[Recording], characteristic: str | None, request: FitRequest
) -> None:
    """Rank all candidates, print the ranking, and write the recommended muscle with its report."""
    if request.uncensored or request.robust is not None or request.equal_weights:
        raise typer.BadParameter(
            "--compare ranks by squared errors of rows with positive force: "
            "--uncensored, --robust and --equal-weights do not apply"
        )
    check_writable(request.out)
    candidates = _candidates(recordings, characteristic, request)
    progress = None if request.json else lambda name: echo(f"  {name}", err=True)
    comparison = compare(recordings, candidates, leave_out=request.options.split, progress=progress)
    comparison = _with_option_names(comparison)
    best = comparison.recommended
    extras = request.options.evaluate(best.fit, recordings)
    entry = fitted_entry(best.fit, _bare_entry(best.candidate), files)
    write_results(best.fit, entry, recordings, request.out, [compare_chapter(comparison), *extras.chapters()])
    if request.json:
        print_json(_to_dict(comparison) | extras.to_dict())
        return
    print_results([str(comparison), *extras.lines()], request.out)


def _with_option_names(comparison: Comparison) -> Comparison:
    """The comparison whose reasons of exclusion name command-line options instead of Python arguments."""
    excluded = tuple(dataclasses.replace(each, reason=in_options(each.reason)) for each in comparison.excluded)
    return dataclasses.replace(comparison, excluded=excluded)


def _candidates(recordings: list[Recording], characteristic: str | None, request: FitRequest) -> list[Candidate]:
    """All models whose initial values can be estimated from data, and the one given with --characteristic."""
    candidates = list(standard_candidates(recordings))
    if characteristic is not None:
        initial = find_initial_law(characteristic, recordings, request.degree)
        law = initial.entry.characteristic
        candidates.append(Candidate(f"{characteristic} (named)", law, (*request.fixed, *initial.fixed)))
    return candidates


def _bare_entry(candidate: Candidate) -> Entry:
    return Entry(candidate.name, candidate.name, "chosen", candidate.law)


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
                "groups": {score.fold: score.rmse for score in c.fold_scores},
            }
            for c in comparison.ranking
        ],
        "excluded": {each.name: each.reason for each in comparison.excluded},
        "fit": fit_to_dict(comparison.recommended.fit),
    }

"""The part of `airmuscle fit` that compares laws: --compare."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from .remedies import in_options
from .terminal import print_json

if TYPE_CHECKING:
    from ..identify.candidates import Candidate
    from ..identify.model_selection import Comparison
    from ..recording import Recording
    from .fit_options import FitRequest


def compared(files: list[Path], recordings: list[Recording], characteristic: str | None, asked: FitRequest) -> None:
    """Compare, print the ranking, and write the recommended muscle with its report."""
    from ..identify.model_selection import compare
    from ..report.compare_chapter import compare_chapter
    from ..report.output_folder import check_writable
    from .fit_output import echo, fitted, write

    if asked.uncensored or asked.robust is not None or asked.equal_weights:
        raise typer.BadParameter(
            "--compare judges by squared errors of the rows that pull: no --robust, --uncensored, --equal-weights"
        )
    check_writable(asked.out)
    candidates = _candidates(recordings, characteristic, asked)
    said = None if asked.json else lambda name: typer.echo(f"  {name}", err=True)
    found = _worded(compare(recordings, candidates, leave_out=asked.more.by, progress=said))
    chosen = found.recommended
    sure = asked.more.find(chosen.fit, recordings)
    entry = fitted(chosen.fit, _bare(chosen.candidate), files)
    write(chosen.fit, entry, recordings, asked.out, [compare_chapter(found), *sure.chapters()])
    if asked.json:
        print_json(_as_data(found) | sure.as_data())
        return
    echo([str(found), *sure.lines()], asked.out)


def _worded(found: Comparison) -> Comparison:
    """The reasons of exclusions with the remedies of the command line."""
    excluded = tuple(dataclasses.replace(each, reason=in_options(each.reason)) for each in found.excluded)
    return dataclasses.replace(found, excluded=excluded)


def _candidates(recordings: list[Recording], characteristic: str | None, asked: FitRequest) -> list[Candidate]:
    """All that start from data alone, and the one named beside them."""
    from ..identify.candidates import Candidate, standard_candidates
    from .initial_law import start_of

    found = list(standard_candidates(recordings))
    if characteristic is not None:
        start = start_of(characteristic, recordings, asked.degree)
        law = start.entry.characteristic
        found.append(Candidate(f"{characteristic} (named)", law, (*asked.fixed, *start.fixed)))
    return found


def _bare(candidate: Candidate) -> Any:
    from ..library.entry import Entry

    return Entry(candidate.name, candidate.name, "chosen", candidate.law)


def _as_data(found: Comparison) -> dict[str, Any]:
    """A comparison as plain data, all numbers SI."""
    from .fit_output import as_data

    return {
        "recommended": found.recommended.candidate.name,
        "reason": found.reason,
        "left_out": found.leave_out.group_name,
        "purpose": found.purpose,
        "ranking": [
            {
                "law": c.candidate.name,
                "parameters": c.parameter_count,
                "in_sample": c.in_sample_rmse,
                "cross_validated": c.cross_validated_rmse,
                "aicc": c.aicc,
                "parts": {part.fold: part.rmse for part in c.fold_scores},
            }
            for c in found.ranking
        ],
        "excluded": {e.name: e.reason for e in found.excluded},
        "fit": as_data(found.recommended.fit),
    }

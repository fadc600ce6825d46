"""The part of `airmuscle fit` that compares laws: --compare."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from .terminal import print_json

if TYPE_CHECKING:
    from ..identify.candidates import Candidate
    from ..identify.compare import Comparison
    from ..identify.leave_out import LeaveOut
    from ..recording import Recording


def compared(
    files: list[Path],
    recordings: list[Recording],
    *,
    characteristic: str | None,
    fixed: tuple[str, ...],
    leave_out: str | None,
    degree: int,
    robust: str | None,
    uncensored: bool,
    out: Path,
    json: bool,
) -> None:
    """Compare, print the ranking, and write the recommended muscle with its report."""
    from ..identify.compare import compare
    from ..report.compare_chapter import compare_chapter
    from .fit import fitted, write

    if uncensored or robust is not None:
        raise typer.BadParameter("--compare judges by squared errors of the rows that pull: no --robust, --uncensored")
    candidates = _candidates(recordings, characteristic, degree, fixed)
    said = None if json else lambda name: typer.echo(f"  {name}", err=True)
    found = compare(recordings, candidates, leave_out=_part(leave_out), progress=said)
    chosen = found.recommended
    entry = fitted(chosen.fit, _bare(chosen.candidate), files)
    write(chosen.fit, entry, recordings, out, [compare_chapter(found)])
    if json:
        print_json(_as_data(found))
        return
    typer.echo(str(found))
    typer.echo(f"muscle: {out / 'muscle.toml'}")
    typer.echo(f"report: {out / 'report.html'}")


def _candidates(
    recordings: list[Recording], characteristic: str | None, degree: int, fixed: tuple[str, ...]
) -> list[Candidate]:
    """All that start from data alone, and the one named beside them."""
    from ..identify.candidates import Candidate, standard_candidates
    from .fit import start_of

    found = list(standard_candidates(recordings))
    if characteristic is not None:
        law = start_of(characteristic, recordings, degree).characteristic
        found.append(Candidate(f"{characteristic} (named)", law, fixed))
    return found


def _part(word: str | None) -> LeaveOut | None:
    from ..identify.leave_out import Blocks, Levels, Runs, Specimens

    parts: dict[str, LeaveOut] = {
        "run": Runs(),
        "specimen": Specimens(),
        "contraction": Levels("contraction"),
        "pressure": Levels("pressure"),
        "block": Blocks(),
    }
    if word is not None and word not in parts:
        raise typer.BadParameter(f"--leave-out is '{word}'; it may be {', '.join(parts)}")
    return None if word is None else parts[word]


def _bare(candidate: Candidate) -> Any:
    from ..library.entry import Entry

    return Entry(candidate.name, candidate.name, "chosen", candidate.law)


def _as_data(found: Comparison) -> dict[str, Any]:
    """A comparison as plain data, all numbers SI."""
    from .fit import as_data

    return {
        "recommended": found.recommended.candidate.name,
        "reason": found.reason,
        "left_out": found.leave_out.word,
        "purpose": found.purpose,
        "ranking": [
            {
                "law": c.candidate.name,
                "parameters": c.parameters,
                "in_sample": c.in_sample,
                "cross_validated": c.cross_validated,
                "aicc": c.aicc,
                "parts": {part.part: part.rms for part in c.left_out},
            }
            for c in found.contenders
        ],
        "excluded": {e.name: e.why for e in found.excluded},
        "fit": as_data(found.recommended.fit),
    }

"""`airmuscle reproduce`: the papers, claim by claim."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .options import Folder
from .terminal import print_table

if TYPE_CHECKING:
    from rich.text import Text

    from ..report.chapter import Chapter, Claim

COLOURS = {"holds": "green", "differs": "bold red", "not printed": "dim"}


def reproduce(
    papers: Annotated[
        list[str] | None,
        typer.Argument(metavar="PAPER", help="saga2007, borzikova, hosovsky, or a beginning of one; all if none."),
    ] = None,
    out: Folder = Path("report"),
) -> None:
    """Reproduce the papers: a report, the verdict on each claim, figures and data.

    \b
    Writes DIR/report.html, DIR/claims.json, DIR/figures/ and DIR/data/.
    A claim that does not hold is a result, not a failure: the exit code is 0.

    \b
    Examples:
      airmuscle reproduce
      airmuscle reproduce saga hosovsky --out report
    """
    from ..core.errors import AirmuscleError
    from ..reproduce.run import reproduce as run

    chapters: list[Chapter] = []
    try:
        page = run(papers, out, stage=_stage, finished=chapters.append)
    except (AirmuscleError, KeyboardInterrupt):
        if chapters:
            typer.echo(f"\nthe chapters that were complete stand in {out}", err=True)
        raise
    _print_claims([claim for chapter in chapters for claim in chapter.claims])
    typer.echo(f"report: {page}")


@contextlib.contextmanager
def _stage(paper: str) -> Iterator[None]:
    """Shows on stderr that a paper is being computed, and then how long it took."""
    import time

    from rich.console import Console

    console, start = Console(stderr=True, highlight=False), time.perf_counter()
    with console.status(f"reproducing {paper} ..."):
        yield
    console.print(f"{paper}: {time.perf_counter() - start:.1f} s")


def _print_claims(claims: list[Claim]) -> None:
    from ..report.formatting import count_verdicts, format_number, format_published
    from ..report.formula import to_plain

    rows = [
        (c.paper, to_plain(c.claim), format_published(c), format_number(c.reproduced), _unit(c), _verdict(c.verdict))
        for c in claims
    ]
    headers = ("paper", "claim", "published", "reproduced", "unit", "verdict")
    print_table(headers, rows, right=("published", "reproduced"))
    counts = count_verdicts(tuple(claims))
    typer.echo(f"{len(claims)} claims: " + ", ".join(f"{count} {verdict}" for verdict, count in counts.items()))


def _unit(claim: Claim) -> str:
    return "" if claim.unit == "1" else claim.unit


def _verdict(verdict: str) -> Text:
    from rich.text import Text

    from ..report.formatting import MARKS

    return Text(f"{MARKS[verdict]} {verdict}", style=COLOURS[verdict], no_wrap=True)

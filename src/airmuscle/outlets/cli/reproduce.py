"""`airmuscle reproduce`: reproduction of the three papers, claim by claim."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ...core.errors import AirmuscleError
from ...engine.processes import available_cores
from ...papers.run import reproduce as reproduce_papers
from ...papers.run import select_papers
from ...report.chapter import DEPENDS, DIFFERS, HOLDS, NOT_PRINTED, NOT_TESTABLE, Chapter, Claim, Kind
from ...report.formatting import MARKS, count_verdicts, format_number, format_published
from ...report.formula import to_plain
from .options import Folder
from .terminal import echo, print_table

if TYPE_CHECKING:
    from rich.text import Text

COLOURS = {HOLDS: "green", DIFFERS: "bold red", DEPENDS: "yellow", NOT_TESTABLE: "dim", NOT_PRINTED: "dim"}


def reproduce(
    papers: Annotated[
        list[str] | None,
        typer.Argument(metavar="PAPER", help="saga2007, borzikova, hosovsky, or a prefix of one; default: all."),
    ] = None,
    out: Folder = Path("report"),
) -> None:
    """Reproduce three papers and test each of their claims.

    \b
    Writes DIR/report.html, DIR/claims.json, DIR/figures/ and DIR/data/.
    A claim that is not confirmed is a result, not a failure: the exit code is 0.

    \b
    Examples:
      airmuscle reproduce
      airmuscle reproduce saga hosovsky --out report
    """
    from rich.console import Console

    console, chapters = Console(stderr=True, highlight=False), dict[str, Chapter]()

    def show(name: str, chapter: Chapter, seconds: float) -> None:
        chapters[name] = chapter
        console.print(f"{name}: {seconds:.1f} s")

    try:
        with console.status("reproducing the papers ..."):
            page = reproduce_papers(papers, out, workers=available_cores(), finished=show)
    except (AirmuscleError, KeyboardInterrupt):
        if chapters:
            echo(f"\nthe completed chapters were written to {out}", err=True)
        raise
    _print_claims([claim for name in select_papers(papers) for claim in chapters[name].claims])
    echo(f"report: {page}")


def _print_claims(claims: list[Claim]) -> None:
    """Print one table for each kind, and the number of statements by verdict, in which cases count once."""
    headers = ("paper", "{}", "expected", "reproduced", "unit", "verdict")
    for kind in Kind:
        rows = [
            (c.paper, to_plain(c.text), format_published(c), format_number(c.reproduced), _unit(c), _verdict(c.verdict))
            for c in claims
            if c.kind is kind
        ]
        if rows:
            echo(f"\n{kind.description}")
            print_table([h.format(kind.value) for h in headers], rows, right=("expected", "reproduced"))
    for kind in Kind:
        counts = {verdict: count for verdict, count in count_verdicts(claims, kind).items() if count}
        total = sum(counts.values())
        listed = ", ".join(f"{count} {verdict}" for verdict, count in counts.items())
        if total:
            echo(f"{total} {kind.value}{'s' if total > 1 else ''}: {listed}")


def _unit(claim: Claim) -> str:
    return "" if claim.unit == "1" else claim.unit


def _verdict(verdict: str) -> Text:
    from rich.text import Text

    return Text(f"{MARKS[verdict]} {verdict}", style=COLOURS[verdict], no_wrap=True)

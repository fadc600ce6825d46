"""`airmuscle reproduce`: reproduction of the three papers, claim by claim."""

import textwrap
from pathlib import Path
from typing import Annotated

from ...core import AirmuscleError, counted
from ...engine.processes import available_cores
from ...papers.run import reproduce as reproduce_papers
from ...papers.run import select_papers
from ...report.chapter import Chapter, Table
from ...report.claims import (
    MARKS,
    Kind,
    count_verdicts,
    format_published,
    format_reproduced,
    statements,
)
from ...report.formatting import to_plain
from ...report.layout import GAP
from ...report.text import table_lines
from .options import Folder
from .parser import Argument
from .terminal import echo, terminal_width

HEADERS = ("claim", "expected", "reproduced", "verdict")
MIN_CLAIM = 28
"""Smallest number of characters of a statement in the terminal, where the others are cut
(chosen).
"""
PREFIXES = {Kind.CLAIM: "", Kind.FINDING: "comparison: ", Kind.CHECK: "check: "}


PAPERS = "saga2007, borzikova, hosovsky, or a prefix of one; default: all."
Papers = Annotated[list[str] | None, Argument("PAPER", PAPERS)]


def reproduce(papers: Papers = None, out: Folder = Path("report")) -> None:
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
    for name in select_papers(papers):
        _print_chapter(chapters[name])
    echo()
    claims = [claim for chapter in chapters.values() for claim in chapter.claims]
    for kind in Kind:  # the readings of a statement count once
        counts = {
            verdict: count for verdict, count in count_verdicts(claims, kind).items() if count
        }
        if counts:
            listed = ", ".join(f"{count} {verdict}" for verdict, count in counts.items())
            echo(f"{counted(sum(counts.values()), kind.value)}: {listed}")
    echo(f"report: {page}")


def _print_chapter(chapter: Chapter) -> None:
    """Print one line for each statement; the readings of a statement are in the report."""
    echo(f"\n{chapter.title}")
    for question, answer in chapter.answers:
        text = f"{question} {to_plain(answer)}"
        echo(textwrap.fill(text, terminal_width(), subsequent_indent="  ", break_on_hyphens=False))
    stated = [(kind, statement) for kind in Kind for statement in statements(chapter.claims, kind)]
    values = []
    for _, s in stated:
        published = format_published(s.cases[0], with_tolerance=False)
        unit = s.cases[0].unit
        reproduced = (
            f"{format_reproduced(s, 3)} {unit if s.reproduced and unit != '1' else ''}".rstrip()
        )
        values.append((published, reproduced, f"{MARKS[s.verdict]} {s.verdict}"))
    columns = zip(HEADERS[1:], *values, strict=True)
    room = max(
        MIN_CLAIM,
        terminal_width() - sum(max(len(str(cell)) for cell in column) + GAP for column in columns),
    )
    texts = (f"{PREFIXES[kind]}{to_plain(statement.claim)}" for kind, statement in stated)
    rows = [
        (textwrap.shorten(text, room, placeholder=" …"), *row)
        for text, row in zip(texts, values, strict=True)
    ]
    columns_of_texts = dict(zip(HEADERS, zip(*rows, strict=True), strict=True))
    table = Table("table", "", columns_of_texts, brief=len(rows))
    for line in table_lines(table, terminal_width(), ""):
        echo(line)

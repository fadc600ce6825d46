"""RunSplit the papers' chapters and writes their report."""

from __future__ import annotations

import contextlib
import importlib
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from ..library.catalogue import complete
from ..report.chapter import Chapter
from ..report.output_folder import check_writable
from ..report.write import write_report

PAPERS: dict[str, str] = {
    "saga2007": "airmuscle.reproduce.saga2007",
    "borzikova": "airmuscle.reproduce.borzikova",
    "hosovsky": "airmuscle.reproduce.hosovsky",
}
"""The papers in the order of the report, each with the module whose `chapter()` reproduces it."""

TITLE = "Three papers on pneumatic artificial muscles, reproduced"

Stage = Callable[[str], AbstractContextManager[Any]]
"""Given a paper's name, what surrounds its computation: a progress display, a clock, nothing."""


def reproduce(
    papers: Sequence[str] | None = None,
    folder: Path | str = "report",
    *,
    stage: Stage = contextlib.nullcontext,
    finished: Callable[[Chapter], Any] = lambda chapter: None,
) -> Path:
    """Reproduce the named papers, all if None, and return the path of the report's page.

    A unique beginning of a name is enough. `finished` is told each chapter as it is done. A run that is
    interrupted, or whose later paper fails, still writes the chapters that are complete. Raises UnknownName,
    FileError, and what a chapter raises.
    """
    chosen = select_papers(papers)
    check_writable(folder)
    chapters: list[Chapter] = []
    try:
        for name in chosen:
            with stage(name):
                chapters.append(importlib.import_module(PAPERS[name]).chapter())
            finished(chapters[-1])
    except BaseException:
        if chapters:
            write_report(chapters, folder, title=f"{TITLE} (incomplete)")
        raise
    return write_report(chapters, folder, title=TITLE)


def select_papers(papers: Sequence[str] | None) -> list[str]:
    """The full names of these papers, each once, in the report's order; all if there are none."""
    wanted = {complete(paper, PAPERS, "paper") for paper in papers or PAPERS}
    return [name for name in PAPERS if name in wanted]

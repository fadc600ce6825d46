"""Reproduction of the papers: computes their chapters and writes the report."""

from __future__ import annotations

import contextlib
import importlib
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from ..library.files import complete_name
from ..report.chapter import Chapter
from ..report.output_folder import check_writable
from ..report.write import write_report

PAPERS: dict[str, str] = {
    "saga2007": "airmuscle.reproduce.saga2007",
    "borzikova": "airmuscle.reproduce.borzikova",
    "hosovsky": "airmuscle.reproduce.hosovsky",
}
"""The papers in the order of the report, each with the module whose function `chapter()` reproduces it."""

TITLE = "Reproduction of three papers on pneumatic artificial muscles"

Stage = Callable[[str], AbstractContextManager[Any]]
"""Context manager around the computation of the named paper, such as a progress display."""


def reproduce(
    papers: Sequence[str] | None = None,
    folder: Path | str = "report",
    *,
    stage: Stage = contextlib.nullcontext,
    finished: Callable[[Chapter], Any] = lambda chapter: None,
) -> Path:
    """Reproduce the named papers, or all if None, and return the path of the report's page.

    A unique beginning of a name is sufficient. `finished` is called with each completed chapter. If the computation
    is interrupted or a paper fails, the completed chapters are still written. Raises UnknownNameError, FileError,
    and the exceptions of a chapter.
    """
    selected = select_papers(papers)
    check_writable(folder)
    chapters: list[Chapter] = []
    try:
        for name in selected:
            with stage(name):
                chapters.append(importlib.import_module(PAPERS[name]).chapter())
            finished(chapters[-1])
    except BaseException:
        if chapters:
            write_report(chapters, folder, title=f"{TITLE} (incomplete)")
        raise
    return write_report(chapters, folder, title=TITLE)


def select_papers(papers: Sequence[str] | None) -> list[str]:
    """Return the full names of the given papers in the order of the report, each once; all if none is given."""
    requested = {complete_name(paper, PAPERS, "paper") for paper in papers or PAPERS}
    return [name for name in PAPERS if name in requested]

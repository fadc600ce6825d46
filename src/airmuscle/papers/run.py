"""Reproduction of the papers: computes their chapters and writes the report."""

import dataclasses
import functools
import importlib
import time
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, as_completed
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import Any

from ..core import check_writable
from ..design.study import process_pool
from ..files.library.files import complete_name
from ..report.chapter import Chapter, Plot, Table
from ..report.claims import AtLeast, AtMost, Claim, ClaimRow, Equal, Kind, PublishedValue
from ..report.write import rendered_figure, write_report

PAPERS = {name: f"airmuscle.papers.{name}" for name in ("saga2007", "borzikova", "hosovsky")}
"""The papers in the order of the report, each with the module whose function `chapter()` reproduces
it.
"""

TITLE = "Reproduction of three papers on pneumatic artificial muscles"

Finished = Callable[[str, Chapter, float], Any]
"""Function of a paper, its completed chapter and its computing time [s]."""


def reproduce(
    papers: Sequence[str] | None = None,
    folder: Path | str = "report",
    *,
    workers: int = 1,
    finished: Finished = lambda name, chapter, seconds: None,
) -> Path:
    """Reproduce the named papers, or all if None, and return the path of the report's page.

    A unique beginning of a name is sufficient. `workers` is the number of processes. `finished` is
    called with each completed chapter. If the computation is interrupted or a paper fails, the
    completed chapters are still written. Raises UnknownNameError, FileError, and the exceptions of
    a chapter.
    """
    selected = select_papers(papers)
    check_writable(folder)
    completed: dict[str, Chapter] = {}
    try:
        with process_pool(
            min(workers, max(len(selected), 1)), one_thread_each=True, terminate=True
        ) as pool:
            for name, chapter, seconds in _chapters(selected, pool):
                completed[name] = chapter
                finished(name, chapter, seconds)
    except BaseException:
        if completed:
            write_report(
                [completed[n] for n in selected if n in completed],
                folder,
                title=f"{TITLE} (incomplete)",
            )
        raise
    return write_report([completed[name] for name in selected], folder, title=TITLE)


def _chapters(
    selected: Sequence[str], pool: Executor | None
) -> Iterator[tuple[str, Chapter, float]]:
    """Each paper with its chapter and its computing time, as they are completed."""
    if pool is None:
        yield from ((name, *_compute(PAPERS[name])) for name in selected)
        return
    futures = {
        pool.submit(_compute, PAPERS[name]): name for name in reversed(selected)
    }  # the longest first
    for future in as_completed(futures):
        yield futures[future], *future.result()


def _compute(module: str) -> tuple[Chapter, float]:
    """The chapter of a module, whose figures are rendered, to be sent to another process, and the
    computing time.
    """
    start = time.perf_counter()
    chapter = importlib.import_module(module).chapter()
    tables = tuple(dataclasses.replace(table, folded=True) for table in chapter.tables)
    plots = tuple(dataclasses.replace(plot, figure=rendered_figure(plot)) for plot in chapter.plots)
    return dataclasses.replace(chapter, tables=tables, plots=plots), time.perf_counter() - start


def select_papers(papers: Sequence[str] | None) -> list[str]:
    """Return the full names of the given papers in the order of the report, each once; all if none
    is given.
    """
    requested = {complete_name(paper, PAPERS, "paper") for paper in papers or PAPERS}
    return [name for name in PAPERS if name in requested]


@functools.cache
def _entries(file: str) -> dict[str, Any]:
    return tomllib.loads(resources.files(__package__).joinpath(file).read_text(encoding="utf-8"))


def chapter_texts(paper: str) -> dict[str, Any]:
    """Return the texts of a chapter as arguments of `Chapter`; line breaks within a paragraph are
    spaces.
    """
    texts = _entries("texts.toml")[paper]
    rows = {
        key: tuple(map(tuple, value)) for key, value in texts.items() if isinstance(value, list)
    }
    tables = {
        key: tuple((k, _in_one_line(v)) for k, v in value.items())
        for key, value in texts.items()
        if isinstance(value, dict)
    }
    return {**texts, **rows, **tables}


def captioned(name: str, figure: Any) -> Plot:
    """Return a figure of a chapter with its caption in texts.toml."""
    return Plot(name, _in_one_line(_entries("texts.toml")["figures"][name]), figure)


def titled(name: str, columns: Mapping[str, Any] | None = None, **options: Any) -> Table:
    """Return a table of a chapter with its title and note in texts.toml, except those among the
    `options`.

    Without `columns`, it is a table that the paper prints, whose columns are in texts.toml, too.
    """
    entry = dict(_entries("texts.toml")["tables"][name])
    columns = entry.pop("columns", columns)
    return Table(
        name,
        columns=columns,
        **{**{key: _in_one_line(text) for key, text in entry.items()}, **options},
    )


def claim_row(
    paper: str,
    name: str,
    reproduce: Callable[..., Any] | None = None,
    cases: Mapping[str, tuple[Any, ...]] = MappingProxyType({"": ()}),
    printed: PublishedValue | None = None,
) -> ClaimRow:
    """Return the row of a claim whose statement, value, unit, place and note are in claims.toml.

    `reproduce` and `cases` are those of ClaimRow; `printed` is the value where claims.toml states
    none.
    """
    entry: dict[str, Any] = dict(_entries("claims.toml")[paper][name])
    entry |= {key: _in_one_line(value) for key, value in entry.items() if isinstance(value, str)}
    options = {key: entry.pop(key) for key in ("tolerance", "chosen", "derived") if key in entry}
    for key, criterion in (("equal", Equal), ("at_least", AtLeast), ("at_most", AtMost)):
        printed = criterion(entry.pop(key), **options) if key in entry else printed
    kind = Kind(entry.pop("kind", Kind.CLAIM.value))
    return ClaimRow(
        Claim(paper, entry.pop("text"), printed, None, kind=kind, **entry), reproduce, cases
    )


def _in_one_line(text: str) -> str:
    return " ".join(text.split())

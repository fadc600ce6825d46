"""Files of a report: report.html, claims.json, figures/ and data/."""

from __future__ import annotations

import dataclasses
import datetime
from collections.abc import Iterable, Sequence
from pathlib import Path

from ..core import plotting
from ..core.atomic_output import atomic_folder
from ..core.errors import FileError
from .chapter import Chapter, Plot, Table
from .data import as_json
from .html import render_page
from .sheet import csv_text

REPORT_FILE = "report.html"


def write_report(
    chapters: Sequence[Chapter], folder: Path | str, *, title: str = "Report", date: datetime.date | None = None
) -> Path:
    """Write the report, either completely or not at all, and return the path of its page.

    `date` is shown on the page; None stands for today. The same chapters give the same bytes in claims.json, data/
    and figures/. Raises FileError if the folder cannot be written to.
    """
    with atomic_folder(folder) as staging:
        write_into(staging, chapters, title=title, date=date)
    return Path(folder) / REPORT_FILE


def write_into(
    staging: Path, chapters: Sequence[Chapter], *, title: str = "Report", date: datetime.date | None = None
) -> None:
    """Write the report's files into a folder made by `atomic_folder`, next to other files of the same command."""
    _check_unique(chapters)
    try:
        for chapter in chapters:
            for plot in chapter.plots:
                save_figure(plot, staging / "figures" / plot.name)
            for table in chapter.tables:
                save_table(table, staging / "data" / f"{table.name}.csv")
        claims = [claim.as_dict() for chapter in chapters for claim in chapter.claims]
        if claims:
            (staging / "claims.json").write_text(as_json(claims), encoding="utf-8")
        text = render_page(chapters, staging / "figures", title=title, date=date or datetime.date.today())
        (staging / REPORT_FILE).write_text(text, encoding="utf-8", errors="backslashreplace")  # names of files
    except OSError as error:
        raise FileError(f"{staging.parent}: the report cannot be written: {error.strerror or error}.") from error


def save_figure(plot: Plot, stem: Path) -> None:
    """Write the figure of a plot as `stem`.svg and `stem`.png."""
    stem.parent.mkdir(parents=True, exist_ok=True)
    for suffix, content in rendered_figure(plot).items():
        stem.with_name(f"{stem.name}.{suffix}").write_bytes(content)


def rendered_figure(plot: Plot) -> dict[str, bytes]:
    """The files of the figure of a plot by their format."""
    drawn = plot.draw()
    return drawn if isinstance(drawn, dict) else plotting.rendered(drawn)


def with_rendered_figures(chapter: Chapter) -> Chapter:
    """The chapter with the files of its figures, by format, in place of the figures, to be sent to another process."""
    plots = tuple(dataclasses.replace(plot, figure=rendered_figure(plot)) for plot in chapter.plots)
    return dataclasses.replace(chapter, plots=plots)


def save_table(table: Table, path: Path) -> None:
    """Write a table as CSV: headers with units, numbers with all digits, an empty cell for NaN and infinity."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(csv_text(table), encoding="utf-8", newline="")


def _check_unique(chapters: Iterable[Chapter]) -> None:
    """Raise ValueError if two figures or two tables have the same name: one would overwrite the other."""
    for kind in ("plots", "tables"):
        names = [item.name for chapter in chapters for item in getattr(chapter, kind)]
        invalid = sorted({name for name in names if names.count(name) > 1 or Path(name).name != name})
        if invalid:
            raise ValueError(f"{kind}: names must be unique and valid file names; check {', '.join(invalid)}.")

"""A report on the disk: report.html, claims.json, figures/ and data/."""

from __future__ import annotations

import csv
import datetime
import json
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..core import plotting
from ..core.errors import FileError
from .chapter import Chapter, Table
from .html import page
from .output_folder import atomic_folder
from .wording import rows

REPORT = "report.html"


def write_report(
    chapters: Sequence[Chapter], folder: Path | str, *, title: str = "Report", date: datetime.date | None = None
) -> Path:
    """Write the report and return the path of its page; all of it appears, or nothing.

    `date` is printed on the page, today's if None. The same chapters give the same bytes in claims.json, data/
    and figures/. Raises FileError where the folder cannot be written.
    """
    with atomic_folder(folder) as place:
        fill(place, chapters, title=title, date=date)
    return Path(folder) / REPORT


def fill(place: Path, chapters: Sequence[Chapter], *, title: str = "Report", date: datetime.date | None = None) -> None:
    """Write the report's files into a folder made by `staged`, beside whatever else a command puts there."""
    _check_unique(chapters)
    try:
        for chapter in chapters:
            for plot in chapter.plots:
                save_figure(plot.figure, place / "figures" / plot.name)
            for table in chapter.tables:
                save_table(table, place / "data" / f"{table.name}.csv")
        claims = [claim.as_dict() for chapter in chapters for claim in chapter.claims]
        if claims:
            (place / "claims.json").write_text(as_json(claims), encoding="utf-8")
        text = page(chapters, place / "figures", title=title, date=date or datetime.date.today())
        (place / REPORT).write_text(text, encoding="utf-8")
    except OSError as error:
        raise FileError(f"{place.parent}: the report cannot be written: {error.strerror or error}.") from error


def save_figure(figure: Any, stem: Path) -> None:
    """Write `stem`.svg and `stem`.png."""
    stem.parent.mkdir(parents=True, exist_ok=True)
    for suffix in ("svg", "png"):
        plotting.save(figure, stem.with_name(f"{stem.name}.{suffix}"))


def save_table(table: Table, path: Path) -> None:
    """Write a table as CSV, its headers with units, its numbers exact; what is not finite leaves an empty cell."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(table.columns)
        writer.writerows([_plain(value) for value in row] for row in rows(table))


def as_json(content: Any) -> str:
    """JSON that any reader takes: NumPy numbers become plain ones, what is not finite becomes null."""
    return json.dumps(_plain(content), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _check_unique(chapters: Iterable[Chapter]) -> None:
    """Two figures or two tables of one name would overwrite each other."""
    for kind in ("plots", "tables"):
        names = [item.name for chapter in chapters for item in getattr(chapter, kind)]
        twice = sorted({name for name in names if names.count(name) > 1 or Path(name).name != name})
        if twice:
            raise ValueError(f"{kind} need names that are file names and differ; look at {', '.join(twice)}.")

"""Files of a report: report.html with embedded figures and formulas, claims.json, figures/ and
data/.
"""

import base64
import contextlib
import datetime
import functools
import platform
import re
from collections.abc import Sequence
from importlib import metadata, resources
from pathlib import Path
from typing import Any

from ..core import FileError, atomic_folder, plotting
from . import claims as claiming
from .chapter import Chapter, Plot, Table
from .data import csv_text
from .formatting import format_cell, format_unit, to_plain, typographic
from .formulas import symbol_formula, to_display_mathml, to_mathml
from .json_text import as_json
from .shown import SYMBOL, ShownColumn, shown_columns, value_table

MAX_SVG_BYTES = 600_000
"""Figures with a larger SVG are embedded as PNG: a dense chart would make the page slow."""
MAX_LINE = 26
"""Characters of a text in a table cell that is not wrapped."""
_PACKAGES = ("numpy", "scipy", "numba", "llvmlite", "matplotlib")
_BRACKETS = re.compile(r"\s*\[([^\]]*)\]$")
REPORT_FILE = "report.html"


def write_report(
    chapters: Sequence[Chapter],
    folder: Path | str,
    *,
    title: str = "Report",
    date: datetime.date | None = None,
) -> Path:
    """Write the report, either completely or not at all, and return the path of its page.

    `date` is shown on the page; None stands for today. The same chapters give the same bytes in
    claims.json, data/ and figures/. Raises FileError if the folder cannot be written to.
    """
    with atomic_folder(folder) as staging:
        write_into(staging, chapters, title=title, date=date)
    return Path(folder) / REPORT_FILE


def write_into(
    staging: Path,
    chapters: Sequence[Chapter],
    *,
    title: str = "Report",
    date: datetime.date | None = None,
) -> None:
    """Write the report's files into a folder made by `atomic_folder`, next to other files of the
    same command.
    """
    _check_file_names("plots", [plot.name for chapter in chapters for plot in chapter.plots])
    _check_file_names("tables", [table.name for chapter in chapters for table in chapter.tables])
    try:
        for chapter in chapters:
            for plot in chapter.plots:
                (staging / "figures").mkdir(exist_ok=True)
                for suffix, content in rendered_figure(plot).items():
                    (staging / "figures" / f"{plot.name}.{suffix}").write_bytes(content)
            for table in chapter.tables:
                save_table(table, staging / "data" / f"{table.name}.csv")
        claims = [claim.as_dict() for chapter in chapters for claim in chapter.claims]
        if claims:
            (staging / "claims.json").write_text(as_json(claims), encoding="utf-8")
        text = render_page(
            chapters, staging / "figures", title=title, date=date or datetime.date.today()
        )
        (staging / REPORT_FILE).write_text(
            text, encoding="utf-8", errors="backslashreplace"
        )  # names of files
    except OSError as error:
        raise FileError(
            f"{staging.parent}: the report cannot be written: {error.strerror or error}."
        ) from error


def _check_file_names(kind: str, names: Sequence[str]) -> None:
    """Of two of the same name one would overwrite the other."""
    invalid = {name for name in names if names.count(name) > 1 or Path(name).name != name}
    if invalid:
        raise ValueError(
            f"{kind}: names must be unique and valid file names;"
            f" check {', '.join(sorted(invalid))}."
        )


def rendered_figure(plot: Plot) -> dict[str, bytes]:
    """The files of the figure of a plot by their format."""
    drawn = plot.draw()
    return drawn if isinstance(drawn, dict) else plotting.rendered(drawn)


def save_table(table: Table, path: Path) -> None:
    """Write a table as CSV: headers with units, numbers with all digits, an empty cell for NaN and
    infinity.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(csv_text(table), encoding="utf-8", newline="")


def render_page(
    chapters: Sequence[Chapter], figures: Path, *, title: str, date: datetime.date
) -> str:
    """Return the HTML of a report; the folder `figures` contains its figures as <name>.svg and
    <name>.png.
    """
    page: str = _template().render(
        title=title,
        date=date.isoformat(),
        chapters=chapters,
        claims=[claim for chapter in chapters for claim in chapter.claims],
        kinds=list(claiming.Kind),
        statements=claiming.statements,
        count_verdicts=claiming.count_verdicts,
        marks=claiming.MARKS,
        meanings=claiming.MEANINGS,
        versions=versions(),
        zip=zip,
        image=lambda plot: image_data_uri(figures / plot.name),
    )
    return page


@functools.cache
def _template() -> Any:
    """The template of a page, compiled once in a process."""
    import jinja2  # needed by reports only
    from markupsafe import Markup

    options: Any = {"autoescape": True, "trim_blocks": True, "lstrip_blocks": True}
    environment = jinja2.Environment(undefined=jinja2.StrictUndefined, **options)
    environment.filters.update(
        cell=lambda value, column=None: Markup(render_cell(value, column)),
        header=lambda text: Markup(render_header(text)),
        formulas=lambda text: Markup(to_mathml(text)),
        equation=lambda latex: Markup(to_display_mathml(latex)),
        plain=to_plain,
        published=lambda claim: typographic(claiming.format_published(claim)),
        reproduced=lambda statement: typographic(claiming.format_reproduced(statement)),
        unit=format_unit,
        anchor=lambda text: re.sub(r"[^a-z0-9]+", "-", text.lower()).strip(
            "-"
        ),  # identifier of a link target
        readings=claiming.count_readings,
        verdicts=claiming.format_verdicts,
        shown=shown_columns,
        rows=lambda shown: list(zip(*(column.cells for column in shown), strict=True)),
        sentence=lambda text: (
            f"{text[:1].upper()}{text[1:]}{'' if text.endswith(('.', '!', '?', ':')) else '.'}"
        ),
        results=lambda chapter: value_table(f"{chapter.name}-results", "Results", chapter.values),
        is_short=lambda value: isinstance(value, str) and len(to_plain(value)) <= MAX_LINE,
    )
    text = resources.files(__package__).joinpath("template.html").read_text(encoding="utf-8")
    return environment.from_string(text)


def render_cell(value: Any, column: ShownColumn | None = None) -> str:
    """Return the HTML of a cell; the heading of its column decides on the format of symbols, units
    and p-values.
    """
    if column is None:
        return to_mathml(format_cell(value))
    if column.heading == SYMBOL and isinstance(value, str):
        return to_mathml(symbol_formula(value))
    return to_mathml(column.cell_text(value))


def render_header(header: str) -> str:
    """Return the HTML of a column header: its unit with superscripts, without the unit 1."""
    unit = _BRACKETS.search(header)
    if unit is None:
        return to_mathml(header)
    name = header[: unit.start()]
    shown = format_unit(unit[1])
    return to_mathml(f"{name} [{shown}]" if shown else name)


def image_data_uri(stem: Path) -> str:
    """Return a figure as a data URI: the SVG, or the PNG if the SVG is larger than
    `MAX_SVG_BYTES`.
    """
    kind = "svg+xml"
    content = stem.with_name(f"{stem.name}.svg").read_bytes()
    if len(content) > MAX_SVG_BYTES:
        kind = "png"
        content = stem.with_name(f"{stem.name}.png").read_bytes()
    return f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}"


@functools.cache
def versions() -> dict[str, str]:
    """Return the versions of airmuscle, Python and the numerical packages; `not installed` for a
    missing one.
    """
    installed = dict.fromkeys(("airmuscle", "Python", *_PACKAGES), "not installed")
    for package in ("airmuscle", *_PACKAGES):
        with contextlib.suppress(metadata.PackageNotFoundError):
            installed[package] = metadata.version(package)
    return installed | {
        "Python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}",
    }

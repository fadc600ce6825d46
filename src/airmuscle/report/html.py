"""HTML page of a report: one file with embedded figures and formulas as MathML, without scripts."""

from __future__ import annotations

import base64
import datetime
import functools
import platform
import re
from collections.abc import Sequence
from importlib import metadata, resources
from pathlib import Path
from typing import Any

from .chapter import Chapter
from .claims import Kind, statements
from .formatting import (
    MARKS,
    MEANINGS,
    count_readings,
    count_verdicts,
    format_cell,
    format_published,
    format_reproduced,
    format_unit,
    format_verdicts,
    typographic,
)
from .formula import symbol_formula, to_display_mathml, to_mathml, to_plain
from .shown import SYMBOL, ShownColumn, rows_of, shown_columns, value_table

MAX_SVG_BYTES = 600_000
"""Figures with a larger SVG are embedded as PNG: a dense chart would make the page slow."""
MAX_LINE = 26
"""Characters of a text in a table cell that is not wrapped."""
_PACKAGES = ("numpy", "scipy", "numba", "llvmlite", "casadi", "matplotlib")
_BRACKETS = re.compile(r"\s*\[([^\]]*)\]$")


def render_page(chapters: Sequence[Chapter], figures: Path, *, title: str, date: datetime.date) -> str:
    """Return the HTML of a report; the folder `figures` contains its figures as <name>.svg and <name>.png."""
    import jinja2  # needed by reports only
    from markupsafe import Markup

    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters.update(
        cell=lambda value, column=None: Markup(render_cell(value, column)),
        header=lambda text: Markup(render_header(text)),
        formulas=lambda text: Markup(to_mathml(text)),
        equation=lambda latex: Markup(to_display_mathml(latex)),
        plain=to_plain,
        published=lambda claim: typographic(format_published(claim)),
        reproduced=lambda statement: typographic(format_reproduced(statement)),
        unit=format_unit,
        anchor=anchor,
        readings=count_readings,
        verdicts=format_verdicts,
        shown=shown_columns,
        rows=rows_of,
        sentence=as_sentence,
        results=lambda chapter: value_table(f"{chapter.name}-results", "Results", chapter.values),
        is_short=is_short,
    )
    template = resources.files(__package__).joinpath("template.html").read_text(encoding="utf-8")
    return environment.from_string(template).render(
        title=title,
        date=date.isoformat(),
        chapters=chapters,
        claims=[claim for chapter in chapters for claim in chapter.claims],
        kinds=list(Kind),
        statements=statements,
        count_verdicts=count_verdicts,
        marks=MARKS,
        meanings=MEANINGS,
        versions=versions(),
        zip=zip,
        image=lambda plot: image_data_uri(figures / plot.name),
    )


def render_cell(value: Any, column: ShownColumn | None = None) -> str:
    """Return the HTML of a cell; the heading of its column decides on the format of symbols, units and p-values."""
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
    name, shown = header[: unit.start()], format_unit(unit[1])
    return to_mathml(f"{name} [{shown}]" if shown else name)


def image_data_uri(stem: Path) -> str:
    """Return a figure as a data URI: the SVG, or the PNG if the SVG is larger than `MAX_SVG_BYTES`."""
    vector = stem.with_name(f"{stem.name}.svg").read_bytes()
    if len(vector) <= MAX_SVG_BYTES:
        return _data_uri("image/svg+xml", vector)
    return _data_uri("image/png", stem.with_name(f"{stem.name}.png").read_bytes())


def _data_uri(media_type: str, content: bytes) -> str:
    return f"data:{media_type};base64,{base64.b64encode(content).decode('ascii')}"


def anchor(text: str) -> str:
    """Return the identifier of a link target within the page."""
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")


def as_sentence(text: str) -> str:
    """Return a note as a sentence: with a capital letter and a full stop."""
    return f"{text[:1].upper()}{text[1:]}{'' if text.endswith(('.', '!', '?', ':')) else '.'}"


def is_short(value: Any) -> bool:
    """Whether a cell is shown on one line."""
    return isinstance(value, str) and len(to_plain(value)) <= MAX_LINE


@functools.cache
def versions() -> dict[str, str]:
    """Return the versions of airmuscle, Python and the numerical packages; `not installed` for a missing one."""
    return {
        "airmuscle": _version("airmuscle"),
        "Python": platform.python_version(),
        **{package: _version(package) for package in _PACKAGES},
        "machine": f"{platform.system()} {platform.machine()}",
    }


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not installed"

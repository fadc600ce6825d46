"""The page: one file that holds its figures, so that it can be mailed, archived and printed."""

from __future__ import annotations

import base64
import datetime
import re
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from .chapter import Chapter
from .versions import versions
from .wording import MARKS, number, published, rows, tally

GREATEST_VECTOR = 600_000
"""Bytes of SVG above which a figure enters the page as PNG: a dense chart would make the page slow."""


def page(chapters: Sequence[Chapter], figures: Path, *, title: str, date: datetime.date) -> str:
    """The HTML of a report whose figures lie in the folder `figures` as <name>.svg and <name>.png."""
    import jinja2  # needed by reports alone

    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters.update(
        number=number, published=published, anchor=anchor, paragraphs=paragraphs, rows=rows, is_numeric=is_numeric
    )
    template = resources.files(__package__).joinpath("template.html").read_text(encoding="utf-8")
    claims = tuple(claim for chapter in chapters for claim in chapter.claims)
    return environment.from_string(template).render(
        title=title,
        date=date.isoformat(),
        chapters=chapters,
        verdicts=tally(claims),
        tally=tally,
        marks=MARKS,
        versions=versions(),
        image=lambda plot: image(figures / plot.name),
    )


def image(stem: Path) -> str:
    """A data address that holds the figure: its SVG, or its PNG where that is smaller by far."""
    vector = stem.with_name(f"{stem.name}.svg").read_bytes()
    if len(vector) <= GREATEST_VECTOR:
        return _address("image/svg+xml", vector)
    return _address("image/png", stem.with_name(f"{stem.name}.png").read_bytes())


def _address(kind: str, content: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"


def anchor(text: str) -> str:
    """A name that a link within the page can carry."""
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")


def paragraphs(text: str) -> list[str]:
    """The paragraphs of a text, which blank lines part."""
    return [" ".join(part.split()) for part in re.split(r"\n\s*\n", text) if part.strip()]


def is_numeric(values: Sequence[Any]) -> bool:
    """Whether a column holds numbers, which stand flush right."""
    return not any(isinstance(value, str) for value in values)

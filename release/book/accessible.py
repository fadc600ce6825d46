"""Attributes that the theme leaves out: levels of captions, names of landmarks, and focus of
regions that scroll.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

MISSING = (
    ('class="caption" role="heading"', 'class="caption" role="heading" aria-level="2"'),
    ('<aside class="sidebar-drawer">', '<aside class="sidebar-drawer" aria-label="Pages">'),
    ('<aside class="toc-drawer', '<aside aria-label="Contents of this page" class="toc-drawer'),
    ("<pre><span></span>", '<pre tabindex="0"><span></span>'),
    ('<div class="table-wrapper', '<div tabindex="0" class="table-wrapper'),
    ('<div class="formula', '<div tabindex="0" class="formula'),
)


def set_up_accessibility(app: Any) -> None:
    """Complete the pages after they were written."""
    app.connect("build-finished", _complete)


def _complete(app: Any, error: Exception | None) -> None:
    if error is None and app.builder.name == "html":
        for path in Path(app.outdir).rglob("*.html"):
            path.write_text(accessible(path.read_text(encoding="utf-8")), encoding="utf-8")


def accessible(text: str) -> str:
    """The HTML of a page with what the theme leaves out."""
    for without, complete in MISSING:
        text = text.replace(without, complete)
    return text

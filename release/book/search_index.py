"""Index of the search: title, address and text of every section, as a script, which also a page
from a file may load.

The search of Sphinx requires all words and reads the pages again for their excerpts, which a
browser refuses for files.
"""

from __future__ import annotations

import html
import json
import re
from pathlib import Path
from typing import Any

LEFT_OUT = {"search", "genindex"}
SECTION = re.compile(r'<section id="([^"]*)">\s*<h[1-6]>(.*?)<a class="headerlink"', re.DOTALL)
ARTICLE = re.compile(r'<article role="main"[^>]*>(.*?)</article>', re.DOTALL)
MAX_TEXT = 6000
"""Maximum number of characters of a section in the index (chosen)."""


def set_up_search(app: Any) -> None:
    """Write the index after the pages."""
    app.connect("build-finished", _write_index)


def _write_index(app: Any, error: Exception | None) -> None:
    if error is None and app.builder.name == "html":
        rows = index_rows(Path(app.outdir))
        text = (
            "window.bookSections ="
            f" {json.dumps(rows, ensure_ascii=False, separators=(',', ':'))};\n"
        )
        (Path(app.outdir) / "_static" / "search_index.js").write_text(text, encoding="utf-8")


def index_rows(folder: Path) -> list[list[str]]:
    """Page title, heading, address and text of each section of all pages in a folder."""
    rows = []
    for path in sorted(folder.rglob("*.html")):
        name = path.relative_to(folder).as_posix()
        article = ARTICLE.search(path.read_text(encoding="utf-8"))
        if article and path.stem not in LEFT_OUT and not name.startswith("_"):
            rows += page_rows(name, article[1])
    return rows


def page_rows(name: str, article: str) -> list[list[str]]:
    """The rows of one page."""
    starts = list(SECTION.finditer(article))
    ends = [match.start() for match in starts[1:]] + [len(article)]
    rows = []
    for match, end in zip(starts, ends, strict=True):
        heading = plain(match[2])
        title = plain(starts[0][2])
        address = name if match is starts[0] else f"{name}#{match[1]}"
        body = article[article.index("</a>", match.end()) + len("</a>") : end]
        rows.append([title, heading, address, plain(body)[:MAX_TEXT]])
    return rows


def plain(text: str) -> str:
    """The text of a piece of HTML."""
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", text)).split())

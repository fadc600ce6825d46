"""Words of a chapter of the report that a reader sees before anything is unfolded."""

from __future__ import annotations

import datetime
import html
import re
from dataclasses import replace
from pathlib import Path

from airmuscle.report import Chapter, render_page

_FOLDED = re.compile(
    r"<details(?! class=\"table\" open)[^>]*>\s*(<summary.*?</summary>).*?</details>", re.DOTALL
)
_HIDDEN = re.compile(r"<style.*?</style>|<nav.*?</nav>|<math.*?</math>|<[^>]*>", re.DOTALL)


def visible_words(chapter: Chapter) -> int:
    """The number of words of a page with this chapter, its tables folded, without figures; a
    formula counts none.
    """
    tables = tuple(replace(table, folded=True) for table in chapter.tables)
    page = render_page(
        [replace(chapter, tables=tables, plots=())],
        Path(),
        title="",
        date=datetime.date(2026, 1, 1),
    )
    return len(html.unescape(_HIDDEN.sub(" ", _FOLDED.sub(r"\1", page))).split())

"""Contents of the site: the parts and pages that docs/README.md lists, and the pages that are
generated.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
GENERATED = {"Reference": ("models/index", "commands/index", "functions/index")}
"""Indices of generated pages, which follow the pages that a part lists."""
ITEM = re.compile(
    r"^\* \[(?P<title>[^\]]+)\]\((?P<target>[^)]+)\): (?P<text>.*(?:\n  \S.*)*)", re.MULTILINE
)
LINK = re.compile(r"(?<!!)\[(?P<label>(?:[^\[\]]|\[[^\]]*\])*)\]\((?P<target>[^)\s]+)\)")
IMAGE = re.compile(r"!\[[^\]]*\]\((?P<target>[^)\s]+)\)")
FENCE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)


class Item(NamedTuple):
    """A page in the list of a part."""

    title: str
    target: str
    text: str


class Part(NamedTuple):
    """A part of the documentation: its heading, the heading above it if any, its introduction and
    its pages.
    """

    title: str
    above: str
    introduction: str
    items: tuple[Item, ...]


def parts(readme: Path = DOCS / "README.md") -> tuple[Part, ...]:
    """The parts of docs/README.md, one for each heading with a list."""
    sections = re.split(
        r"^(#{2,3}) (.+)\n", readme.read_text(encoding="utf-8"), flags=re.MULTILINE
    )[1:]
    found = []
    above = ""
    for level, title, body in zip(sections[::3], sections[1::3], sections[2::3], strict=True):
        above = title if level == "##" else above
        items = tuple(
            Item(m["title"], m["target"], " ".join(m["text"].split())) for m in ITEM.finditer(body)
        )
        introduction = ITEM.sub("", body).strip()
        if items:
            found.append(Part(title, above if level == "###" else "", introduction, items))
    return tuple(found)


def documents() -> tuple[Path, ...]:
    """All pages of docs/ but the index."""
    return tuple(sorted(path for path in DOCS.rglob("*.md") if path.name != "README.md"))


def listed() -> tuple[str, ...]:
    """Targets of all links of the index, in order."""
    return tuple(item.target for part in parts() for item in part.items)


def prose(text: str) -> str:
    """A page without its code blocks."""
    return FENCE.sub("", text)


def anchors(text: str) -> set[str]:
    """Anchors of the headings of a page, as GitHub and the site form them."""
    titles = re.findall(r"^#{1,6} (.+?)\s*$", prose(text), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def broken_links(page: Path) -> list[str]:
    """Relative links and images of a page whose file or anchor does not exist."""
    text = prose(page.read_text(encoding="utf-8"))
    broken = []
    for match in [*LINK.finditer(text), *IMAGE.finditer(text)]:
        target, _, anchor = match["target"].partition("#")
        if re.match(r"[a-z]+:", target):
            continue
        file = (page.parent / target).resolve() if target else page
        if not file.exists() or (
            anchor and anchor not in anchors(file.read_text(encoding="utf-8"))
        ):
            broken.append(f"{page.name}: {match['target']}")
    return broken

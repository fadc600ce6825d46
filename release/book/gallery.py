"""Gallery: the code blocks of docs/gallery.md, run while the site is built, with the figures that
they make.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from airmuscle.core import plotting

from .contents import DOCS

PAGE = DOCS / "gallery.md"
SECTION = re.compile(
    r"^## (?P<title>.+)\n(?P<text>(?:(?!## ).*\n)*?)```python\n(?P<code>[\s\S]*?)```\n",
    re.MULTILINE,
)


class Example(NamedTuple):
    """A section of the gallery: heading, text, and code that leaves a `figure`."""

    title: str
    text: str
    code: str


def examples() -> tuple[Example, ...]:
    """All sections of the gallery."""
    text = PAGE.read_text(encoding="utf-8")
    return tuple(Example(m["title"], m["text"].strip(), m["code"]) for m in SECTION.finditer(text))


def figure_of(example: Example) -> Any:
    """The Matplotlib figure that the code of a section makes."""
    names: dict[str, Any] = {"__name__": "__main__"}
    exec(compile(example.code, f"gallery.md: {example.title}", "exec", dont_inherit=True), names)
    return names["figure"]


def write(folder: Path) -> Iterator[str]:
    """Add the figures to the page in the source folder of the site; yields the title of each
    section.
    """
    text = PAGE.read_text(encoding="utf-8")
    (folder / "images").mkdir(parents=True, exist_ok=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for number, example in enumerate(examples(), 1):
            yield example.title
            name = f"images/gallery-{number}.svg"
            plotting.save(figure_of(example), folder / name)
            text = text.replace(
                f"```python\n{example.code}",
                f"![{example.title}]({name})\n\n```python\n{example.code}",
            )
    (folder / PAGE.name).write_text(text, encoding="utf-8")

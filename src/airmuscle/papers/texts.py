"""Texts of the chapters on the papers: title, summary, answers, terms and commands, from texts.toml."""

from __future__ import annotations

import functools
import tomllib
from importlib import resources
from typing import Any


@functools.cache
def _all_texts() -> dict[str, Any]:
    return tomllib.loads(resources.files(__package__).joinpath("texts.toml").read_text(encoding="utf-8"))


def chapter_texts(paper: str) -> dict[str, Any]:
    """Return the texts of a chapter as arguments of `Chapter`; line breaks within a paragraph are spaces."""
    texts = _all_texts()[paper]
    tables = {key: tuple((k, " ".join(v.split())) for k, v in value.items())
              for key, value in texts.items() if isinstance(value, dict)}  # fmt: skip
    return {**texts, **tables}

"""Keys of `--json` that docs/reference/json-keys.md lists, and those of an answer that it lacks."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

PAGE = Path(__file__).resolve().parents[1] / "docs" / "reference/json-keys.md"
COMMON = {"title", "summary", "problems", "notes", "settings", "references", "units"}
"""Keys of every chapter."""
OPEN = "a (?:key|column) for each"
"""Mark of a list that names of the data continue."""


@functools.cache
def documented() -> dict[str, dict[str, set[str] | None]]:
    """By chapter, then by key: the columns of a table, empty for a value; None where names of the
    data are columns.

    The key "" stands for further keys of the data.
    """
    chapters: dict[str, dict[str, set[str] | None]] = {}
    for section in PAGE.read_text(encoding="utf-8").split("\n## ")[1:]:
        name, _, text = section.partition("\n")
        found = chapters[name.strip("`")] = {}
        for entry in re.split(r"\n\* ", text)[1:]:
            table, colon, columns = entry.partition("`: ")
            continued = re.search(OPEN, entry)
            names = re.findall(r"`([^`]+)`", entry[: continued.start()] if continued else entry)
            if colon:
                found[table.strip("`")] = (
                    None if continued else set(re.findall(r"`([^`]+)`", columns))
                )
            else:
                found |= {name: set() for name in names} | ({"": set()} if continued else {})
    return chapters


def undocumented(answer: Any) -> list[str]:
    """The keys of an answer that the page lacks, such as `fit.parameters.value`."""
    chapters = answer.items() if isinstance(answer, dict) else ()
    return [
        f"{name}.{key}"
        for name, chapter in chapters
        if name != "files" and isinstance(chapter, dict)
        for key in _missing(_listed(name), chapter)
    ]


def _listed(name: str) -> dict[str, set[str] | None] | None:
    """What the page lists for a chapter, whose name may have a prefix of a campaign, a number, or a
    group.
    """
    plain = re.sub(r"^(fill|release)_|(_\d+|_run|_specimen)$", "", name)
    numbered = re.sub(r"_\d+$", "_N", re.sub("^(fill|release)_", "", name))
    return next(
        (documented()[each] for each in (name, numbered, plain) if each in documented()), None
    )


def _missing(listed: dict[str, set[str] | None] | None, chapter: dict[str, Any]) -> Iterator[str]:
    if listed is None:
        yield "*"
        return
    for key, value in chapter.items():
        if key in COMMON or (key not in listed and "" in listed and not isinstance(value, list)):
            continue
        if key not in listed:
            yield key
        elif (
            isinstance(value, list)
            and value
            and isinstance(value[0], dict)
            and listed[key] is not None
        ):
            yield from (
                f"{key}.{column}" for column in value[0] if column not in (listed[key] or ())
            )

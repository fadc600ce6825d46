"""Metadata of a release: the README with links that hold outside the repository, and the addresses
of the project.

Links and pictures of the README are relative to the repository. If its address is stated in
pyproject.toml, under [tool.hatch.metadata.hooks.custom], they become absolute; otherwise a link
becomes its text and a picture is left out.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

LINK = re.compile(r"(!?)\[([^\]]*)\]\((?!\w+:)([^)]+)\)")
PAGES = {"Documentation": "docs/README.md", "Changelog": "CHANGELOG.md", "Citation": "CITATION.cff"}


def portable_readme(text: str, repository: str) -> str:
    """A text in Markdown whose relative links are addresses in a repository, or texts if it has no
    address.
    """

    def replaced(match: re.Match[str]) -> str:
        picture, label, target = match.groups()
        if not repository:
            return "" if picture else label
        return f"{picture}[{label}]({address(repository, target, raw=bool(picture))})"

    return LINK.sub(replaced, text)


def address(repository: str, path: str, *, raw: bool = False) -> str:
    """The address of a file on the branch main, in the form of the usual forges; `raw` of its
    content.
    """
    return f"{repository.rstrip('/')}/{'raw' if raw else 'blob'}/main/{path}"


class ReleaseMetadata(MetadataHookInterface):
    """Hook of hatchling: `readme` and `urls` of the project."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Add both to the metadata."""
        repository = str(self.config.get("repository", ""))
        text = (Path(self.root) / "README.md").read_text(encoding="utf-8")
        metadata["readme"] = {
            "content-type": "text/markdown",
            "text": portable_readme(text, repository),
        }
        files = {name: address(repository, path) for name, path in PAGES.items()}
        metadata["urls"] = {"Repository": repository, **files} if repository else {}

"""Results of a command: printed as a brief view or as JSON, and written, all files or none."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from ... import core, report
from ...report.chapter import Chapter
from ...report.text import as_text
from .terminal import echo, on_one_screen, print_json, terminal_width, warned

Files = Mapping[str, "str | Callable[[Path], object]"]
"""Files of a result by name: a text, or a function that writes the file at a path."""


def print_result(chapters: Sequence[Chapter], paths: Mapping[str, Path], json: bool) -> None:
    """Print chapters and the paths of their files."""
    if json:
        print_json(
            {**report.as_data(chapters), "files": {name: str(path) for name, path in paths.items()}}
        )
        return
    if on_one_screen():
        chapters = [
            replace(chapter, notes=tuple(text for text in chapter.notes if text not in warned))
            for chapter in chapters
        ]
    echo(
        as_text(
            chapters, terminal_width(), "the report" if "report" in paths else "the report of --out"
        )
    )
    for name, path in paths.items():
        echo(f"{name}: {path}")


def write_result(out: Path, chapters: Sequence[Chapter], title: str, files: Files) -> None:
    """Write the files and the report, all or none."""
    with core.atomic_folder(out) as folder:
        for name, content in files.items():
            path = folder / name
            path.parent.mkdir(exist_ok=True)
            if isinstance(content, str):
                path.write_text(content, encoding="utf-8")
            else:
                content(path)
        if title:
            report.write_into(folder, chapters, title=title)

"""Delivery of a result: its files, all or none, and its brief view in the terminal, or JSON."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from ...core import atomic_folder
from ...report.chapter import Chapter
from ...report.data import as_data, in_words
from ...report.text import as_text
from ...report.write import REPORT_FILE, write_into
from .terminal import echo, in_options, on_one_screen, print_json, terminal_width, warned

Files = Mapping[str, "str | Callable[[Path], object]"]
"""Files of a result by name: a text, or a function that writes the file at a path."""
WITHOUT_REPORT = "the report of --out"


def deliver(
    command: str, chapters: Sequence[Chapter], *, json: bool, out: Path | None = None, title: str = "",
    files: Files | None = None, others: Mapping[str, Path] | None = None, writes: bool = True,
) -> None:  # fmt: skip
    """Write the files and the report of a result into a folder, if there is one, and print the result.

    command  whose options the hints of the texts name
    title    of the report; without one no report is written
    others   files elsewhere that are named with those of the folder
    writes   whether this process writes the files; otherwise it names those that another one writes
    """
    worded, paths = [in_words(each, lambda text: in_options(text, command)) for each in chapters], dict(others or {})
    if out is not None:
        if writes:
            write_result(out, worded, title, files or {})
        for name in (*(files or {}), *([REPORT_FILE] if title else [])):
            path = Path(name) if len(Path(name).parts) == 1 else Path(name).parent  # the files of a folder as one
            paths[path.stem] = out / path
    print_result(worded, paths, json)


def print_result(chapters: Sequence[Chapter], paths: Mapping[str, Path], json: bool) -> None:
    """Print chapters and the paths of their files."""
    if json:
        print_json({**as_data(chapters), "files": {name: str(path) for name, path in paths.items()}})
        return
    if on_one_screen():
        chapters = [replace(each, notes=tuple(text for text in each.notes if text not in warned)) for each in chapters]
    echo(as_text(chapters, terminal_width(), "the report" if "report" in paths else WITHOUT_REPORT))
    for name, path in paths.items():
        echo(f"{name}: {path}")


def write_result(out: Path, chapters: Sequence[Chapter], title: str, files: Files) -> None:
    """Write the files and the report, all or none."""
    with atomic_folder(out) as folder:
        for name, content in files.items():
            path = folder / name
            path.parent.mkdir(exist_ok=True)
            if isinstance(content, str):
                path.write_text(content, encoding="utf-8")
            else:
                content(path)
        if title:
            write_into(folder, chapters, title=title)

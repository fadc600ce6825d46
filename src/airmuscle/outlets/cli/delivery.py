"""Delivery of a result: its files, all or none, and its brief view in the terminal, or JSON; the
processes that compute it: --workers, --dask, --join."""

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from ...core import FolderInUseError, atomic_folder, check_writable
from ...engine.executors import SharedFolder, dask_cluster, shared_folder
from ...engine.processes import Workers, available_cores
from ...report.chapter import Chapter
from ...report.data import as_data, in_words
from ...report.text import as_text
from ...report.write import REPORT_FILE, write_into
from ..requests.declaration import RequestError, Where, optional, request
from .terminal import echo, in_options, on_one_screen, print_json, terminal_width, warned

Files = Mapping[str, "str | Callable[[Path], object]"]
"""Files of a result by name: a text, or a function that writes the file at a path."""


def deliver(
    command: str,
    chapters: Sequence[Chapter],
    *,
    json: bool,
    out: Path | None = None,
    title: str = "",
    files: Files | None = None,
    others: Mapping[str, Path] | None = None,
    writes: bool = True,
) -> None:
    """Write the files and the report of a result into a folder, if there is one, and print the
    result.

    command  whose options the hints of the texts name
    title    of the report; without one no report is written
    others   files elsewhere that are named with those of the folder
    writes   whether this process writes the files; otherwise it names those that another one writes
    """
    worded = [in_words(each, lambda text: in_options(text, command)) for each in chapters]
    paths = dict(others or {})
    if out is not None:
        if writes:
            write_result(out, worded, title, files or {})
        for name in (*(files or {}), *([REPORT_FILE] if title else [])):
            path = (
                Path(name) if len(Path(name).parts) == 1 else Path(name).parent
            )  # the files of a folder as one
            paths[path.stem] = out / path
    print_result(worded, paths, json)


def print_result(chapters: Sequence[Chapter], paths: Mapping[str, Path], json: bool) -> None:
    """Print chapters and the paths of their files."""
    if json:
        print_json(
            {**as_data(chapters), "files": {name: str(path) for name, path in paths.items()}}
        )
        return
    if on_one_screen():
        chapters = [
            replace(each, notes=tuple(text for text in each.notes if text not in warned))
            for each in chapters
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


@request
class Execution:
    """The processes that compute a command."""

    workers: int | None = optional(
        "Number of local processes; by default as many as cores, or one that uses all cores.",
        bounds=(1, 1024),
    )
    dask: str | None = optional(
        "Use a running Dask cluster, such as tcp://host:8786.", metavar="ADDRESS"
    )
    join: Path | None = optional(
        "Share the computation with all processes that run the same command with this folder, on"
        " any machines.",
        metavar="FOLDER",
    )

    def check(self, where: Where) -> None:
        """Refuse a cluster together with local processes."""
        if self.dask is not None and (self.workers is not None or self.join is not None):
            raise RequestError(
                f"{where('join' if self.workers is None else 'workers')} and {where('dask')}"
                " exclude each other: a Dask cluster has its own workers."
            )

    @contextlib.contextmanager
    def executor(self, tasks: int | None = None, *, alone: bool = False) -> Iterator[Workers]:
        """Yield the executor, or the number of local processes; `tasks` limits the latter, which is
        by default the number of cores, or 1 for what uses all cores `alone`.

        At the end it is stated which processes have computed how many tasks of a shared folder.
        """
        local = self.workers or (1 if alone and self.join is None else available_cores())
        if self.dask is not None:
            with dask_cluster(self.dask) as cluster:
                yield cluster
        elif self.join is not None:
            with shared_folder(self.join, local) as folder:
                try:
                    yield folder
                finally:
                    echo(contributions(folder), err=True)
        else:
            yield min(local, tasks or local)

    def writes(self, out: Path) -> bool:
        """Whether this process writes the output; false with a message if another one does. Raises
        FileError.
        """
        try:
            check_writable(out)
        except FolderInUseError:
            if self.join is None:
                raise
            echo(
                f"{out} is written by another process; this one computes for {self.join} only",
                err=True,
            )
            return False
        return True

    def takes_over(self, out: Path) -> bool:
        """Whether the process that was to write the output has ended without it, so that this one
        writes it.
        """
        with contextlib.suppress(FolderInUseError):
            if not (out / REPORT_FILE).exists():
                check_writable(out)
                return True
        return False


def contributions(folder: SharedFolder) -> str:
    """The number of results of each process, and of the tasks that are left, in one line."""
    shares = ", ".join(f"{count} by {name}" for name, count in sorted(folder.contributions.items()))
    left = f"; {folder.left} are left" if folder.left else ""
    return f"Tasks of the shared folder: {shares or 'none completed'}{left}"

"""Delivery of a result: its files, all or none, and its brief view in the terminal, or JSON; the
processes that compute it: --workers, --cluster; and the store of what they have finished."""

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from ... import engine
from ...core import AirmuscleError, FileError, SimulationError, counted
from ...engine.processes import Workers, available_cores
from ...engine.result_store import STORE_FOLDER, ResultStore, current_store, result_store
from ...report.chapter import Chapter
from ...report.data import in_words
from ...report.write import REPORT_FILE
from .. import cli
from ..requests.declaration import RequestError, Where, optional, request
from .printing import Files, print_result, write_result
from .terminal import echo


def deliver(
    command: str,
    chapters: Sequence[Chapter],
    *,
    json: bool,
    out: Path | None = None,
    title: str = "",
    files: Files | None = None,
    others: Mapping[str, Path] | None = None,
    complete: bool = True,
) -> None:
    """Write the files and the report of a result into a folder, if there is one, and print the
    result. The stored results of its tasks are then removed.

    command  whose options the hints of the texts name
    title    of the report; without one no report is written
    others   files elsewhere that are named with those of the folder
    complete whether nothing remains to be computed, so that the results of tasks are removed
    """
    worded = [in_words(chapter, lambda text: cli.in_options(text, command)) for chapter in chapters]
    paths = dict(others or {})
    if out is not None:
        write_result(out, worded, title, files or {})
        if complete:
            ResultStore(out / STORE_FOLDER).remove()
        for name in (*(files or {}), *([REPORT_FILE] if title else [])):
            path = (
                Path(name) if len(Path(name).parts) == 1 else Path(name).parent
            )  # the files of a folder as one
            paths[path.stem] = out / path
    print_result(worded, paths, json)


@request
class Execution:
    """The processes that compute a command."""

    workers: int | None = optional(
        "Number of local processes; by default as many as cores, or one that uses all cores.",
        bounds=(1, 1024),
    )
    cluster: str | None = optional(
        "Compute on a Dask cluster: the address or the scheduler file of a running one, or a TOML"
        " file that describes one.",
        metavar="ADDRESS|FILE",
    )

    def check(self, where: Where) -> None:
        """Refuse a cluster together with local processes."""
        if self.cluster is not None and self.workers is not None:
            raise RequestError(
                f"{where('workers')} and {where('cluster')} exclude each other: a cluster has its"
                " own workers."
            )

    @contextlib.contextmanager
    def executor(
        self, out: Path | None, tasks: int | None = None, *, alone: bool = False
    ) -> Iterator[Workers]:
        """Yield the executor, or the number of local processes; results are stored beside the
        output, `out`, and taken from there after an interruption.

        `tasks` limits the number of local processes, which is by default that of the cores, or 1
        for what uses all cores `alone`.
        """
        local = self.workers or (1 if alone else available_cores())
        with stored_results(out):
            if self.cluster is None:
                yield min(local, tasks or local)
                return
            with engine.dask_cluster(self.cluster, lambda text: echo(text, err=True)) as cluster:
                yield cluster


@contextlib.contextmanager
def stored_results(out: Path | None) -> Iterator[None]:
    """A context manager for the store in the folder of the output; says where a command resumes."""
    if out is None or current_store() is not None:
        yield
        return
    folder = out / STORE_FOLDER
    with result_store(folder, lambda: echo(f"resuming from the results in {folder}", err=True)) as (
        store
    ):
        try:
            yield
        except (SimulationError, FileError, KeyboardInterrupt):
            if count := store.recalled + store.saved:
                results = counted(count, "result")
                echo(f"{results} saved in {folder}; the same command resumes from there", err=True)
            raise
        except AirmuscleError:  # the data or the request do not allow a result
            store.remove()
            raise

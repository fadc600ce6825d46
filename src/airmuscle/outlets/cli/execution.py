"""Options that distribute a command among processes and machines: --workers, --dask, --join."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

from ...core.atomic_output import check_writable, temporary_folder
from ...core.errors import FolderInUseError, InputError
from ...engine.executors import SharedFolder, dask_cluster, shared_folder
from ...engine.processes import Workers, available_cores
from .terminal import echo

WorkerCount = Annotated[
    int | None,
    typer.Option("--workers", min=1, max=1024, metavar="N", help="Number of local processes; default: one per core."),
]
DaskAddress = Annotated[
    str | None, typer.Option("--dask", metavar="ADDRESS", help="Use a running Dask cluster, such as tcp://host:8786.")
]
JoinedFolder = Annotated[
    Path | None,
    typer.Option(
        "--join",
        metavar="FOLDER",
        help="Share the computation with all processes that run the same command with this folder, on any machines.",
    ),
]


@dataclasses.dataclass(frozen=True)
class Execution:
    """The processes that compute a command. Raises InputError for a cluster together with local processes."""

    workers: int | None = None
    dask: str | None = None
    join: Path | None = None

    def __post_init__(self) -> None:
        if self.dask is not None and (self.workers is not None or self.join is not None):
            raise InputError(
                f"--{'join' if self.workers is None else 'workers'} and --dask exclude each other: a Dask cluster has "
                "its own workers."
            )

    @contextlib.contextmanager
    def executor(self, tasks: int | None = None) -> Iterator[Workers]:
        """Yield the executor, or the number of local processes; `tasks` limits the latter.

        At the end it is stated which processes have computed how many tasks of a shared folder.
        """
        local = self.workers or available_cores()
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

    @contextlib.contextmanager
    def output(self, out: Path) -> Iterator[Path]:
        """Yield the folder of the output; if another joined process writes to it, a temporary one."""
        if self.join is not None:
            try:
                check_writable(out)
            except FolderInUseError:
                echo(f"{out} is written by another process; this one computes for {self.join} only", err=True)
                with temporary_folder() as scratch:
                    yield scratch
                return
        yield out


def contributions(folder: SharedFolder) -> str:
    """The number of results of each process, and of the tasks that are left, in one line."""
    shares = ", ".join(f"{count} by {name}" for name, count in sorted(folder.contributions.items()))
    left = f"; {folder.left} are left" if folder.left else ""
    return f"Tasks of the shared folder: {shares or 'none completed'}{left}"

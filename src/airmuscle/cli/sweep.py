"""`airmuscle sweep`: many runs of one scenario."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .interruption import check_interrupted
from .options import Folder, Json
from .terminal import print_json, print_table

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from ..report.chapter import Table
    from ..study import Study, StudyResult


def sweep(
    study: Annotated[
        Path,
        typer.Argument(metavar="STUDY.toml", help="A file with scenario, [vary], [design] and [metrics]."),
    ],
    out: Folder = Path("study"),
    workers: Annotated[
        int | None, typer.Option(min=1, max=1024, help="Processes on this machine; all cores unless given.")
    ] = None,
    dask: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="A running Dask cluster instead: tcp://host:8786.")
    ] = None,
    json: Json = False,
) -> None:
    """Run a study: a scenario many times, with numbers that vary on a grid or by chance.

    \b
    Writes DIR/results.csv (one row a run), DIR/report.html, DIR/figures/ and DIR/data/.
    What is done is kept in DIR/chunks at once: after Ctrl-C or a kill the same command goes on from there, and
    the result is the same to the last bit. A run that fails leaves its reason in results.csv.

    \b
    Examples:
      airmuscle sweep examples/valve_study.toml --out study
      airmuscle sweep study.toml --workers 8
      airmuscle sweep study.toml --dask tcp://head-node:8786
    """
    from ..core.errors import InputError, SimulationError
    from ..study import load_study
    from ..study.chapter import write_study

    if workers is not None and dask is not None:
        raise InputError("--workers and --dask exclude each other: a Dask cluster has its own workers.")
    result = _run(load_study(study), out, workers, dask)
    page = write_study(result, out)
    if json:
        print_json(_as_data(result))
    else:
        _print(result)
    if result.failed.size == len(result.study):
        raise SimulationError(f"all {len(result.study)} runs failed; the first because: {result.failure_reasons[0]}")
    if not json:
        typer.echo(f"results: {out / 'results.csv'}")
        typer.echo(f"report: {page}")


def _run(study: Study, out: Path, workers: int | None, dask: str | None) -> StudyResult:
    """The study's result; when it ends early, a line says what is kept and how to go on."""
    from ..core.errors import AirmuscleError
    from ..study import run_study
    from ..study.run import count_finished_runs

    try:
        with _bar(study.title) as show, _executor(study, workers, dask) as executor:
            return run_study(study, out, executor, show)
    except (AirmuscleError, KeyboardInterrupt):
        if done := count_finished_runs(study, out):  # counted on disk: a run may have been completed during the abort
            saved = f"{done} of {len(study)} runs are saved in {out / 'chunks'}"
            typer.echo(f"{saved}; the same command resumes from there", err=True)
        raise


def _executor(
    study: Study, workers: int | None, dask: str | None
) -> contextlib.AbstractContextManager[Executor | None]:
    from ..study import dask_cluster, process_pool
    from ..study.executors import available_cores

    if dask is not None:
        return dask_cluster(dask)
    return process_pool(min(workers or available_cores(), len(study.chunks)))


@contextlib.contextmanager
def _bar(title: str) -> Iterator[Callable[[int, int], None]]:
    """A bar on stderr while the block lasts."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("runs"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title, total=None)

        def show(done: int, of: int) -> None:
            check_interrupted()
            if done and bar.tasks[task].total is None:  # the first call states the runs saved by an earlier command
                typer.echo(f"resuming: {done} of {of} runs are already saved", err=True)
            bar.update(task, completed=done, total=of)

        yield show


def _print(result: StudyResult) -> None:
    from ..study.chapter import failure_table, sensitivity_table

    study, indices = result.study, result.indices()
    failed = f", {result.failed.size} failed" if result.failed.size else ""
    typer.echo(f"{study.title}: {len(study)} runs{failed}, {study.design}")
    if study.scalars:
        _print_table(result.statistics())
    if indices:
        _print_table(sensitivity_table(study, indices))
    if result.failed.size:
        _print_table(failure_table(result))


def _print_table(table: Table) -> None:
    from ..report.formatting import format_number, table_rows

    words = [
        tuple(value if isinstance(value, str) else _short(format_number(value)) for value in row)
        for row in table_rows(table)
    ]
    numeric = [h.strip() for h, values in table.columns.items() if not isinstance(next(iter(values)), str)]
    print_table([header.strip() for header in table.columns], words, right=numeric)


def _short(text: str) -> str:
    """Four digits are enough beside each other."""
    try:
        return f"{float(text):.4g}" if "." in text or "e" in text else text
    except ValueError:
        return text


def _as_data(result: StudyResult) -> dict[str, Any]:
    study = result.study
    statistics = result.statistics().columns if study.scalars else {}
    indices = {
        name: {
            "first_order": found.first,
            "first_order_interval": found.first_interval,
            "total": found.total,
            "total_interval": found.total_interval,
        }
        for name, found in result.indices().items()
    }
    return {
        "title": study.title,
        "runs": len(study),
        "failed": int(result.failed.size),
        "varied": [number.path for number in study.parameters],
        "metrics": {
            name: {key: values[i] for key, values in statistics.items() if key != "metric"}
            for i, name in enumerate(study.scalars)
        },
        "sensitivities": indices,
    }

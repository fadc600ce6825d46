"""`airmuscle study`: parameter study of a scenario."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, Any

import typer

from ...core.errors import AirmuscleError, SimulationError
from ...design.study import Study, StudyResult, load_study, run_study
from ...design.study.chapter import failure_table, sensitivity_table, write_study
from ...design.study.run import count_finished_runs
from ...engine.executors import SharedFolder
from ...engine.processes import process_pool
from ...report.chapter import Table
from ...report.formatting import format_number, table_rows
from .execution import DaskAddress, Execution, JoinedFolder, WorkerCount, contributions
from .interruption import check_interrupted
from .options import Folder, Json
from .terminal import echo, print_json, print_table


def study(
    file: Annotated[
        Path,
        typer.Argument(metavar="STUDY.toml", help="A file with scenario, [vary], [design] and [metrics]."),
    ],
    out: Folder = Path("study"),
    workers: WorkerCount = None,
    dask: DaskAddress = None,
    join: JoinedFolder = None,
    json: Json = False,
) -> None:
    """Run a parameter study of a scenario.

    \b
    The parameters vary on a grid or randomly. Writes DIR/results.csv (one row per run), DIR/report.html, DIR/figures/
    and DIR/data/. Completed runs are saved in DIR/chunks: after an interruption the same command resumes the study,
    with bit-identical results. If a run fails, results.csv states the reason.

    \b
    Examples:
      airmuscle study examples/valve_study.toml --out study
      airmuscle study study.toml --workers 8
      airmuscle study study.toml --dask tcp://head-node:8786
      airmuscle study study.toml --join /shared/study    (on each machine)
    """
    execution = Execution(workers, dask, join)
    with execution.output(out) as folder:
        result, shares = _run(load_study(file), folder, execution)
        page = write_study(result, folder, execution=shares)
    if json:
        print_json(_to_dict(result))
    else:
        _print(result)
    if result.failed.size == len(result.study):
        raise SimulationError(f"all {len(result.study)} runs failed; reason of the first: {result.failure_reasons[0]}")
    if not json and folder == out:
        echo(f"results: {out / 'results.csv'}")
        echo(f"report: {page}")


def _run(study: Study, out: Path, execution: Execution) -> tuple[StudyResult, str]:
    """The result of the study, and a sentence on the processes that share it.

    If it is aborted, a message states how many runs were saved.
    """
    try:
        with (
            _progress(study.title) as show,
            execution.executor(len(study.chunks)) as workers,
            process_pool(workers) as executor,
        ):
            result = run_study(study, out, executor, show)
        return result, f"{contributions(workers)}." if isinstance(workers, SharedFolder) else ""
    except (AirmuscleError, KeyboardInterrupt):
        if done := count_finished_runs(study, out):  # counted on disk: a run may have been completed during the abort
            saved = f"{done} of {len(study)} runs are saved in {out / 'chunks'}"
            echo(f"{saved}; the same command resumes from there", err=True)
        raise


@contextlib.contextmanager
def _progress(title: str) -> Iterator[Callable[[int, int], None]]:
    """Yield a callback (runs done, runs in total) that draws a progress bar on stderr."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("runs"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as display:
        task = display.add_task(title, total=None)

        def show(done: int, total: int) -> None:
            check_interrupted()
            if done and display.tasks[task].total is None:  # first call: runs saved by an earlier command
                echo(f"resuming: {done} of {total} runs are already saved", err=True)
            display.update(task, completed=done, total=total)

        yield show


def _print(result: StudyResult) -> None:
    study, indices = result.study, result.indices()
    failed = f", {result.failed.size} failed" if result.failed.size else ""
    echo(f"{study.title}: {len(study)} runs{failed}, {study.design}")
    if study.scalars:
        _print_table(result.statistics())
    if indices:
        _print_table(sensitivity_table(study, indices))
    if result.failed.size:
        _print_table(failure_table(result))


def _print_table(table: Table) -> None:
    if "unit" in table.columns:
        units = ["" if unit == "1" else unit for unit in table.columns["unit"]]
        table = dataclasses.replace(table, columns={**table.columns, "unit": units})
    rows = [
        tuple(value if isinstance(value, str) else _round(format_number(value)) for value in r)
        for r in table_rows(table)
    ]
    numeric = [h.strip() for h, values in table.columns.items() if not isinstance(next(iter(values)), str)]
    print_table([header.strip() for header in table.columns], rows, right=numeric)


def _round(text: str) -> str:
    """A number with four significant digits; other texts are unchanged."""
    try:
        return f"{float(text):.4g}" if "." in text or "e" in text else text
    except ValueError:
        return text


def _to_dict(result: StudyResult) -> dict[str, Any]:
    """A study as plain data, all numbers SI."""
    study = result.study
    statistics = result.statistics().columns if study.scalars else {}
    return {
        "title": study.title,
        "runs": len(study),
        "failed": int(result.failed.size),
        "varied": [parameter.path for parameter in study.parameters],
        "metrics": {
            name: {key: values[i] for key, values in statistics.items() if key != "metric"}
            for i, name in enumerate(study.scalars)
        },
        "sensitivities": {
            name: {
                "first_order": indices.first,
                "first_order_interval": indices.first_interval,
                "total": indices.total,
                "total_interval": indices.total_interval,
            }
            for name, indices in result.indices().items()
        },
    }

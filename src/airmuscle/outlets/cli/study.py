"""`airmuscle study`: parameter study of a scenario."""

from pathlib import Path
from typing import Annotated

from ...core import AirmuscleError, SimulationError, new_figure
from ...design.study import Study, StudyResult, load_study, run_study
from ...design.study.chunk import count_finished_runs
from ...design.study.result import RESULTS_FILE, write_study
from ...engine.executors import SharedFolder
from ...engine.processes import process_pool
from ...report.write import REPORT_FILE
from .delivery import Execution, contributions, print_result
from .options import Folder, Json, argument, with_requests
from .terminal import counted_progress, echo

StudyFile = Annotated[
    Path, argument("STUDY.toml", "A file with scenario, [vary], [design] and [metrics].")
]


@with_requests
def study(
    file: StudyFile, execution: Execution, out: Folder = Path("study"), json: Json = False
) -> None:
    """Run a parameter study of a scenario.

    \b
    The parameters vary on a grid or randomly. Writes DIR/results.csv (one row per run),
    DIR/report.html, DIR/figures/ and DIR/data/. Completed runs are saved in DIR/chunks, or in the
    folder of --join: after an interruption the same command resumes the study, with bit-identical
    results. If a run fails, results.csv states the reason.

    \b
    Examples:
      airmuscle study examples/valve_study.toml --out study
      airmuscle study study.toml --workers 8
      airmuscle study study.toml --dask tcp://head-node:8786
      airmuscle study study.toml --join /shared/study    (on each machine)
    """
    loaded = load_study(file)
    writes = execution.writes(out)
    if writes and execution.join is not None:
        new_figure()  # imports Matplotlib while the other processes compute, which draw no figures
    result, shares = _run(loaded, out if execution.join is None else None, execution)
    writes = writes or execution.takes_over(out)
    if writes or json:
        chapter = result.chapter(execution=shares)
        page = write_study(result, out, chapter) if writes else out / REPORT_FILE
        print_result([chapter], {"results": out / RESULTS_FILE, "report": page}, json)
    if result.failed.size == len(result.study):
        raise SimulationError(
            f"all {len(result.study)} runs failed; reason of the first: {result.failure_reasons[0]}"
        )


def _run(study: Study, folder: Path | None, execution: Execution) -> tuple[StudyResult, str]:
    """The result of the study, and a sentence on the processes that share it. Messages state how
    many are saved.
    """
    first = iter([True])

    def show(done: int, total: int) -> None:
        draw("runs", done, total)
        if next(first, False) and done:
            echo(f"resuming: {done} of {total} runs are already saved", err=True)

    try:
        with (
            counted_progress("runs") as draw,
            execution.executor(len(study.chunks)) as workers,
            process_pool(workers) as executor,
        ):
            result = run_study(study, folder, executor, show)
        return result, f"{contributions(workers)}." if isinstance(workers, SharedFolder) else ""
    except (AirmuscleError, KeyboardInterrupt):
        if folder and (
            done := count_finished_runs(study, folder)
        ):  # one may have been completed during the abort
            saved = f"{done} of {len(study)} runs are saved in {folder / 'chunks'}"
            echo(f"{saved}; the same command resumes from there", err=True)
        raise

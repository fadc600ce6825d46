"""`airmuscle study`: parameter study of a scenario."""

from pathlib import Path
from typing import Annotated

from ...core import SimulationError, check_writable
from ...design.study import load_study, run_study
from ...design.study.result import RESULTS_FILE, write_study
from ...engine.processes import process_pool
from .delivery import Execution
from .options import Folder, Json
from .parser import Argument
from .printing import print_result
from .requested import with_requests
from .terminal import counted_progress

StudyFile = Annotated[
    Path, Argument("STUDY.toml", "A file with scenario, [vary], [design] and [metrics].")
]


@with_requests
def study(
    file: StudyFile, execution: Execution, out: Folder = Path("study"), json: Json = False
) -> None:
    """Run a parameter study of a scenario.

    \b
    The parameters vary on a grid or randomly. Writes DIR/results.csv (one row per run),
    DIR/report.html, DIR/figures/ and DIR/data/. Completed runs are stored in DIR/tasks: after an
    interruption the same command resumes the study, with bit-identical results, and a larger study
    computes the further runs alone. If a run fails, results.csv states the reason.

    \b
    Examples:
      airmuscle study examples/valve_study.toml --out study
      airmuscle study study.toml --workers 8
      airmuscle study study.toml --cluster tcp://head-node:8786
      airmuscle study study.toml --cluster cluster.toml
    """
    loaded = load_study(file)
    check_writable(out)
    with (
        counted_progress("runs") as show,
        execution.executor(out, len(loaded.chunks)) as workers,
        process_pool(workers) as executor,
    ):
        result = run_study(loaded, None, executor, lambda done, total: show("runs", done, total))
    chapter = result.chapter()
    page = write_study(result, out, chapter)
    print_result([chapter], {"results": out / RESULTS_FILE, "report": page}, json)
    if result.failed.size == len(result.study):
        raise SimulationError(
            f"all {len(result.study)} runs failed; reason of the first: {result.failure_reasons[0]}"
        )

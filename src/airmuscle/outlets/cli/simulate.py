"""`airmuscle simulate` and `airmuscle study`: runs of a scenario file; `airmuscle schema`: its JSON schema."""

from pathlib import Path
from typing import Annotated, Any

import typer

from ...bench.readers import write
from ...core import AirmuscleError, SimulationError, atomic_folder, check_writable, new_figure
from ...design.study import Study, StudyResult, load_study, run_study
from ...design.study.chapter import RESULTS_FILE, study_chapter, write_study
from ...design.study.chunk import count_finished_runs
from ...design.study.paths import changed_scenario
from ...engine.executors import SharedFolder
from ...engine.processes import process_pool
from ...files.scenario import Scenario, load_scenario, muscle_schema, scenario_schema
from ...files.scenario.simulation_chapter import run_chapter
from ...recording import Recording
from ...report.chapter import Chapter
from ...report.data import as_json
from ...report.write import REPORT_FILE
from ..requests import many, read_pair, request
from .delivery import Execution, Files, contributions, deliver, print_result, write_result
from .options import Folder, Json, argument, complete_plant, with_requests
from .terminal import counted_progress, echo, print_json

SCENARIO = "A file with [plant], [input] and [run], or the name of a plant of the library."
ScenarioFile = Annotated[Path, argument("SCENARIO.toml", SCENARIO, complete_plant)]
StudyFile = Annotated[Path, argument("STUDY.toml", "A file with scenario, [vary], [design] and [metrics].")]


@request
class SimulateRequest:
    """How a simulation differs from its scenario file."""

    set: tuple[Any, ...] = many(
        "Another value of a number of the scenario, by its path as in a study: 'mechanism.mass=12 kg', "
        "run.duration=10. Repeatable.", metavar="PATH=VALUE", read=read_pair,
    )  # fmt: skip


@with_requests
def simulate(scenario: ScenarioFile, request: SimulateRequest, out: Folder = Path("run"), json: Json = False) -> None:
    """Simulate the plant of a scenario file.

    \b
    Writes DIR/recording.csv, which has the format of a measurement file, DIR/report.html and DIR/figures/.
    If a run is aborted, the partial results are written and the exit code is 1; the error states time, reason, state
    and remedy.

    \b
    Examples:
      airmuscle simulate examples/fill_discharge.toml --out run
      airmuscle simulate joint-dmsp-20-matrix --out run
      airmuscle simulate examples/fill_discharge.toml --set "mechanism.mass=12 kg" --set run.duration=10 --out run
    """
    loaded = changed_scenario(scenario, dict(request.set)) if request.set else load_scenario(scenario)
    check_writable(out)
    try:
        recording = loaded.simulate()
    except SimulationError as error:
        if error.recording is not None and len(error.recording):
            write_result(out, *_results(loaded, error.recording))
            echo(f"partial results were written to {out}", err=True)
        if error.interrupted:
            raise KeyboardInterrupt from None
        raise
    chapters, title, files = _results(loaded, recording)
    deliver("simulate", chapters, json=json, out=out, title=title, files=files)


def _results(scenario: Scenario, recording: Recording) -> tuple[list[Chapter], str, Files]:
    """The chapters, the title of the report, and the file of the recording."""
    files = {"recording.csv": lambda path: write(scenario.select_columns(recording), path)}
    return [run_chapter(scenario, recording)], "Simulation", files


@with_requests
def study(file: StudyFile, execution: Execution, out: Folder = Path("study"), json: Json = False) -> None:
    """Run a parameter study of a scenario.

    \b
    The parameters vary on a grid or randomly. Writes DIR/results.csv (one row per run), DIR/report.html, DIR/figures/
    and DIR/data/. Completed runs are saved in DIR/chunks, or in the folder of --join: after an interruption the same
    command resumes the study, with bit-identical results. If a run fails, results.csv states the reason.

    \b
    Examples:
      airmuscle study examples/valve_study.toml --out study
      airmuscle study study.toml --workers 8
      airmuscle study study.toml --dask tcp://head-node:8786
      airmuscle study study.toml --join /shared/study    (on each machine)
    """
    loaded, writes = load_study(file), execution.writes(out)
    if writes and execution.join is not None:
        new_figure()  # imports Matplotlib while the other processes compute, which draw no figures
    result, shares = _run(loaded, out if execution.join is None else None, execution)
    writes = writes or execution.takes_over(out)
    if writes or json:
        chapter = study_chapter(result, execution=shares)
        page = write_study(result, out, chapter) if writes else out / REPORT_FILE
        print_result([chapter], {"results": out / RESULTS_FILE, "report": page}, json)
    if result.failed.size == len(result.study):
        raise SimulationError(f"all {len(result.study)} runs failed; reason of the first: {result.failure_reasons[0]}")


def _run(study: Study, folder: Path | None, execution: Execution) -> tuple[StudyResult, str]:
    """The result of the study, and a sentence on the processes that share it.

    A message states how many runs an earlier command has saved in the folder, and at an abort how many are saved.
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
        if folder and (done := count_finished_runs(study, folder)):  # one may have been completed during the abort
            saved = f"{done} of {len(study)} runs are saved in {folder / 'chunks'}"
            echo(f"{saved}; the same command resumes from there", err=True)
        raise


OfMuscles = Annotated[bool, typer.Option("--muscle", help="The schema of muscle files; default: of scenario files.")]
WRITTEN = "Output file; default: print to stdout."
SchemaFile = Annotated[Path | None, typer.Option("--out", metavar="FILE", help=WRITTEN)]


def schema(muscle: OfMuscles = False, out: SchemaFile = None) -> None:
    """Print the JSON schema of scenario or muscle files.

    \b
    Editors use the schema to check and complete TOML files. It is generated from the models of this version, so it
    allows exactly what this version reads.
    The first line of a TOML file names its schema: #:schema scenario.schema.json

    \b
    Examples:
      airmuscle schema --out scenario.schema.json
      airmuscle schema --muscle --out muscle.schema.json
    """
    content = muscle_schema() if muscle else scenario_schema()
    if out is None:
        print_json(content)
        return
    if not out.name:
        raise typer.BadParameter("--out must be a file name, such as scenario.schema.json")
    with atomic_folder(out.parent) as folder:
        (folder / out.name).write_text(as_json(content), encoding="utf-8")
    echo(f"schema: {out}")

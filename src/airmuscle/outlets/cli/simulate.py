"""`airmuscle simulate`: run of a scenario file; `airmuscle schema`: its JSON schema."""

from pathlib import Path
from typing import Annotated, Any

import click

from ...bench.readers import write
from ...core import SimulationError, atomic_folder, check_writable
from ...design.study.paths import changed_scenario
from ...files.scenario import Scenario, load_scenario, muscle_schema, scenario_schema
from ...files.scenario.simulation_chapter import run_chapter
from ...recording import Recording
from ...report.chapter import Chapter
from ...report.json_text import as_json
from ..requests import many, read_pair, request
from .delivery import deliver
from .options import Folder, Json, complete_plant
from .parser import Argument, CommandOption
from .printing import Files, write_result
from .requested import with_requests
from .terminal import echo, print_json

SCENARIO = "A file with [plant], [input] and [run], or the name of a plant of the library."
ScenarioFile = Annotated[Path, Argument("SCENARIO.toml", SCENARIO, complete_plant)]


@request
class SimulateRequest:
    """How a simulation differs from its scenario file."""

    set: tuple[Any, ...] = many(
        "Another value of a number of the scenario, by its path as in a study: 'mechanism.mass=12"
        " kg', 'run.duration=10 s'. Repeatable.",
        metavar="PATH=VALUE",
        read=read_pair,
    )


@with_requests
def simulate(
    scenario: ScenarioFile, request: SimulateRequest, out: Folder = Path("run"), json: Json = False
) -> None:
    """Simulate the plant of a scenario file.

    \b
    Writes DIR/recording.csv, which has the format of a measurement file, DIR/report.html and
    DIR/figures/. If a run is aborted, the partial results are written and the exit code is 1; the
    error states time, reason, state and remedy.

    \b
    Examples:
      airmuscle simulate examples/fill_discharge.toml --out run
      airmuscle simulate joint-dmsp-20-matrix --out run
      airmuscle simulate examples/fill_discharge.toml --set "mechanism.mass=12 kg" --set
          "run.duration=10 s" --out run
    """
    loaded = (
        changed_scenario(scenario, dict(request.set)) if request.set else load_scenario(scenario)
    )
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


OfMuscles = Annotated[
    bool, CommandOption("--muscle", "The schema of muscle files; default: of scenario files.")
]
WRITTEN = "Output file; default: print to stdout."
SchemaFile = Annotated[Path | None, CommandOption("--out", WRITTEN, "FILE")]


def schema(muscle: OfMuscles = False, out: SchemaFile = None) -> None:
    """Print the JSON schema of scenario or muscle files.

    \b
    Editors use the schema to check and complete TOML files. It is generated from the models of this
    version, so it allows exactly what this version reads. The first line of a TOML file names its
    schema: #:schema scenario.schema.json

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
        raise click.BadParameter("--out must be a file name, such as scenario.schema.json")
    with atomic_folder(out.parent) as folder:
        (folder / out.name).write_text(as_json(content), encoding="utf-8")
    echo(f"schema: {out}")

"""`airmuscle simulate`: simulation of a scenario file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...bench.readers import write
from ...core.atomic_output import atomic_folder, check_writable
from ...core.errors import SimulationError
from ...files.scenario.scenario import Scenario, load_scenario
from ...files.scenario.simulation_chapter import run_chapter
from ...recording import Recording
from ...recording.recording import column_heading
from ...report.formatting import format_number
from ...report.write import write_into
from .completion import complete_plant
from .options import Folder, Json
from .terminal import echo, print_json, print_table


def simulate(
    scenario: Annotated[
        Path,
        typer.Argument(
            metavar="SCENARIO.toml",
            help="A file with [plant], [input] and [run], or the name of a plant of the library.",
            autocompletion=complete_plant,
        ),
    ],
    out: Folder = Path("run"),
    json: Json = False,
) -> None:
    """Simulate the plant of a scenario file.

    \b
    Writes DIR/recording.csv, which has the format of a measurement file, DIR/report.html and DIR/figures/.
    If a run is aborted, the partial results are written and the exit code is 1; the error states time, reason, state
    and remedy.

    \b
    Examples:
      airmuscle simulate examples/fill_discharge.toml --out run
      airmuscle simulate joint-dmsp-20-matrix --out run
    """
    loaded = load_scenario(scenario)
    check_writable(out)
    try:
        recording = loaded.simulate()
    except SimulationError as error:
        if error.recording is not None and len(error.recording):
            _write(loaded, error.recording, out)
            echo(f"partial results were written to {out}", err=True)
        if error.interrupted:
            raise KeyboardInterrupt from None
        raise
    _write(loaded, recording, out)
    if json:
        print_json(
            {"title": loaded.title, "rows": len(recording), "notes": recording.notes, "range": _ranges(recording)}
        )
        return
    _print(loaded, recording)
    echo(f"report: {out / 'report.html'}")


def _ranges(recording: Recording) -> dict[str, dict[str, float | str]]:
    """Header, minimum, maximum and last value of each column [SI]."""
    return {
        name: {
            "column": column_heading(name),
            "min": float(recording[name].min()),
            "max": float(recording[name].max()),
            "last": float(recording[name][-1]),
        }
        for name in recording
    }


def _print(scenario: Scenario, recording: Recording) -> None:
    echo(f"{scenario.title}: {len(recording)} rows over {scenario.problem.duration:g} s")
    rows = [tuple(map(format_number, column.values())) for column in _ranges(recording).values()]
    rows = [(heading.removesuffix(" [1]"), *values) for heading, *values in rows]
    print_table(("column", "min", "max", "last"), rows, right=("min", "max", "last"))
    for note in recording.notes:
        echo(f"note: {note}")


def _write(scenario: Scenario, recording: Recording, out: Path) -> None:
    with atomic_folder(out) as folder:
        write(scenario.select_columns(recording), folder / "recording.csv")
        write_into(folder, [run_chapter(scenario, recording)], title="Simulation")

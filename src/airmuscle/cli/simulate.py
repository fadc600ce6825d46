"""`airmuscle simulate`: a scenario file carried through time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .options import Folder, Json
from .terminal import print_json, print_table

if TYPE_CHECKING:
    from ..recording import Recording
    from ..scenario.scenario import Scenario


def simulate(
    scenario: Annotated[
        Path, typer.Argument(metavar="SCENARIO.toml", help="A file with [plant], [command] and [run].")
    ],
    out: Folder = Path("run"),
    json: Json = False,
) -> None:
    """Simulate a plant under a command; the result is a recording like one from a bench.

    \b
    Writes DIR/recording.csv, DIR/report.html and DIR/figures/.
    A run that ends early leaves what was computed until then, and exit code 1: the last note says when, why, at
    which state, and what to do.

    \b
    Examples:
      airmuscle simulate examples/fill_discharge.toml --out run
    """
    from ..core.errors import SimulationError
    from ..report.output_folder import check_writable
    from ..scenario.scenario import load_scenario

    loaded = load_scenario(scenario)
    check_writable(out)
    try:
        recording = loaded.simulate()
    except SimulationError as error:
        if error.recording is not None and len(error.recording):
            _write(loaded, error.recording, out)
            typer.echo(f"what was computed until then stands in {out}", err=True)
        if error.interrupted:
            raise KeyboardInterrupt from None
        raise
    _write(loaded, recording, out)
    if json:
        print_json(
            {"title": loaded.title, "rows": len(recording), "notes": recording.notes, "range": _range(recording)}
        )
        return
    _print(loaded, recording)
    typer.echo(f"report: {out / 'report.html'}")


def _range(recording: Recording) -> dict[str, dict[str, float | str]]:
    from ..recording.recording import column_heading

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
    from ..report.formatting import format_number

    typer.echo(f"{scenario.title}: {len(recording)} rows over {scenario.duration:g} s")
    rows = [tuple(format_number(v) for v in found.values()) for found in _range(recording).values()]
    print_table(("column", "min", "max", "last"), rows, right=("min", "max", "last"))
    for note in recording.notes:
        typer.echo(f"note: {note}")


def _write(scenario: Scenario, recording: Recording, out: Path) -> None:
    from ..recording.csv_writer import write_csv
    from ..report.output_folder import atomic_folder
    from ..report.run_chapter import run_chapter
    from ..report.write import write_into

    with atomic_folder(out) as place:
        write_csv(scenario.select_columns(recording), place / "recording.csv")
        write_into(place, [run_chapter(scenario, recording)], title="Simulation")

"""`airmuscle simulate`: a scenario file carried through time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .options import Folder, Json
from .terminal import print_json, print_table

if TYPE_CHECKING:
    from ..library.scenario import Scenario
    from ..recording import Recording
    from ..report.chapter import Chapter

SHOWN = ("pressure", "contraction", "force", "tension", "position", "speed", "fill", "discharge", "held")
"""Columns that the figure draws, in this order; the file holds all."""


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
    A run that ends early leaves what was computed until then, and exit code 1.

    \b
    Examples:
      airmuscle simulate examples/fill_discharge.toml --out run
    """
    from ..errors import SimulationError
    from ..library.scenario import load_scenario
    from ..report.staged import refuse_unwritable

    loaded = load_scenario(scenario)
    refuse_unwritable(out)
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
    from ..recording.recording import header

    return {
        name: {
            "column": header(name),
            "least": float(recording[name].min()),
            "greatest": float(recording[name].max()),
            "last": float(recording[name][-1]),
        }
        for name in recording
    }


def _print(scenario: Scenario, recording: Recording) -> None:
    from ..report.wording import number

    typer.echo(f"{scenario.title}: {len(recording)} rows over {scenario.duration:g} s")
    rows = [tuple(number(v) for v in found.values()) for found in _range(recording).values()]
    print_table(("column", "least", "greatest", "last"), rows, right=("least", "greatest", "last"))
    for note in recording.notes:
        typer.echo(f"note: {note}")


def _write(scenario: Scenario, recording: Recording, out: Path) -> None:
    from ..recording.write_csv import write_csv
    from ..report.staged import staged
    from ..report.write import fill

    with staged(out) as place:
        write_csv(recording, place / "recording.csv")
        fill(place, [_chapter(scenario, recording)], title="Simulation")


def _chapter(scenario: Scenario, recording: Recording) -> Chapter:
    from ..reference import cite
    from ..report.chapter import Chapter, Plot
    from ..report.parameters import parameter_table

    notes = "\n\n".join(note[:1].upper() + note[1:] + "." for note in recording.notes)
    return Chapter(
        paper="simulation",
        title=scenario.title,
        summary=f"A run of {scenario.duration:g} s; the whole recording is recording.csv.\n\n{notes}",
        plots=(Plot("run", f"{scenario.title}, simulated.", recording.plot(*_shown(recording))),),
        tables=(parameter_table(scenario.plant, "parameters", "Parameters of the plant"),),
        references=tuple(cite(scenario.plant)),
        chosen=_settings(scenario),
    )


def _shown(recording: Recording) -> list[str]:
    last: dict[str, Any] = {name: name.rpartition(".")[2] for name in recording}
    return [name for kind in SHOWN for name in recording if last[name] == kind]


def _settings(scenario: Scenario) -> tuple[tuple[str, str, str], ...]:
    start = ", ".join(f"{name} {value:.6g}" for name, value in scenario.start.items())
    return (
        ("method", str(scenario.method), "scenario"),
        ("start (SI)", start, "scenario"),
        ("command", str(scenario.command), "scenario"),
    )

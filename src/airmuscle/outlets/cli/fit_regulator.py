"""`airmuscle fit-regulator`: a pressure regulator identified from its command and the pressure that it gives."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from ...bench.identify.dynamic import RegulatorFit, fit_regulator
from ...bench.identify.dynamic.dynamic_chapter import dynamic_chapters
from ...bench.readers.reading_chapter import reading_chapters
from ...core.atomic_output import atomic_folder, check_writable
from ...core.units import quantity
from ...files.library.fitted_entry import list_files
from ...files.library.write import part_toml, scenario_toml
from ...recording import Recording
from ...report.write import write_into
from .bench_files import Files, read_recordings
from .options import Folder, Json
from .reading_options import NO_OPTIONS, ReadingOptions, with_reading_options
from .terminal import echo, print_json


@with_reading_options
def fit_regulator_command(
    files: Files,
    supply: Annotated[str, typer.Option(metavar="QUANTITY", help="Gauge pressure of the supply: '6 bar'.")],
    volume: Annotated[str, typer.Option(metavar="QUANTITY", help="Volume of air behind the regulator.")] = "0.1 dm3",
    noise: Annotated[str, typer.Option(metavar="QUANTITY", help="Standard deviation of the sensor.")] = "1 kPa",
    starts: Annotated[int, typer.Option(min=1, max=10_000, metavar="N", help="Number of initial guesses.")] = 8,
    reading: ReadingOptions = NO_OPTIONS,
    out: Folder = Path("regulator"),
    json: Json = False,
) -> None:
    """Identify a pressure regulator from its response.

    \b
    FILES have the columns time, setpoint (the command as a pressure) and pressure (at the outlet). The parameters of a
    PressureRegulator are estimated as by fit-dynamic. What the records excite too little is named, with the command
    that would determine it. Writes DIR/report.html, DIR/regulator.toml (the circuit) and DIR/scenario.toml.

    \b
    Examples:
      airmuscle fit-regulator steps.csv sines.csv --supply "5.8 bar" --out regulator
    """
    check_writable(out)
    recordings = read_recordings(files, reading)
    result = fit_regulator(
        recordings, supply_pressure=quantity(supply, "Pa", where="--supply"), starts=starts,
        volume=quantity(volume, "m3", where="--volume"), noise=quantity(noise, "Pa", where="--noise"),
    )  # fmt: skip
    _write(result, recordings, f"Regulator fitted to {list_files([f.name for f in files])}", out)
    if json:
        print_json(_to_dict(result))
        return
    echo(str(result))
    echo(f"regulator: {out / 'regulator.toml'}")
    echo(f"report: {out / 'report.html'}")


def _write(result: RegulatorFit, recordings: Sequence[Recording], title: str, out: Path) -> None:
    low, high = (float(edge(recordings[0]["setpoint"])) for edge in (min, max))
    step = {"setpoint": [[0.0, low], [0.5, high], [1.5, low]]}
    run = {"duration": 2.5, "initial_state": {"pressure": low}}
    with atomic_folder(out) as folder:
        (folder / "regulator.toml").write_text(part_toml("circuit", result.regulator), encoding="utf-8")
        text = scenario_toml(title, result.plant, step, run, "a step over the range of the first record")
        (folder / "scenario.toml").write_text(text, encoding="utf-8")
        remarks = [f"Too little excited: {each}." for each in result.remarks]
        chapters = dynamic_chapters(result.fit, title, remarks=remarks)
        write_into(folder, [*chapters, *reading_chapters(recordings)], title="Pressure regulator")


def _to_dict(result: RegulatorFit) -> dict[str, Any]:
    """A fit of a regulator as plain data, all numbers SI."""
    return {
        "parameters": [dataclasses.asdict(estimate) for estimate in result.fit.estimates],
        "rms": [result.fit.rms("pressure", i) for i in range(len(result.zeros))],
        "zeros": list(result.zeros),
        "too_little_excited": list(result.remarks),
        "notes": list(result.fit.notes),
    }

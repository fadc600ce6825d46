"""`airmuscle fit-regulator`: a pressure regulator identified from its command and the pressure that it gives."""

from pathlib import Path

from ...bench.identify.dynamic import fit_regulator
from ...bench.identify.dynamic.dynamic_chapter import regulator_chapters
from ...core import check_writable
from ...files.library import list_files, part_toml, scenario_toml
from ..requests import ReadingRequest, option, request
from .bench_files import Files, read_recordings, reading_chapters
from .delivery import deliver
from .options import Folder, Json
from .request_options import with_requests


@request
class RegulatorRequest:
    """What the fit of a regulator is asked for."""

    supply: float = option("Gauge pressure of the supply: '6 bar'.", unit="Pa")
    volume: float = option("Volume of air behind the regulator.", unit="m3", default="0.1 dm3")
    noise: float = option("Standard deviation of the sensor.", unit="Pa", default="1 kPa")
    starts: int = option("Number of initial guesses.", default=8, bounds=(1, 10_000))


@with_requests
def fit_regulator_command(
    files: Files,
    request: RegulatorRequest,
    reading: ReadingRequest,
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
        recordings, supply_pressure=request.supply, starts=request.starts, volume=request.volume, noise=request.noise
    )
    title = f"Regulator fitted to {list_files([f.name for f in files])}"
    low, high = (float(edge(recordings[0]["setpoint"])) for edge in (min, max))
    step = {"setpoint": [[0.0, low], [0.5, high], [1.5, low]]}
    run = {"duration": 2.5, "initial_state": {"pressure": low}}
    of_scenario = "a step over the range of the first record"
    contents = {
        "regulator.toml": part_toml("circuit", result.regulator),
        "scenario.toml": scenario_toml(title, result.plant, step, run, of_scenario),
    }
    chapters = [*regulator_chapters(result, title), *reading_chapters(recordings)]
    deliver("fit-regulator", chapters, json=json, out=out, title="Pressure regulator", files=contents)

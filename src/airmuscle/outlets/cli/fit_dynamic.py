"""`airmuscle fit-dynamic` and `fit-regulator`: plants and regulators from transient records."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from ...bench import DynamicFit
from ...bench.dynamics import fit_regulator
from ...bench.dynamics.dynamic_chapter import dynamic_chapters, regulator_chapters
from ...bench.inspection import inspect
from ...core import check_known, check_writable, counted
from ...files.library import list_files, part_toml, scenario_toml
from ...files.scenario.identification import load_dynamic_fit
from ...files.scenario.plant_uncertainty import fit_uncertainty
from ...recording.recording import row_notes
from ..requests import WEAK, ReadingRequest, many, option, optional, request
from .delivery import deliver
from .measurements import Files, read_recordings, reading_chapters
from .options import Folder, Json
from .parser import Argument
from .requested import with_requests
from .search_limit import SearchLimit
from .terminal import echo

Study = Annotated[
    Path, Argument("STUDY.toml", "A file with [plant], [observed], [fit] and [[record]].")
]


@request
class DynamicFitRequest:
    """What a dynamic fit is asked for beyond its file."""

    profile: tuple[str, ...] = many(
        "Profile likelihood of this parameter; 'weak': of all undetermined ones. Repeatable.",
        metavar="PARAMETER",
    )
    points: int = option(
        "Values of a profile on either side of the estimate.", default=5, bounds=(2, 50)
    )
    starts: int | None = optional(
        "Number of initial guesses; default: that of the file.", bounds=(1, 10_000)
    )


@with_requests
def fit_dynamic(
    study: Study,
    request: DynamicFitRequest,
    limit: SearchLimit,
    out: Folder = Path("dynamic"),
    json: Json = False,
) -> None:
    """Identify plant parameters from transient records.

    \b
    Parameters of valves, gas, volume, damping, friction and mass are estimated from records of
    filling, discharge and release. Several records are cross-predicted: each by the common
    parameters of the others, which the output states first. Reports parameter combinations that the
    records do not determine, and the experiment that would. Writes DIR/report.html and the
    identified plant as a scenario, DIR/scenario.toml (DIR/scenario-1.toml and so on for several
    records).

    \b
    Examples:
      airmuscle fit-dynamic study.toml --out dynamic
      airmuscle fit-dynamic study.toml --profile gas.exponent --starts 20
      airmuscle simulate dynamic/scenario.toml
    """
    loaded = load_dynamic_fit(study)
    if request.starts is not None:
        loaded = dataclasses.replace(
            loaded, search=dataclasses.replace(loaded.search, starts=request.starts)
        )
    for name in request.profile:
        if name != WEAK:
            check_known("the fit has no unknown", name, loaded.names_of_unknowns(), "it has")
    check_writable(out)
    recordings = [experiment.recording for experiment in loaded.experiments]
    notes = row_notes(recordings)
    findings = [
        f"{recording.origin}: {finding.text}"
        for recording in recordings
        for finding in inspect(recording).findings
    ]
    if not json:
        counts = ((len(loaded.experiments), "record"), (loaded.search.starts, "start"))
        echo("  " + ", ".join(counted(*pair) for pair in counts), err=True)
    with limit.searches(out):
        fit = loaded.fit()
        cross = loaded.cross_predictions(fit)
    fit = fit.with_scatter_of_records([prediction.common for prediction in cross])
    names_of_profiles = _names_of_profiles(fit, request.profile)
    profiles = [fit.profile(name, request.points) for name in names_of_profiles]
    count = len(loaded.experiments)
    names = ["scenario.toml"] if count == 1 else [f"scenario-{i + 1}.toml" for i in range(count)]
    files = {name: loaded.scenario(fit, i, cross) for i, name in enumerate(names)}
    chapters = dynamic_chapters(fit, loaded.title, profiles, [*notes, *findings], cross)
    deliver("fit-dynamic", chapters, json=json, out=out, title="Dynamic fit", files=files)


def _names_of_profiles(fit: DynamicFit, requested: Sequence[str]) -> list[str]:
    """The parameters whose profiles are requested, once each: those that the records determine
    weakly first, if they are.
    """
    wanted = list[str]()
    if WEAK in requested:
        for direction in fit.identifiability.undetermined:
            wanted += [name for name, _ in direction.shares]
    wanted += [name for name in requested if name != WEAK]
    return list(dict.fromkeys(fit[name].name for name in wanted))


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
    FILES have the columns time, setpoint (the command as a pressure) and pressure (at the outlet).
    The parameters of a PressureRegulator are estimated as by fit-dynamic. What the records excite
    too little is named, with the command that would determine it. Writes DIR/report.html,
    DIR/regulator.toml (the circuit) and DIR/scenario.toml.

    \b
    Examples:
      airmuscle fit-regulator steps.csv sines.csv --supply "5.8 bar" --out regulator
    """
    check_writable(out)
    recordings = read_recordings(files, reading)
    result = fit_regulator(
        recordings,
        supply_pressure=request.supply,
        starts=request.starts,
        volume=request.volume,
        noise=request.noise,
    )
    title = f"Regulator fitted to {list_files([f.name for f in files])}"
    low, high = (float(edge(recordings[0]["setpoint"])) for edge in (min, max))
    step = {"setpoint": [[0.0, low], [0.5, high], [1.5, low]]}
    run = {"duration": 2.5, "initial_state": {"pressure": low}}
    of_scenario = "a step over the range of the first record"
    contents = {
        "regulator.toml": part_toml("circuit", result.regulator),
        "scenario.toml": scenario_toml(
            title,
            result.plant,
            step,
            run,
            of_scenario,
            {"uncertainty": fit_uncertainty(result.fit)},
        ),
    }
    chapters = [*regulator_chapters(result, title), *reading_chapters(recordings)]
    deliver(
        "fit-regulator", chapters, json=json, out=out, title="Pressure regulator", files=contents
    )

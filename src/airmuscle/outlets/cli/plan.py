"""`airmuscle plan`: the most informative experiments."""

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

from ...bench.dynamics import SignalLimits, plan_signals, rank_records
from ...bench.readers import write
from ...bench.statics import BenchLimits, optimal_design
from ...core import check_writable
from ...files.library import is_path, list_plants, load_law, read_toml
from ...files.scenario import Scenario, load_scenario
from ...files.scenario.identification import load_dynamic_fit
from ...physics import Plant
from ...physics.muscle.characteristic import ValidityRange
from ...report.write import save_table
from ..requests.declaration import RequestError, many, option, optional, request
from ..rig import signal_files
from .delivery import deliver
from .options import Json, OptionalFolder, complete_model
from .parser import Argument
from .requested import with_requests

PLAN_FILE = "plan.csv"
SCENARIO_FILE = "scenario.toml"
Planned = Annotated[
    str,
    Argument(
        "NAME",
        "A muscle or a law; a study of fit-dynamic; or the folder or scenario of fit-regulator or"
        " fit-joint, or a plant with regulators.",
        complete_model,
    ),
]


@request
class PlanRequest:
    """Limits of a test bench and of its plan, or the parameters that a further record is to
    separate.
    """

    max_pressure: float | None = optional(
        "Maximum pressure, such as '6 bar'; needed for static runs.", unit="Pa"
    )
    max_force: float | None = optional(
        "Maximum force of the load cell or frame, such as '1 kN'; needed for static runs.", unit="N"
    )
    min_pressure: float = option("Minimum pressure.", unit="Pa", default="50 kPa")
    max_contraction: float = option("Maximum contraction.", unit="1", default="25 %")
    min_contraction: float = option(
        "Minimum contraction; negative if the bench stretches the muscle.", unit="1", default="0 %"
    )
    runs: int = option("Number of runs.", default=6, bounds=(1, 100))
    points: int = option("Number of points per run.", default=15, bounds=(3, 1000))
    sigma: float = option(
        "Standard deviation of a measured value, in the SI unit of the fitted quantity (mostly N).",
        default=1.0,
    )
    fix: tuple[str, ...] = many(
        "Parameter that the fit will keep fixed; repeatable.", metavar="PARAMETER"
    )
    separate: tuple[str, ...] = many(
        "Study of fit-dynamic: one of the two parameters to separate; give two.",
        metavar="PARAMETER",
    )
    determine: tuple[str, ...] = many(
        "Signals: parameter to determine; repeatable. Default: those that the fit did not"
        " determine.",
        metavar="PARAMETER",
    )
    duration: float = option(
        "Signals: their duration.", unit="s", default="60 s", bounds=(10.0, 3600.0)
    )
    sample_rate: float = option(
        "Signals: rows per second.", unit="1/s", default="200 Hz", bounds=(50.0, 2000.0)
    )
    max_rate: float | None = optional(
        "Signals: greatest rate of a command, such as '20 bar/s'.", unit="Pa/s"
    )
    min_angle: float | None = optional("Signals of a joint: least angle, '-30 deg'.", unit="rad")
    max_angle: float | None = optional("Signals of a joint: greatest angle.", unit="rad")
    seed: int = option("Signals: seed of the random steps.", default=0)


@with_requests
def plan(
    name: Planned, request: PlanRequest, out: OptionalFolder = None, json: Json = False
) -> None:
    """Design the most informative experiments.

    \b
    The runs are isobaric or isometric, within the limits of the test bench. They are D-optimal for
    fitting the characteristic of the muscle, linearised at its present parameter values. With
    --out, DIR/plan.csv contains the points in order, with the expected force. For a study of
    fit-dynamic in place of NAME, fills, discharges and other records of the same rig are ranked by
    the precision with which they separate a parameter of the valve from one of the wall, or the
    pair of --separate. For the result of fit-regulator or fit-joint, signals to play next are
    chosen by their Fisher information about the parameters that the fit did not determine: steps
    after rest, ramps, sines, random steps, reversals and chirps within the limits of pressure,
    rate and angle. With --out, DIR has them as plan.csv, plan.h (C), plan.mcap and plan.py, with a
    1 kHz loop for Linux, rig_loop.c; airmuscle play plays plan.csv.

    \b
    Examples:
      airmuscle plan dmsp-20-300 --max-pressure "6 bar" --max-force "1 kN"
      airmuscle plan my/muscle.toml --max-pressure "4 bar" --max-force "300 N" --runs 4 --out bench
      airmuscle plan study.toml
      airmuscle plan study.toml --separate circuit.fill.critical_ratio --separate gas.heat_transfer
      airmuscle plan vessel-smc-itv2050 --max-pressure "5 bar" --duration "20 s" --out next
    """
    if out is not None:
        check_writable(out)
    if _is_study(name):
        _deliver_ranking(name, request, out, json)
        return
    if request.separate:
        raise RequestError(
            "--separate is for a study of fit-dynamic; NAME is a muscle, a law or a plant"
        )
    scenario = _scenario(name)
    if scenario is None:
        _deliver_runs(name, request, out, json)
    else:
        _deliver_signals(scenario, request, out, json)


def _is_study(name: str) -> bool:
    return is_path(name) and Path(name).is_file() and {"fit", "record"} <= set(_tables(name))


def _tables(name: str) -> dict[str, object]:
    return dict(read_toml(Path(name)))


def _scenario(name: str) -> Scenario | None:
    """The scenario of a folder, a file or a plant of the library; None for a muscle or a law."""
    file = Path(name) / SCENARIO_FILE
    if file.is_file():
        return load_scenario(file)
    if is_path(name) and Path(name).is_file():
        return load_scenario(name) if "plant" in _tables(name) else None
    return load_scenario(name) if name in list_plants() else None


def _deliver_ranking(name: str, request: PlanRequest, out: Path | None, json: bool) -> None:
    if len(request.separate) not in (0, 2):
        raise RequestError(
            f"--separate names {len(request.separate)} parameters; give two, or none"
        )
    pair = None
    if request.separate:
        first, second = request.separate
        pair = (first, second)
    loaded = load_dynamic_fit(name)
    ranked = rank_records(loaded.fit(), pair).chapter()
    title = f"{ranked.title}: {loaded.title}"
    chapter = dataclasses.replace(ranked, title=title)
    files = {PLAN_FILE: lambda path: save_table(chapter.tables[0], path)}
    deliver("plan", [chapter], json=json, out=out, title="Next record", files=files)


def _deliver_runs(name: str, request: PlanRequest, out: Path | None, json: bool) -> None:
    if request.max_pressure is None or request.max_force is None:
        raise RequestError("give the limits of the test bench with --max-pressure and --max-force")
    limits = ValidityRange(
        request.min_pressure, request.max_pressure, request.min_contraction, request.max_contraction
    )
    design = optimal_design(
        load_law(name).characteristic,
        BenchLimits(limits, request.max_force),
        runs=request.runs,
        points=request.points,
        sigma=request.sigma,
        fixed=request.fix,
    )
    files = {PLAN_FILE: lambda path: write(design.recording(), path)}
    deliver("plan", [design.chapter()], json=json, out=out, files=files)


def _deliver_signals(
    scenario: Scenario, request: PlanRequest, out: Path | None, json: bool
) -> None:
    if request.max_pressure is None:
        raise RequestError("give the limit of the pressure with --max-pressure")
    plant = scenario.plant
    uncertainty = scenario.uncertainty
    signals = plan_signals(
        plant,
        SignalLimits(
            request.max_pressure,
            request.min_pressure,
            math.inf if request.max_rate is None else request.max_rate,
            _travel(plant, request),
        ),
        parameters=() if uncertainty is None else uncertainty.parameters,
        covariance=None if uncertainty is None else uncertainty.covariance,
        deviations={} if uncertainty is None else uncertainty.deviations,
        determine=request.determine,
        duration=request.duration,
        sample_time=1.0 / request.sample_rate,
        seed=request.seed,
    )
    files: dict[str, str | Callable[[Path], object]] = {
        PLAN_FILE: lambda path: write(signals.recording(), path)
    }
    files |= signal_files(signals)
    deliver("plan", [signals.chapter()], json=json, out=out, title="Signals", files=files)


def _travel(plant: Plant, request: PlanRequest) -> dict[str, tuple[float, float]]:
    """The travel of every angle, from the options."""
    names = [coordinate.name for coordinate in plant.mechanism.coordinates]
    if not names:
        return {}
    if request.min_angle is None or request.max_angle is None:
        raise RequestError("give the limits of the angle with --min-angle and --max-angle")
    return dict.fromkeys(names, (request.min_angle, request.max_angle))

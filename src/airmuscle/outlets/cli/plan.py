"""`airmuscle plan`: the most informative experiments."""

import dataclasses
from pathlib import Path

from ...bench.dynamics import rank_records
from ...bench.readers import write
from ...bench.statics import BenchLimits, optimal_design
from ...core import check_writable
from ...files.library import is_path, load_law, read_toml
from ...files.scenario.identification import load_dynamic_fit
from ...physics.muscle.characteristic import ValidityRange
from ...report.write import save_table
from ..requests.declaration import RequestError, many, option, optional, request
from .delivery import deliver
from .options import Json, Name, OptionalFolder
from .requested import with_requests

PLAN_FILE = "plan.csv"


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


@with_requests
def plan(name: Name, request: PlanRequest, out: OptionalFolder = None, json: Json = False) -> None:
    """Design the most informative experiments.

    \b
    The runs are isobaric or isometric, within the limits of the test bench. They are D-optimal for
    fitting the characteristic of the muscle, linearised at its present parameter values. With
    --out, DIR/plan.csv contains the points in order, with the expected force. For a study of
    fit-dynamic in place of NAME, fills, discharges and other records of the same rig are ranked by
    the precision with which they separate a parameter of the valve from one of the wall, or the
    pair of --separate.

    \b
    Examples:
      airmuscle plan dmsp-20-300 --max-pressure "6 bar" --max-force "1 kN"
      airmuscle plan my/muscle.toml --max-pressure "4 bar" --max-force "300 N" --runs 4 --out bench
      airmuscle plan study.toml
      airmuscle plan study.toml --separate circuit.fill.critical_ratio --separate gas.heat_transfer
    """
    if is_path(name) and {"fit", "record"} <= set(read_toml(Path(name))):
        pair = request.separate
        if len(pair) not in (0, 2):
            raise RequestError(f"--separate names {len(pair)} parameters; give two, or none")
        if out is not None:
            check_writable(out)
        loaded = load_dynamic_fit(name)
        chapter = rank_records(loaded.fit(), (pair[0], pair[1]) if pair else None).chapter()
        chapter = dataclasses.replace(chapter, title=f"{chapter.title}: {loaded.title}")
        ranking = {PLAN_FILE: lambda path: save_table(chapter.tables[0], path)}
        deliver("plan", [chapter], json=json, out=out, title="Next record", files=ranking)
        return
    if request.separate:
        raise RequestError("--separate is for a study of fit-dynamic; NAME is a muscle or a law")
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
    if out is not None:
        check_writable(out)
    files = {PLAN_FILE: lambda path: write(design.recording(), path)}
    deliver("plan", [design.chapter()], json=json, out=out, files=files)

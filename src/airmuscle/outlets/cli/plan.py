"""`airmuscle plan` and `airmuscle fit-live`: the most informative experiments, before a measurement and while it runs;
`airmuscle size`: muscles for a lift or a joint."""

import dataclasses
import math
import sys
from json import dumps
from pathlib import Path
from typing import Any

from ...bench.identify import BenchLimits, RecursiveFit, optimal_design
from ...bench.identify.dynamic import rank_records
from ...bench.readers import RowReader, follow_lines, write
from ...core import ColumnError, IdentificationError, atomic_folder, check_writable, contraction_text, quantity_text
from ...design.sizing.chapter import sizing_chapter
from ...design.sizing.scenario import sizing_scenario
from ...files.library import Entry, is_path, load_law, read_toml, save
from ...files.scenario.identification import load_dynamic_fit
from ...physics.muscle.characteristic import ValidityRange
from ...report.write import save_table
from ..requests.declaration import RequestError, many, option, optional, request
from ..requests.reading import Pairs, ReadingRequest
from ..requests.size import SizeRequest
from .delivery import deliver
from .options import Json, Name, OptionalFolder, with_requests
from .terminal import computation_progress, echo

PLAN_FILE = "plan.csv"


@request
class PlanRequest:
    """Limits of a test bench and of its plan, or the parameters that a further record is to separate."""

    max_pressure: float | None = optional("Maximum pressure, such as '6 bar'; needed for static runs.", unit="Pa")
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
        "Standard deviation of a measured value, in the SI unit of the fitted quantity (mostly N).", default=1.0
    )
    fix: tuple[str, ...] = many("Parameter that the fit will keep fixed; repeatable.", metavar="PARAMETER")
    separate: tuple[str, ...] = many(
        "Study of fit-dynamic: one of the two parameters to separate; give two.", metavar="PARAMETER"
    )


@with_requests
def plan(name: Name, request: PlanRequest, out: OptionalFolder = None, json: Json = False) -> None:
    """Design the most informative experiments.

    \b
    The runs are isobaric or isometric, within the limits of the test bench. They are D-optimal for fitting the
    characteristic of the muscle, linearised at its present parameter values.
    With --out, DIR/plan.csv contains the points in order, with the expected force.
    For a study of fit-dynamic in place of NAME, fills, discharges and other records of the same rig are ranked by the
    precision with which they separate a parameter of the valve from one of the wall, or the pair of --separate.

    \b
    Examples:
      airmuscle plan dmsp-20-300 --max-pressure "6 bar" --max-force "1 kN"
      airmuscle plan my/muscle.toml --max-pressure "4 bar" --max-force "300 N" --runs 4 --out bench
      airmuscle plan study.toml
      airmuscle plan study.toml --separate circuit.fill.critical_ratio --separate gas.heat_transfer
    """
    if is_path(name) and {"fit", "record"} <= set(read_toml(Path(name))):
        _plan_record(Path(name), request.separate, out, json)
        return
    if request.separate:
        raise RequestError("--separate is for a study of fit-dynamic; NAME is a muscle or a law")
    if request.max_pressure is None or request.max_force is None:
        raise RequestError("give the limits of the test bench with --max-pressure and --max-force")
    limits = ValidityRange(request.min_pressure, request.max_pressure, request.min_contraction, request.max_contraction)
    design = optimal_design(
        load_law(name).characteristic, BenchLimits(limits, request.max_force), runs=request.runs,
        points=request.points, sigma=request.sigma, fixed=request.fix,
    )  # fmt: skip
    if out is not None:
        check_writable(out)
    files = {PLAN_FILE: lambda path: write(design.recording(), path)}
    deliver("plan", [design.chapter()], json=json, out=out, files=files)


def _plan_record(study: Path, separate: tuple[str, ...], out: Path | None, json: bool) -> None:
    """Fit a study and rank the candidate records. Raises RequestError unless none or two parameters are separated."""
    if len(separate) not in (0, 2):
        raise RequestError(f"--separate names {len(separate)} parameters; give two, or none")
    if out is not None:
        check_writable(out)
    loaded = load_dynamic_fit(study)
    chapter = rank_records(loaded.fit(), (separate[0], separate[1]) if separate else None).chapter()
    chapter = dataclasses.replace(chapter, title=f"{chapter.title}: {loaded.title}")
    files = {PLAN_FILE: lambda path: save_table(chapter.tables[0], path)}
    deliver("plan", [chapter], json=json, out=out, title="Next record", files=files)


SCENARIO_FILE = "scenario.toml"


@with_requests
def size(request: SizeRequest, out: OptionalFolder = None, json: Json = False) -> None:
    """Size muscles of the catalogue for a lift or a joint.

    \b
    For each muscle whose law and permitted values are known: the shortest length that reaches both ends of the motion
    within ratings, validity range and supply, alone and in parallel, with pressures, reserve and air of a cycle.
    With --out, DIR/report.html shows the force-contraction chart and all choices, and DIR/scenario.toml is the best
    choice that `airmuscle simulate` can run, with valves for the cycle time.

    \b
    Examples:
      airmuscle size --load "20 kg" --stroke "40 mm" --supply "6 bar" --max-length "400 mm" --out lift
      airmuscle size --load "100 N" --stiffness "2 N/mm" --stroke "40 mm" --supply "6 bar" --sort length
      airmuscle size --torque "5 N m" --angle "60 deg" --inertia "0.05 kg m^2" --supply "6 bar" --max-count 1
    """
    if out is not None:
        check_writable(out)
    with computation_progress("sizing") as progress:
        result = request.evaluate(progress)
    scenario = sizing_scenario(result.choices, SCENARIO_FILE if out is not None else "scenario.toml of --out")
    files = {SCENARIO_FILE: scenario.text} if scenario.text else {}
    deliver("size", [sizing_chapter(result, scenario)], json=json, out=out, title="Sizing", files=files)


# While a measurement runs

QUANTITIES = ("pressure", "contraction", "force")


def same(name: str) -> Any:
    """A field as the request of reading declares it."""
    field = ReadingRequest.__dataclass_fields__[name]
    return dataclasses.field(default=field.default, metadata=field.metadata)


@request
class LiveRequest:
    """Limits of the test rig, how the rows are read, and the surface."""

    follow: str = option("Growing file, pipe or serial port; '-' for standard input.", metavar="FILE")
    max_pressure: float = option("Maximum pressure, such as '6 bar'.", unit="Pa")
    max_force: float = option("Maximum force of the test rig, such as '1 kN'.", unit="N")
    min_pressure: float = option("Minimum pressure.", unit="Pa", default="0 kPa")
    max_contraction: float = option("Maximum contraction.", unit="1", default="25 %")
    min_contraction: float = option("Minimum contraction.", unit="1", default="0 %")
    resting_length: str | None = same("resting_length")
    unit: Pairs = same("unit")
    column: Pairs = same("column")
    constant: Pairs = same("constant")
    displacement_zero: str | None = same("displacement_zero")
    skip_rows: int | None = same("skip_rows")
    degree: int = option("Degree of the polynomial surface.", default=5, bounds=(1, 9))
    forgetting: float = option(
        "Weight of the former samples at each sample; 1: none is forgotten.", default=1.0, metavar="FACTOR"
    )
    every: int = option("Samples between two lines of the output.", default=1000, bounds=(1, math.inf))
    idle: float = option(
        "End when no row has come for so long.", default=10.0, bounds=(0.0, math.inf), metavar="SECONDS"
    )


@with_requests
def fit_live(request: LiveRequest, out: OptionalFolder = None, json: Json = False) -> None:
    """Fit a surface while rows arrive; name the next point.

    \b
    Each row (pressure, contraction or length, force) updates the surface by recursive least squares. The next point is
    the most informative one (D-optimal) within the limits of the test rig.
    With --out, DIR/muscle.toml contains the surface at the end of the stream.

    \b
    Examples:
      airmuscle fit-live --follow log.csv --max-pressure "6 bar" --max-force "1 kN" --out live
      cat /dev/ttyUSB0 | airmuscle fit-live --follow - --column "1=pressure [kPa]" --column "2=contraction [%]"
      --column "3=force [N]" --max-pressure "6 bar" --max-force "1 kN"
    """
    pressures = request.min_pressure, request.max_pressure
    limits = ValidityRange(*pressures, request.min_contraction, request.max_contraction)
    if out is not None:
        check_writable(out)
    given = {name: value for name, value in vars(request).items() if name in ReadingRequest.__dataclass_fields__}
    reading = ReadingRequest(**given)
    origin = "standard input" if request.follow == "-" else Path(request.follow).name
    reader = RowReader(origin, reading.column_mapping())
    fit = RecursiveFit(BenchLimits(limits, request.max_force), request.degree, forgetting=request.forgetting)
    _finish(_follow(fit, reader, request, json), reader, out, json)


def _follow(fit: RecursiveFit, reader: RowReader, request: LiveRequest, json: bool) -> RecursiveFit:
    """The fit to all rows until the stream ends or the user interrupts it."""
    printed = 0
    try:
        for line in follow_lines(sys.stdin if request.follow == "-" else request.follow, idle=request.idle):
            row = reader.read(line)
            if row is None:
                continue
            if fit.samples + fit.outside == 0:
                _check_columns(reader, row)
            fit = fit.updated(*(row[name] for name in QUANTITIES))
            if fit.samples >= printed + request.every:
                printed = fit.samples
                _report(fit, json)
    except KeyboardInterrupt:
        echo("interrupted; the fit to the rows so far follows", err=True)
    return fit


def _check_columns(reader: RowReader, row: dict[str, float]) -> None:
    for note in reader.notes:
        echo(f"note: {note}", err=True)
    for name in QUANTITIES:
        if name not in row:
            remedy = " or a length with --resting-length" if name == "contraction" else ""
            raise ColumnError(
                f"{reader.origin}: there is no {name}{remedy}; the columns are {', '.join(row)}. Name it with "
                f"--column 'NUMBER={name} [unit]'."
            )


def _report(fit: RecursiveFit, json: bool) -> None:
    """One line on the fit and the next point."""
    point = fit.next_point()
    if json:
        report = {"samples": fit.samples, "rmse": fit.rmse, "determined": fit.determined, "next": point._asdict()}
        echo(dumps(report))  # one line for each report, for a program that reads them as they come
        return
    echo(
        f"{fit.samples} samples, rms residual {fit.rmse:.4g} N, force determined on {100 * fit.determined:.0f} % of "
        f"the range; next: {quantity_text(point.pressure, 'Pa', 'kPa')}, {contraction_text(point.contraction)} "
        f"(expected {point.force:.4g} ± {2 * point.standard_error:.2g} N)"
    )


def _finish(fit: RecursiveFit, reader: RowReader, out: Path | None, json: bool) -> None:
    """The result at the end of the stream. Raises IdentificationError if there are no samples within the limits."""
    if not fit.samples:
        raise IdentificationError(
            f"{reader.origin}: no row lies within the limits of the test rig ({fit.outside} outside, {reader.skipped} "
            "unreadable). Check the units and the limits."
        )
    _report(fit, json)
    if fit.outside or reader.skipped:
        echo(f"note: left out: {fit.outside} rows outside the limits, {reader.skipped} unreadable rows", err=True)
    if out is None:
        return
    model = fit.model
    title = f"Surface fitted while {reader.origin} was measured"
    note = f"{fit.samples} samples, rms residual {fit.rmse:.4g} N; recursive least squares."
    with atomic_folder(out) as folder:
        save(Entry("muscle", title, "fitted", model, note=note, validity_range=model.validity_range),
             folder / "muscle.toml")  # fmt: skip
    echo(f"muscle: {out / 'muscle.toml'}", err=json)

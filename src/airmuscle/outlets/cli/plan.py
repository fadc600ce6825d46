"""`airmuscle plan`: D-optimal design of static experiments, and the record that separates parameters of a plant."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from ...bench.identify.experiment_design import BenchLimits, ExperimentPlan, PlannedRun, optimal_design
from ...bench.readers import write
from ...core.atomic_output import atomic_folder, check_writable
from ...core.display import quantity_text
from ...core.units import quantity
from ...files.library.entry_file import load_law
from ...files.library.files import is_path, read_toml
from ...physics.muscle.characteristic import ValidityRange
from .options import Json, Name, OptionalFolder
from .plan_records import describes_study, plan_records
from .terminal import echo, percent, print_json, print_table

Separated = Annotated[
    list[str] | None,
    typer.Option(metavar="PARAMETER", help="Study of fit-dynamic: one of the two parameters to separate; give two."),
]


MaxPressure = Annotated[
    str | None, typer.Option(metavar="QUANTITY", help="Maximum pressure, such as '6 bar'; needed for static runs.")
]
MaxForce = Annotated[
    str | None,
    typer.Option(
        metavar="QUANTITY", help="Maximum force of the load cell or frame, such as '1 kN'; needed for static runs."
    ),
]
MinPressure = Annotated[str, typer.Option(metavar="QUANTITY", help="Minimum pressure.")]
MaxContraction = Annotated[str, typer.Option(metavar="QUANTITY", help="Maximum contraction.")]
MinContraction = Annotated[
    str, typer.Option(metavar="QUANTITY", help="Minimum contraction; negative if the bench stretches the muscle.")
]
Runs = Annotated[int, typer.Option(min=1, max=100, metavar="N", help="Number of runs.")]
Points = Annotated[int, typer.Option(min=3, max=1000, metavar="N", help="Number of points per run.")]
Sigma = Annotated[
    float,
    typer.Option(
        metavar="NUMBER",
        help="Standard deviation of a measured value, in the SI unit of the fitted quantity (mostly N).",
    ),
]
Fixed = Annotated[
    list[str] | None,
    typer.Option("--fix", metavar="PARAMETER", help="Parameter that the fit will keep fixed; repeatable."),
]


def plan(
    name: Name,
    max_pressure: MaxPressure = None,
    max_force: MaxForce = None,
    min_pressure: MinPressure = "50 kPa",
    max_contraction: MaxContraction = "25 %",
    min_contraction: MinContraction = "0 %",
    runs: Runs = 6,
    points: Points = 15,
    sigma: Sigma = 1.0,
    fix: Fixed = None,
    separate: Separated = None,
    out: OptionalFolder = None,
    json: Json = False,
) -> None:
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
    if is_path(name) and describes_study(read_toml(Path(name))):
        plan_records(Path(name), separate or (), out, json)
        return
    if separate:
        raise typer.BadParameter("--separate is for a study of fit-dynamic; NAME is a muscle or a law")
    if max_pressure is None or max_force is None:
        raise typer.BadParameter("give the limits of the test bench with --max-pressure and --max-force")
    limits = _bench_limits((min_pressure, max_pressure), (min_contraction, max_contraction), max_force)
    law = load_law(name).characteristic
    design = optimal_design(law, limits, runs=runs, points=points, sigma=sigma, fixed=fix or ())
    if out is not None:
        _write(design, out)
    if json:
        print_json(_to_dict(design))
        return
    _print(design)
    if out is not None:
        echo(f"plan: {out / 'plan.csv'}")


def _bench_limits(pressures: tuple[str, str], contractions: tuple[str, str], force: str) -> BenchLimits:
    low, high = (quantity(text, "Pa", where="pressure limits") for text in pressures)
    least, greatest = (quantity(text, "1", where="contraction limits") for text in contractions)
    return BenchLimits(ValidityRange(low, high, least, greatest), quantity(force, "N", where="--max-force"))


def _write(design: ExperimentPlan, out: Path) -> None:
    check_writable(out)
    with atomic_folder(out) as folder:
        write(design.recording(), folder / "plan.csv")


def _format(name: str, value: float) -> str:
    return quantity_text(value, "Pa", "kPa") if name == "pressure" else percent(value)


def _row(number: int, run: PlannedRun) -> tuple[str, ...]:
    constant = f"{run.constant} {_format(run.constant, run.level)}"
    ends = " to ".join(_format(run.swept, end) for end in run.sweep_limits)
    forces = f"{run.force.max():.4g} to {run.force.min():.4g} N"
    return str(number), constant, f"{run.swept} {ends}", str(run.force.size), forces


def _print(design: ExperimentPlan) -> None:
    rows = [_row(i + 1, run) for i, run in enumerate(design.runs)]
    print_table(("run", "constant", "sweep", "points", "expected force"), rows, right=("run", "points"))
    parameters = zip(design.names, design.values, design.standard_errors, strict=True)
    headers = ("parameter", "present value", "expected 2 stderr")
    print_table(headers, [(n, f"{v:.4g}", f"{2 * d:.2g}") for n, v, d in parameters], right=headers[1:])
    echo(
        f"relative D-efficiency {design.relative_d_efficiency:.2f}, compared with the same number of evenly spaced runs"
    )
    for remark in (*design.undetermined, design.assumption):
        echo(f"note: {remark}")


def _to_dict(design: ExperimentPlan) -> dict[str, Any]:
    """A plan as plain data, all numbers SI."""
    parameters = zip(design.names, design.values, design.standard_errors, strict=True)
    return {
        "runs": [
            {"constant": r.constant, "level": r.level, "swept": r.swept, "ends": r.sweep_limits, "points": r.force.size}
            for r in design.runs
        ],
        "parameters": {name: {"value": value, "stderr": stderr} for name, value, stderr in parameters},
        "relative_efficiency": design.relative_d_efficiency,
        "notes": [*(str(remark) for remark in design.undetermined), design.assumption],
    }

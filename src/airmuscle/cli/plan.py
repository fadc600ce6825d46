"""`airmuscle plan`: D-optimal design of static experiments."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from ..characteristic import ValidityRange
from ..core.display import quantity_text
from ..core.units import quantity
from ..identify.experiment_design import BenchLimits, ExperimentPlan, PlannedRun, optimal_design
from ..library.law_file import load_law
from ..recording import write_csv
from ..report.output_folder import atomic_folder, check_writable
from .options import Json, Name, OptionalFolder
from .terminal import echo, percent, print_json, print_table


def plan(
    name: Name,
    max_pressure: Annotated[str, typer.Option(metavar="QUANTITY", help="Maximum pressure, such as '6 bar'.")],
    max_force: Annotated[
        str, typer.Option(metavar="QUANTITY", help="Maximum force of the load cell or frame, such as '1 kN'.")
    ],
    min_pressure: Annotated[str, typer.Option(metavar="QUANTITY", help="Minimum pressure.")] = "50 kPa",
    max_contraction: Annotated[str, typer.Option(metavar="QUANTITY", help="Maximum contraction.")] = "25 %",
    min_contraction: Annotated[
        str, typer.Option(metavar="QUANTITY", help="Minimum contraction; negative if the bench stretches the muscle.")
    ] = "0 %",
    runs: Annotated[int, typer.Option(min=1, max=100, metavar="N", help="Number of runs.")] = 6,
    points: Annotated[int, typer.Option(min=3, max=1000, metavar="N", help="Number of points per run.")] = 15,
    sigma: Annotated[
        float,
        typer.Option(
            metavar="NUMBER",
            help="Standard deviation of a measured value, in the SI unit of the fitted quantity (mostly N).",
        ),
    ] = 1.0,
    fix: Annotated[
        list[str] | None,
        typer.Option("--fix", metavar="PARAMETER", help="Parameter that the fit will keep fixed; repeatable."),
    ] = None,
    out: OptionalFolder = None,
    json: Json = False,
) -> None:
    """Design the most informative static experiments (D-optimal).

    \b
    The runs are isobaric or isometric, within the limits of the test bench. They are D-optimal for fitting the
    characteristic of the muscle, linearised at its present parameter values.
    With --out, DIR/plan.csv contains the points in order, with the expected force.

    \b
    Examples:
      airmuscle plan dmsp-20-300 --max-pressure "6 bar" --max-force "1 kN"
      airmuscle plan my/muscle.toml --max-pressure "4 bar" --max-force "300 N" --runs 4 --out bench
    """
    pressures = [quantity(text, "Pa", where="pressure limits") for text in (min_pressure, max_pressure)]
    contractions = [quantity(text, "1", where="contraction limits") for text in (min_contraction, max_contraction)]
    limits = BenchLimits(ValidityRange(*pressures, *contractions), quantity(max_force, "N", where="--max-force"))
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


def _write(design: ExperimentPlan, out: Path) -> None:
    check_writable(out)
    with atomic_folder(out) as folder:
        write_csv(design.recording(), folder / "plan.csv")


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
    print_table(headers, [(n, f"{v:.5g}", f"{2 * d:.2g}") for n, v, d in parameters], right=headers[1:])
    echo(
        f"relative D-efficiency {design.relative_d_efficiency:.2f}, compared with the same number of evenly spaced runs"
    )
    for remark in design.undetermined:
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
        "notes": [str(remark) for remark in design.undetermined],
    }

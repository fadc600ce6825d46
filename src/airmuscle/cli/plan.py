"""`airmuscle plan`: which static runs to measure."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .options import Json, Name, OptionalFolder
from .terminal import print_json, print_table

if TYPE_CHECKING:
    from ..identify.experiment_design import ExperimentPlan, PlannedRun


def plan(
    name: Name,
    max_pressure: Annotated[str, typer.Option(metavar="QUANTITY", help="Of the bench: '6 bar'.")],
    max_force: Annotated[str, typer.Option(metavar="QUANTITY", help="Of the load cell or frame: '1 kN'.")],
    min_pressure: Annotated[str, typer.Option(metavar="QUANTITY", help="Where runs begin.")] = "50 kPa",
    max_contraction: Annotated[str, typer.Option(metavar="QUANTITY", help="Of the frame.")] = "25 %",
    min_contraction: Annotated[str, typer.Option(metavar="QUANTITY", help="Negative where it stretches.")] = "0 %",
    runs: Annotated[int, typer.Option(min=1, max=100, help="How many runs to measure.")] = 6,
    points: Annotated[int, typer.Option(min=3, max=1000, help="Points of a run.")] = 15,
    sigma: Annotated[
        float, typer.Option(help="Standard deviation of a reading, SI unit of what the law gives (mostly N).")
    ] = 1.0,
    fix: Annotated[
        list[str] | None, typer.Option("--fix", metavar="PARAMETER", help="The fit will not free it; repeat it.")
    ] = None,
    out: OptionalFolder = None,
    json: Json = False,
) -> None:
    """Say which isobaric and isometric runs tell most about a muscle, within the limits of a bench.

    \b
    The runs are D-optimal for fitting the muscle's characteristic, started from the values it has now.
    With --out, DIR/plan.csv: the points in order, with the force to expect.

    \b
    Examples:
      airmuscle plan dmsp-20-300 --max-pressure "6 bar" --max-force "1 kN"
      airmuscle plan my/muscle.toml --max-pressure "4 bar" --max-force "300 N" --runs 4 --out bench
    """
    from ..characteristic.validity_range import ValidityRange
    from ..core.units import quantity
    from ..identify.experiment_design import BenchLimits
    from ..identify.experiment_design import optimal_design as planned
    from ..library.catalogue import load_law

    pressures = [quantity(text, "Pa", where="limits of pressure") for text in (min_pressure, max_pressure)]
    contractions = [quantity(text, "1", where="limits of contraction") for text in (min_contraction, max_contraction)]
    bench = BenchLimits(ValidityRange(*pressures, *contractions), quantity(max_force, "N", where="--max-force"))
    found = planned(load_law(name).characteristic, bench, runs=runs, points=points, sigma=sigma, fixed=fix or ())
    if out is not None:
        _write(found, out)
    if json:
        print_json(_as_data(found))
        return
    _print(found)
    if out is not None:
        typer.echo(f"points to follow: {out / 'plan.csv'}")


def _write(found: ExperimentPlan, out: Path) -> None:
    from ..recording.csv_writer import write_csv
    from ..report.output_folder import atomic_folder, check_writable

    check_writable(out)
    with atomic_folder(out) as place:
        write_csv(found.recording(), place / "plan.csv")


def _words(quantity: str, value: float) -> str:
    return f"{value / 1e3:.4g} kPa" if quantity == "pressure" else f"{value:.2%}"


def _row(number: int, run: PlannedRun) -> tuple[str, ...]:
    held = f"{run.constant} {_words(run.constant, run.level)}"
    ends = " to ".join(_words(run.swept, end) for end in run.sweep_limits)
    forces = f"{run.force.max():.4g} to {run.force.min():.4g} N"
    return str(number), held, f"{run.swept} {ends}", str(run.force.size), forces


def _print(found: ExperimentPlan) -> None:
    rows = [_row(i + 1, run) for i, run in enumerate(found.runs)]
    print_table(("run", "hold", "sweep", "points", "force to expect"), rows, right=("run", "points"))
    parameters = zip(found.names, found.values, found.standard_errors, strict=True)
    rows = [(n, f"{v:.5g}", f"{2 * d:.2g}") for n, v, d in parameters]
    print_table(("parameter", "value now", "2 sd to expect"), rows, right=("value now", "2 sd to expect"))
    typer.echo(f"each run tells {found.relative_d_efficiency:.2f} times as much as one of as many runs spread evenly")
    for remark in found.undetermined:
        typer.echo(f"note: {remark}")


def _as_data(found: ExperimentPlan) -> dict[str, Any]:
    return {
        "runs": [
            {"held": r.constant, "level": r.level, "swept": r.swept, "ends": r.sweep_limits, "points": r.force.size}
            for r in found.runs
        ],
        "parameters": {
            n: {"value": v, "deviation": d}
            for n, v, d in zip(found.names, found.values, found.standard_errors, strict=True)
        },
        "gain": found.relative_d_efficiency,
        "notes": [str(remark) for remark in found.undetermined],
    }

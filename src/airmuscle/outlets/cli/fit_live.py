"""`airmuscle fit-live`: identification while a measurement runs."""

from __future__ import annotations

import sys
from json import dumps
from pathlib import Path
from typing import Annotated

import typer

from ...bench.identify.experiment_design import BenchLimits
from ...bench.identify.recursive_fit import RecursiveFit
from ...bench.readers.follow import RowReader, follow_lines
from ...core.atomic_output import atomic_folder, check_writable
from ...core.display import quantity_text
from ...core.errors import ColumnError, IdentificationError
from ...core.units import quantity
from ...files.library.entry import Entry
from ...files.library.write import save
from ...physics.muscle.characteristic import ValidityRange
from .options import Json, OptionalFolder
from .reading_options import Columns, Constants, DisplacementZero, Length, ReadingOptions, SkipRows, Units
from .terminal import echo, percent

QUANTITIES = ("pressure", "contraction", "force")


def fit_live(
    follow: Annotated[
        str, typer.Option("--follow", metavar="FILE", help="Growing file, pipe or serial port; '-' for standard input.")
    ],
    max_pressure: Annotated[str, typer.Option(metavar="QUANTITY", help="Maximum pressure, such as '6 bar'.")],
    max_force: Annotated[str, typer.Option(metavar="QUANTITY", help="Maximum force of the test rig, such as '1 kN'.")],
    min_pressure: Annotated[str, typer.Option(metavar="QUANTITY", help="Minimum pressure.")] = "0 kPa",
    max_contraction: Annotated[str, typer.Option(metavar="QUANTITY", help="Maximum contraction.")] = "25 %",
    min_contraction: Annotated[str, typer.Option(metavar="QUANTITY", help="Minimum contraction.")] = "0 %",
    resting_length: Length = None,
    unit: Units = None,
    column: Columns = None,
    constant: Constants = None,
    displacement_zero: DisplacementZero = None,
    skip_rows: SkipRows = None,
    degree: Annotated[int, typer.Option(min=1, max=9, metavar="N", help="Degree of the polynomial surface.")] = 5,
    forgetting: Annotated[
        float, typer.Option(metavar="FACTOR", help="Weight of the former samples at each sample; 1: none is forgotten.")
    ] = 1.0,
    every: Annotated[int, typer.Option(min=1, metavar="N", help="Samples between two lines of the output.")] = 1000,
    idle: Annotated[
        float, typer.Option(min=0.0, metavar="SECONDS", help="End when no row has come for so long.")
    ] = 10.0,
    out: OptionalFolder = None,
    json: Json = False,
) -> None:
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
    pressures = [quantity(text, "Pa", where="pressure limits") for text in (min_pressure, max_pressure)]
    contractions = [quantity(text, "1", where="contraction limits") for text in (min_contraction, max_contraction)]
    limits = BenchLimits(ValidityRange(*pressures, *contractions), quantity(max_force, "N", where="--max-force"))
    if out is not None:
        check_writable(out)
    options = ReadingOptions(
        column=column, unit=unit, constant=constant, resting_length=resting_length, skip_rows=skip_rows,
        displacement_zero=displacement_zero,
    )  # fmt: skip
    reader = RowReader("standard input" if follow == "-" else Path(follow).name, options.column_mapping())
    fit = _follow(RecursiveFit(limits, degree, forgetting=forgetting), reader, follow, idle, every, json)
    _finish(fit, reader, out, json)


def _follow(fit: RecursiveFit, reader: RowReader, source: str, idle: float, every: int, json: bool) -> RecursiveFit:
    """The fit to all rows until the stream ends or the user interrupts it."""
    printed = 0
    try:
        for line in follow_lines(sys.stdin if source == "-" else source, idle=idle):
            row = reader.read(line)
            if row is None:
                continue
            if fit.samples + fit.outside == 0:
                _check_columns(reader, row)
            fit = fit.updated(*(row[name] for name in QUANTITIES))
            if fit.samples >= printed + every:
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
        f"the range; next: {quantity_text(point.pressure, 'Pa', 'kPa')}, {percent(point.contraction)} (expected "
        f"{point.force:.4g} ± {2 * point.standard_error:.2g} N)"
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

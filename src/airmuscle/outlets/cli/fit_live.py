"""`airmuscle fit-live`: identification while a measurement runs."""

import dataclasses
import math
import sys
from collections.abc import Mapping
from json import dumps
from pathlib import Path
from typing import Any

import numpy as np

from ...bench.diagnosis import DataUse, support_of
from ...bench.readers import RowReader, follow_lines
from ...bench.statics import BenchLimits, RecursiveFit
from ...core import (
    ColumnError,
    IdentificationError,
    atomic_folder,
    check_writable,
    contraction_text,
    quantity_text,
)
from ...files.library import Entry, save
from ...physics.muscle.characteristic import ValidityRange
from ...recording import Recording
from ..requests.declaration import option, request
from ..requests.reading import Pairs, ReadingRequest
from .options import Json, OptionalFolder
from .requested import with_requests
from .terminal import echo

QUANTITIES = ("pressure", "contraction", "force")
MOST_ROWS = 20_000
"""Greatest number of rows of a stream by which a failed fit is explained (chosen)."""


class SeenRows:
    """Rows of a stream: all of them at first, later every second, fourth and so on, so that their
    number is bounded."""

    def __init__(self) -> None:
        self._rows: list[tuple[float, ...]] = []
        self._count = 0
        self._step = 1

    def add(self, row: Mapping[str, float]) -> None:
        """Take over a row with all quantities."""
        if self._count % self._step == 0:
            self._rows.append(tuple(row[name] for name in QUANTITIES))
        self._count += 1
        if len(self._rows) >= MOST_ROWS:
            self._rows = self._rows[::2]
            self._step *= 2

    def recording(self, origin: str) -> Recording:
        """The rows as a recording."""
        table = np.array(self._rows, dtype=float).reshape(-1, len(QUANTITIES))
        return Recording(dict(zip(QUANTITIES, table.T, strict=True)), origin)


def same(name: str) -> Any:
    """A field as the request of reading declares it."""
    field = ReadingRequest.__dataclass_fields__[name]
    return dataclasses.field(default=field.default, metadata=field.metadata)


@request
class LiveRequest:
    """Limits of the test rig, how the rows are read, and the surface."""

    follow: str = option(
        "Growing file, pipe or serial port; '-' for standard input.", metavar="FILE"
    )
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
        "Weight of the former samples at each sample; 1: none is forgotten.",
        default=1.0,
        metavar="FACTOR",
    )
    every: int = option(
        "Samples between two lines of the output.", default=1000, bounds=(1, math.inf)
    )
    idle: float = option(
        "End when no row has come for so long.",
        default=10.0,
        bounds=(0.0, math.inf),
        metavar="SECONDS",
    )


@with_requests
def fit_live(request: LiveRequest, out: OptionalFolder = None, json: Json = False) -> None:
    """Fit a surface while rows arrive; name the next point.

    \b
    Each row (pressure, contraction or length, force) updates the surface by recursive least
    squares. The next point is the most informative one (D-optimal) within the limits of the test
    rig. With --out, DIR/muscle.toml contains the surface at the end of the stream.

    \b
    Examples:
      airmuscle fit-live --follow log.csv --max-pressure "6 bar" --max-force "1 kN" --out live
      cat /dev/ttyUSB0 | airmuscle fit-live --follow - --column "1=pressure [kPa]" --column
          "2=contraction [%]"
      --column "3=force [N]" --max-pressure "6 bar" --max-force "1 kN"
    """
    pressures = request.min_pressure, request.max_pressure
    limits = ValidityRange(*pressures, request.min_contraction, request.max_contraction)
    if out is not None:
        check_writable(out)
    stated = {
        name: value
        for name, value in vars(request).items()
        if name in ReadingRequest.__dataclass_fields__
    }
    reading = ReadingRequest(**stated)
    origin = "standard input" if request.follow == "-" else Path(request.follow).name
    reader = RowReader(origin, reading.column_mapping())
    fit = RecursiveFit(
        BenchLimits(limits, request.max_force), request.degree, forgetting=request.forgetting
    )
    seen = SeenRows()
    fit = _follow(fit, reader, request, json, seen)
    try:
        _finish(fit, reader, out, json)
    except IdentificationError:
        use = DataUse.COMPARISON if fit.samples else DataUse.PREDICTION
        support_of([seen.recording(reader.origin)]).check(use)
        raise


def _follow(
    fit: RecursiveFit, reader: RowReader, request: LiveRequest, json: bool, seen: SeenRows
) -> RecursiveFit:
    """The fit to all rows until the stream ends or the user interrupts it."""
    printed = 0
    try:
        for line in follow_lines(
            sys.stdin if request.follow == "-" else request.follow, idle=request.idle
        ):
            row = reader.read(line)
            if row is None:
                continue
            if fit.samples + fit.outside == 0:
                for note in reader.notes:
                    echo(f"note: {note}", err=True)
                if name := next((quantity for quantity in QUANTITIES if quantity not in row), ""):
                    remedy = " or a length with --resting-length" if name == "contraction" else ""
                    raise ColumnError(
                        f"{reader.origin}: there is no {name}{remedy}; the columns are"
                        f" {', '.join(row)}. Name it with --column 'NUMBER={name} [unit]'."
                    )
            fit = fit.updated(*(row[name] for name in QUANTITIES))
            seen.add(row)
            if fit.samples >= printed + request.every:
                printed = fit.samples
                _report(fit, json)
    except KeyboardInterrupt:
        echo("interrupted; the fit to the rows so far follows", err=True)
    return fit


def _report(fit: RecursiveFit, json: bool) -> None:
    """One line on the fit and the next point."""
    point = fit.next_point()
    if json:
        report = {
            "samples": fit.samples,
            "rmse": fit.rmse,
            "determined": fit.determined,
            "next": point._asdict(),
        }
        echo(dumps(report))  # one line for each report, for a program that reads them as they come
        return
    echo(
        f"{fit.samples} samples, rms residual {fit.rmse:.4g} N, force determined on"
        f" {100 * fit.determined:.0f} % of the range; next:"
        f" {quantity_text(point.pressure, 'Pa', 'kPa')}, {contraction_text(point.contraction)}"
        f" (expected {point.force:.4g} ± {2 * point.standard_error:.2g} N)"
    )


def _finish(fit: RecursiveFit, reader: RowReader, out: Path | None, json: bool) -> None:
    """The result at the end of the stream. Raises IdentificationError if there are no samples
    within the limits.
    """
    if not fit.samples:
        raise IdentificationError(
            f"{reader.origin}: no row lies within the limits of the test rig ({fit.outside}"
            f" outside, {reader.skipped} unreadable). Check the units and the limits."
        )
    _report(fit, json)
    if fit.outside or reader.skipped:
        echo(
            f"note: left out: {fit.outside} rows outside the limits, {reader.skipped} unreadable"
            " rows",
            err=True,
        )
    if out is None:
        return
    model = fit.model
    title = f"Surface fitted while {reader.origin} was measured"
    note = f"{fit.samples} samples, rms residual {fit.rmse:.4g} N; recursive least squares."
    with atomic_folder(out) as folder:
        save(
            Entry("muscle", title, "fitted", model, note=note, validity_range=model.validity_range),
            folder / "muscle.toml",
        )
    echo(f"muscle: {out / 'muscle.toml'}", err=json)

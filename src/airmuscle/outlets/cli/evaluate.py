"""`airmuscle evaluate`: pressure, contraction or force of a muscle, given the other two."""

from __future__ import annotations

import math
import warnings
from pathlib import Path
from typing import Annotated, Any

import typer

from ...core import leaves
from ...core.absolute_pressure import check_above_vacuum
from ...core.atomic_output import atomic_folder
from ...core.display import quantity_text
from ...core.errors import AirmuscleWarning, GeometryLimitError, PhysicsError, RatingError, SolveError
from ...core.plotting import save
from ...core.units import quantity
from ...files.library.entry import Entry
from ...files.library.entry_file import load_law
from ...files.library.scaling import scale_entry
from ...physics.muscle import Ratings
from ...physics.muscle.characteristic import Characteristic, ForceLaw, ValidityRange
from ...physics.muscle.characteristic.validity_range import validity_range_of
from ...physics.muscle.isobar_plot import describe_point, isobar_plot, isobar_table
from ...physics.muscle.isobars import WorkingPoint, compute_isobars
from ...report.write import save_table
from .options import Diameter, Json, Name, OptionalFolder, RestingLength
from .terminal import echo, percent, print_json, print_table

UNITS = {"pressure": "Pa", "contraction": "1", "force": "N"}

Pressure = Annotated[
    str | None,
    typer.Option(
        metavar="QUANTITY", help="Pressure with unit: '3 bar' (gauge), '400 kPa', '4 bara' (at 101.325 kPa ambient)."
    ),
]
Contraction = Annotated[str | None, typer.Option(metavar="QUANTITY", help="Contraction: 0.12 or '12 %'.")]
Force = Annotated[str | None, typer.Option(metavar="QUANTITY", help="Tension with unit: '100 N', '0.1 kN'.")]


def evaluate(
    name: Name,
    pressure: Pressure = None,
    contraction: Contraction = None,
    force: Force = None,
    resting_length: RestingLength = None,
    diameter: Diameter = None,
    out: OptionalFolder = None,
    json: Json = False,
) -> None:
    """Evaluate a law for two of pressure, contraction and force.

    \b
    If several solutions exist, the result is the one reached from the state of rest.
    A point that the maker does not permit is refused, or, where it was measured, reported with a warning.
    With --out, DIR/isobars.png and DIR/isobars.csv show force over contraction, with the operating point.

    \b
    Examples:
      airmuscle evaluate dmsp-20-300 --pressure "3 bar" --force "100 N"
      airmuscle evaluate dmsp-20-300 --contraction "12 %" --force "100 N" --out chart
      airmuscle evaluate tondu-lopez --diameter "30 mm" --resting-length "200 mm" --pressure "3 bar" --force "100 N"
      airmuscle evaluate my/muscle.toml --pressure "400 kPa" --contraction 0.1 --json
    """
    texts = {"pressure": pressure, "contraction": contraction, "force": force}
    missing = [name for name, text in texts.items() if text is None]
    if len(missing) != 1:
        raise typer.BadParameter(f"give two of --pressure, --contraction and --force, not {3 - len(missing)}")
    entry = scale_entry(load_law(name), resting_length=resting_length, diameter=diameter)
    point = _solve(entry.characteristic, texts)
    validity_range = validity_range_of(entry.characteristic, entry.validity_range)
    _check_ratings(point, entry.ratings, validity_range)
    _warn(point, validity_range)
    if json:
        print_json(_to_dict(entry, point, validity_range, missing[0]))
    else:
        echo(f"{entry.name}: {entry.title}")
        print_table(("quantity", "value", "remark"), _rows(entry, point, missing[0]), right=("value",))
    if out is not None:
        _write(entry, point, validity_range, out)
        echo(f"chart: {out / 'isobars.png'}, data: {out / 'isobars.csv'} ({describe_point(point)})", err=json)


def _solve(characteristic: Characteristic, texts: dict[str, str | None]) -> WorkingPoint:
    """The operating point. Raises SolveError, GeometryLimitError or UnitError."""
    values = {name: quantity(text, UNITS[name], where=f"--{name}") for name, text in texts.items() if text is not None}
    if "pressure" in values:
        check_above_vacuum(values["pressure"])
    if "contraction" in values and isinstance(characteristic, ForceLaw):  # the other laws check it themselves
        _check_contraction(characteristic, values["contraction"])
    (unknown,) = UNITS.keys() - values.keys()
    point = WorkingPoint(**values, **{unknown: float(getattr(characteristic, unknown)(*values.values()))})
    if not math.isfinite(sum(point)) or (unknown == "contraction" and not -0.5 <= point.contraction < 1.0):
        raise SolveError(
            f"{type(characteristic).__name__}: the solution {describe_point(point)} is not physical. "
            "Give values nearer to the validity range of the characteristic (airmuscle show)."
        )
    return point


def _check_contraction(characteristic: Characteristic, contraction: float) -> None:
    low, high = characteristic.contraction_range
    if not low <= contraction <= high:
        as_percentage = contraction >= 1.0 and contraction / 100 <= high
        hint = f" For a percentage, write '{contraction:g} %'." if as_percentage else ""
        raise GeometryLimitError(
            f"--contraction: {100 * contraction:.6g} % is outside the range of {type(characteristic).__name__}, "
            f"{100 * low:.4g} to {100 * high:.4g} %.{hint}"
        )


def _stiffness(entry: Entry, point: WorkingPoint) -> float | None:
    """-dF/deps at constant pressure [N]; None where the force is not unique or not defined."""
    try:
        return float(entry.characteristic.stiffness(point.pressure, point.contraction))
    except PhysicsError:
        return None


def _check_ratings(point: WorkingPoint, ratings: Ratings | None, validity_range: ValidityRange | None) -> None:
    """Warn of a measured point that the maker does not permit. Raises RatingError for one that was not measured."""
    excesses = ratings.excesses(**point._asdict()) if ratings is not None else ()
    if not excesses:
        return
    text = "; ".join(excesses)
    if validity_range is None or not validity_range.contains(point.pressure, point.contraction):
        raise RatingError(
            f"beyond the values that the maker permits, and not measured: {text}. Choose a permitted point, or a "
            "larger muscle."
        )
    warnings.warn(f"beyond the values that the maker permits: {text}.", AirmuscleWarning, stacklevel=2)


def _warn(point: WorkingPoint, validity_range: ValidityRange | None) -> None:
    if point.force < 0:
        warnings.warn("the force is negative; a muscle cannot push and is slack here.", AirmuscleWarning, stacklevel=2)
    if validity_range is not None and not validity_range.contains(point.pressure, point.contraction):
        (p_low, p_high), (c_low, c_high) = validity_range.pressure, validity_range.contraction
        warnings.warn(
            "the operating point is outside the validity range of the characteristic, "
            f"{p_low / 1e3:.4g} to {p_high / 1e3:.4g} kPa and {percent(c_low)} to {percent(c_high)}: "
            "the result is an extrapolation.",
            AirmuscleWarning,
            stacklevel=2,
        )


def _resting_length(entry: Entry) -> float | None:
    parts = (part for part in (entry.geometry, entry.characteristic) if part is not None)
    lengths = (leaf.value for part in parts for leaf in leaves(part) if leaf.path.endswith("resting_length"))
    return next(lengths, None)


def _rows(entry: Entry, point: WorkingPoint, unknown: str) -> list[tuple[str, str, str]]:
    digits = {name: 4 if name == unknown else 6 for name in point._fields}  # a given value is repeated as it was given
    values = {
        "pressure": quantity_text(point.pressure, "Pa", "kPa", digits["pressure"]),
        "contraction": percent(point.contraction),
        "force": quantity_text(point.force, "N", "N", digits["force"]),
    }
    remarks = {"pressure": "gauge"}
    length = _resting_length(entry)
    if length:
        remarks["contraction"] = (
            f"{quantity_text(length * point.contraction, 'm', 'mm')} of {quantity_text(length, 'm', 'mm', 6)}"
        )
    rows = [
        (name, value, "; ".join(filter(None, (remarks.get(name, ""), "solved" if name == unknown else ""))))
        for name, value in values.items()
    ]
    stiffness = _stiffness(entry, point)
    if stiffness is None:
        return rows
    per_length = f"{stiffness / length / 1e3:.4g} N/mm" if length else f"{stiffness / 100:.4g} N/%"
    return [*rows, ("stiffness", per_length, "at constant pressure")]


def _to_dict(entry: Entry, point: WorkingPoint, validity_range: ValidityRange | None, unknown: str) -> dict[str, Any]:
    """The operating point as plain data, all numbers SI."""
    inside = None if validity_range is None else bool(validity_range.contains(point.pressure, point.contraction))
    return {
        "name": entry.name,
        "solved": unknown,
        **point._asdict(),
        "stiffness": _stiffness(entry, point),
        "resting_length": _resting_length(entry),
        "inside_validity_range": inside,
        "permitted": None if entry.ratings is None else not entry.ratings.excesses(**point._asdict()),
        "units": {**UNITS, "pressure": "Pa gauge", "stiffness": "N per unit of contraction", "resting_length": "m"},
    }


def _write(entry: Entry, point: WorkingPoint, validity_range: ValidityRange | None, out: Path) -> None:
    with atomic_folder(out) as folder:
        curves = compute_isobars(entry.characteristic, validity_range, point)
        save_table(isobar_table(curves), folder / "isobars.csv")
        save(
            isobar_plot(entry.characteristic, entry.title, curves, validity_range, point).figure,
            folder / "isobars.png",
        )

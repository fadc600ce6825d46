"""`airmuscle solve`: pressure, contraction and force of a muscle; two of them give the third."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .options import Json, Name, OptionalFolder
from .terminal import print_json, print_table

if TYPE_CHECKING:
    from ..characteristic.base import Characteristic
    from ..characteristic.validity_range import ValidityRange
    from ..library.entry import Entry
    from ..report.isobar_plot import WorkingPoint

UNITS = {"pressure": "Pa", "contraction": "1", "force": "N"}

Pressure = Annotated[
    str | None, typer.Option(metavar="QUANTITY", help="Pressure with its unit: '3 bar' (gauge), '400 kPa', '4 bara'.")
]
Contraction = Annotated[str | None, typer.Option(metavar="QUANTITY", help="Contraction, 0.12 or '12 %'.")]
Force = Annotated[str | None, typer.Option(metavar="QUANTITY", help="Tension with its unit: '100 N', '0.1 kN'.")]


def solve(
    name: Name,
    pressure: Pressure = None,
    contraction: Contraction = None,
    force: Force = None,
    out: OptionalFolder = None,
    json: Json = False,
) -> None:
    """Give two of pressure, contraction and force of a muscle; get the third.

    \b
    Where several answers exist it is the one reached from rest.
    With --out, DIR/isobars.png and DIR/isobars.csv: force over contraction, with the working point.

    \b
    Examples:
      airmuscle solve dmsp-20-300 --pressure "3 bar" --force "100 N"
      airmuscle solve dmsp-20-300 --contraction "12 %" --force "100 N" --out chart
      airmuscle solve my/muscle.toml --pressure "400 kPa" --contraction 0.1 --json
    """
    from ..library.catalogue import load
    from ..report.isobar_plot import describe_point, validity_range_of

    texts = {"pressure": pressure, "contraction": contraction, "force": force}
    missing = [quantity for quantity, text in texts.items() if text is None]
    if len(missing) != 1:
        raise typer.BadParameter(f"give two of --pressure, --contraction and --force; {3 - len(missing)} given")
    entry = load_law(name)
    point, validity_range = (
        _solved(entry.characteristic, texts),
        validity_range_of(entry.characteristic, entry.validity_range),
    )
    _warn(point, validity_range)
    if json:
        print_json(_as_data(entry, point, validity_range, missing[0]))
    else:
        typer.echo(f"{entry.name}: {entry.title}")
        print_table(("quantity", "value", ""), _rows(entry, point, missing[0]), right=("value",))
    if out is not None:
        _write(entry, point, validity_range, out)
        typer.echo(f"chart: {out / 'isobars.png'}, data: {out / 'isobars.csv'} ({describe_point(point)})", err=json)


def _solved(characteristic: Characteristic, texts: dict[str, str | None]) -> WorkingPoint:
    from ..characteristic.base import ForceLaw
    from ..core.errors import SolveError
    from ..core.units import quantity
    from ..pneumatics.gas import Ambient, check_above_vacuum
    from ..report.isobar_plot import WorkingPoint, describe_point

    given = {name: quantity(text, UNITS[name], where=f"--{name}") for name, text in texts.items() if text is not None}
    if "pressure" in given:
        check_above_vacuum(given["pressure"], Ambient())
    if "contraction" in given and isinstance(characteristic, ForceLaw):  # others refuse by themselves
        _check_reachable(characteristic, given["contraction"])
    (wanted,) = UNITS.keys() - given.keys()
    point = WorkingPoint(**given, **{wanted: float(getattr(characteristic, wanted)(*given.values()))})
    if not math.isfinite(sum(point)) or (wanted == "contraction" and not -0.5 <= point.contraction < 1.0):
        raise SolveError(
            f"{type(characteristic).__name__} answers with {describe_point(point)}, which no muscle can be. "
            "The question lies far outside the range of its numbers (airmuscle show)."
        )
    return point


def _check_reachable(characteristic: Characteristic, contraction: float) -> None:
    from ..core.errors import GeometryLimitError

    low, high = characteristic.contraction_range
    if not low <= contraction <= high:
        per_cent = contraction >= 1.0 and contraction / 100 <= high
        hint = f" Is it in per cent? Write '{contraction:g} %'." if per_cent else ""
        raise GeometryLimitError(
            f"--contraction: {type(characteristic).__name__} cannot take a contraction of {100 * contraction:.6g} %; "
            f"it reaches from {100 * low:.4g} to {100 * high:.4g} %.{hint}"
        )


def _stiffness(entry: Entry, point: WorkingPoint) -> float | None:
    """-dF/deps at constant pressure [N]; None where the law has no single force at this point."""
    from ..core.errors import PhysicsError

    try:
        return float(entry.characteristic.stiffness(point.pressure, point.contraction))
    except PhysicsError:
        return None


def _warn(point: WorkingPoint, validity_range: ValidityRange | None) -> None:
    import warnings

    from ..core.errors import AirmuscleWarning

    if point.force < 0:
        warnings.warn("a muscle pulls and never pushes: it is slack here.", AirmuscleWarning, stacklevel=2)
    if validity_range is not None and not validity_range.contains(point.pressure, point.contraction):
        (p_low, p_high), (c_low, c_high) = validity_range.pressure, validity_range.contraction
        warnings.warn(
            "the working point lies outside the range where the muscle was measured or printed, "
            f"{p_low / 1e3:.4g} to {p_high / 1e3:.4g} kPa and {c_low:.2%} to {c_high:.2%}: "
            "the answer is an extrapolation.",
            AirmuscleWarning,
            stacklevel=2,
        )


def _resting_length(entry: Entry) -> float | None:
    from ..core.tree import leaves

    parts = (part for part in (entry.geometry, entry.characteristic) if part is not None)
    found = (leaf.value for part in parts for leaf in leaves(part) if leaf.path.endswith("resting_length"))
    return next(found, None)


def _rows(entry: Entry, point: WorkingPoint, wanted: str) -> list[tuple[str, str, str]]:
    values = {
        "pressure": f"{point.pressure / 1e3:.6g} kPa",
        "contraction": f"{100 * point.contraction:.4g} %",
        "force": f"{point.force:.6g} N",
    }
    notes = {"pressure": "gauge"}
    length = _resting_length(entry)
    if length:
        notes["contraction"] = f"{1e3 * length * point.contraction:.4g} mm of {1e3 * length:.6g} mm"
    rows = [
        (name, value, "; ".join(filter(None, (notes.get(name, ""), "solved" if name == wanted else ""))))
        for name, value in values.items()
    ]
    stiffness = _stiffness(entry, point)
    if stiffness is None:
        return rows
    per_length = f"{stiffness / length / 1e3:.4g} N/mm" if length else f"{stiffness / 100:.4g} N/%"
    return [*rows, ("stiffness", per_length, "at constant pressure")]


def _as_data(entry: Entry, point: WorkingPoint, validity_range: ValidityRange | None, wanted: str) -> dict[str, Any]:
    return {
        "name": entry.name,
        "solved": wanted,
        **point._asdict(),
        "stiffness": _stiffness(entry, point),
        "resting_length": _resting_length(entry),
        "inside_data": None
        if validity_range is None
        else bool(validity_range.contains(point.pressure, point.contraction)),
        "units": {**UNITS, "pressure": "Pa gauge", "stiffness": "N per unit of contraction", "resting_length": "m"},
    }


def _write(entry: Entry, point: WorkingPoint, validity_range: ValidityRange | None, out: Path) -> None:
    from ..core.plotting import save
    from ..report.isobar_plot import compute_isobars, isobar_plot, isobar_table
    from ..report.output_folder import atomic_folder
    from ..report.write import save_table

    with atomic_folder(out) as place:
        curves = compute_isobars(entry.characteristic, validity_range, point)
        save_table(isobar_table(curves), place / "isobars.csv")
        plot = isobar_plot(entry.characteristic, entry.title, curves, validity_range, point)
        save(plot.figure, place / "isobars.png")
